//! Units and scale: how the source is brought to the unit of the target.

use std::str::FromStr;

use clap::Args;
use serde_json::{Value, json};
use srrf::{AppliedScale, Error, Options, Outcome, Registrar, Request, ScaleOrigin};
use srrf_args::Failure;
use srrf_args::files::Input;
use srrf_args::words::length;
use srrf_cloud::LengthUnit;

/// A factor, or that it is to be found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ScaleChoice {
    /// By this factor.
    Factor(f64),
    /// By the one that fits.
    Auto,
}

impl FromStr for ScaleChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.eq_ignore_ascii_case("auto") {
            return Ok(Self::Auto);
        }
        let factor = text.parse().ok().filter(|f: &f64| f.is_finite() && *f > 0.0);
        factor.map(Self::Factor).ok_or_else(|| "a finite number above 0, such as 0.001, or `auto`".into())
    }
}

/// What the source is multiplied by.
#[derive(Debug, Clone, Copy, Args)]
pub struct ScaleArgs {
    /// Unit of the source: um, mm, cm, m, km, in, ft or us-ft. The source is brought to the target's unit
    #[arg(long, value_name = "UNIT", requires = "target_unit", conflicts_with = "scale")]
    source_unit: Option<LengthUnit>,

    /// Unit of the target, which is that of the answer
    #[arg(long, value_name = "UNIT", requires = "source_unit", conflicts_with = "scale")]
    target_unit: Option<LengthUnit>,

    /// Multiply the source by this factor before it is moved; `auto` estimates it [default: 1, and an error where the
    /// clouds seem to be in different units]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    scale: Option<ScaleChoice>,
}

impl ScaleArgs {
    /// The factor that was given, and how.
    fn given(&self) -> Option<AppliedScale> {
        let applied = |factor, origin| Some(AppliedScale { factor, spread: None, origin });
        match (self.source_unit, self.target_unit, self.scale) {
            (Some(source), Some(target), _) => applied(source.in_units_of(target), ScaleOrigin::Units),
            (_, _, Some(ScaleChoice::Factor(factor))) => applied(factor, ScaleOrigin::Given),
            _ => None,
        }
    }

    /// Whether both clouds are taken to be in one unit, once [`apply`](Self::apply) was applied.
    pub fn is_one_unit(&self) -> bool {
        self.scale != Some(ScaleChoice::Auto)
    }

    /// The options, with a question about the scale where none was given.
    pub fn options(&self, options: Options) -> Options {
        Options { check_scale: self.given().is_none() && self.scale.is_none(), ..options }
    }

    /// Whether the source will have another size: its points alone can be written then.
    pub fn changes_size(&self) -> bool {
        self.scale == Some(ScaleChoice::Auto) || self.given().is_some_and(|given| given.factor != 1.0)
    }

    /// Multiplies the source by the factor that was given.
    ///
    /// # Errors
    /// [`Failure::usage`] where coordinates become too large.
    pub fn apply(&self, source: &mut Input) -> Result<(), Failure> {
        if let Some(AppliedScale { factor, .. }) = self.given().filter(|given| given.factor != 1.0) {
            source.cloud = source.cloud.scaled(factor).map_err(|e| {
                Failure::usage(format!("{:?}, multiplied by {factor}: {e}", source.name)).because(e)
            })?;
        }
        Ok(())
    }

    /// Registers a source to which [`apply`](Self::apply) was applied. With `--scale auto` the source is multiplied by what was found.
    ///
    /// # Errors
    /// As [`Registrar::register`].
    pub fn register(&self, registrar: &Registrar, request: &Request<'_>) -> Result<Outcome, Error> {
        if self.scale == Some(ScaleChoice::Auto) {
            return registrar.register_with_scale(request);
        }
        let mut outcome = registrar.register(request)?;
        outcome.scale = self.given();
        Ok(outcome)
    }

    /// For records of what an answer was made with.
    pub fn describe(&self) -> Option<Value> {
        match (self.scale, self.given()) {
            (Some(ScaleChoice::Auto), _) => Some(json!("auto")),
            (_, Some(given)) => Some(json!(given.factor)),
            _ => None,
        }
    }
}

/// The factor of an answer in words.
pub fn text(outcome: &Outcome) -> Option<String> {
    let AppliedScale { factor, spread, origin } = outcome.scale?;
    let how = match (origin, spread) {
        (ScaleOrigin::Units, _) => "by the units".to_owned(),
        (ScaleOrigin::Given, _) => "as given".to_owned(),
        (ScaleOrigin::Estimated, Some(spread)) => format!("estimated, standard error {}", length(spread, 2)),
        (ScaleOrigin::Estimated, None) => "estimated, but undetermined".to_owned(),
    };
    Some(format!("the source times {} ({how}), and then the pose", length(factor, 6)))
}

/// The cloud of the source as it was registered.
///
/// # Errors
/// [`Failure::usage`] where coordinates become too large.
pub fn applied(outcome: &Outcome, source: &mut Input) -> Result<(), Failure> {
    match outcome.scale {
        Some(AppliedScale { factor, origin: ScaleOrigin::Estimated, .. }) => {
            source.cloud = source.cloud.scaled(factor).map_err(|e| Failure::cloud(&source.name, &e))?;
            Ok(())
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_numbers_above_0_or_auto() {
        assert_eq!("0.001".parse(), Ok(ScaleChoice::Factor(0.001)));
        assert_eq!("Auto".parse(), Ok(ScaleChoice::Auto));
        for bad in ["0", "-1", "nan", "inf", "mm", ""] {
            assert!(bad.parse::<ScaleChoice>().is_err(), "{bad}");
        }
    }

    #[test]
    fn units_are_a_factor() {
        let args = ScaleArgs {
            source_unit: Some(LengthUnit::Millimetre),
            target_unit: Some(LengthUnit::Metre),
            scale: None,
        };
        assert_eq!(args.describe(), Some(json!(0.001)));
        assert!(!args.options(Options::default()).check_scale);
        let none = ScaleArgs { source_unit: None, target_unit: None, scale: None };
        assert!(none.options(Options::default()).check_scale && none.given().is_none());
        let sizes = [ScaleChoice::Auto, ScaleChoice::Factor(2.0), ScaleChoice::Factor(1.0)]
            .map(|scale| ScaleArgs { scale: Some(scale), ..none }.changes_size());
        assert_eq!((sizes, args.changes_size(), none.changes_size()), ([true, true, false], true, false));
    }
}
