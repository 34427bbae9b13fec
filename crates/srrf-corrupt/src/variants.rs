//! [`Variants`]: where the paper's text and the reference code differ.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How `density_inc` makes a region denser.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DensityInc {
    /// The paper's text: clusters gain new points with random offsets.
    #[default]
    PaperText,
    /// ModelNet40-C: a cloud of twice the points is thinned everywhere but in the clusters; no
    /// point is new.
    #[serde(rename = "modelnet40_c")]
    ModelNet40C,
}

/// The named choices; the default is the paper's text throughout.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Variants {
    /// The two readings of `density_inc`.
    pub density_inc: DensityInc,
    /// Largest offset of a new point of `density_inc` on each coordinate, canonical unit; only
    /// for [`DensityInc::PaperText`]. The paper gives no number: 0.02 keeps the new points within
    /// the median spacing of 1,024 points on a unit-sphere shape, 0.031.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub density_inc_offset: f64,
    /// Displacement of an `impulse` point on each coordinate, canonical unit. Paper: 0.05;
    /// ModelNet40-C: 0.1.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub impulse_linf: f64,
    /// Largest offset of an `upsampling` point on each coordinate, canonical unit. Paper: 0.08;
    /// ModelNet40-C: 0.05.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub upsampling_linf: f64,
}

/// A length in [`Variants`] that is not a length.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("`{field}` is {value}: it must be a finite number, 0 or more")]
pub struct InvalidVariant {
    /// Name of the field.
    pub field: &'static str,
    /// What it holds.
    pub value: f64,
}

impl Variants {
    /// The paper's text.
    pub fn paper() -> Self {
        Self {
            density_inc: DensityInc::PaperText,
            density_inc_offset: 0.02,
            impulse_linf: 0.05,
            upsampling_linf: 0.08,
        }
    }

    /// The reference code of ModelNet40-C.
    pub fn modelnet40_c() -> Self {
        Self {
            density_inc: DensityInc::ModelNet40C,
            impulse_linf: 0.1,
            upsampling_linf: 0.05,
            ..Self::paper()
        }
    }

    /// Checks the lengths.
    ///
    /// # Errors
    /// [`InvalidVariant`] for the first that is negative, NaN or infinite.
    pub fn validate(&self) -> Result<(), InvalidVariant> {
        let lengths = [
            ("density_inc_offset", self.density_inc_offset),
            ("impulse_linf", self.impulse_linf),
            ("upsampling_linf", self.upsampling_linf),
        ];
        match lengths.into_iter().find(|(_, value)| !value.is_finite() || *value < 0.0) {
            Some((field, value)) => Err(InvalidVariant { field, value }),
            None => Ok(()),
        }
    }
}

impl Default for Variants {
    fn default() -> Self {
        Self::paper()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_checked_and_keys_are_known() {
        assert_eq!(Variants::default().validate(), Ok(()));
        let bad = Variants { impulse_linf: f64::NAN, ..Variants::paper() };
        assert_eq!(bad.validate().unwrap_err().field, "impulse_linf");
        let read: Variants = serde_json::from_str(r#"{"density_inc": "modelnet40_c"}"#).unwrap();
        assert_eq!(read.density_inc, DensityInc::ModelNet40C);
        assert_eq!(read.impulse_linf, 0.05);
        assert!(serde_json::from_str::<Variants>(r#"{"impulse": 0.1}"#).is_err());
    }
}
