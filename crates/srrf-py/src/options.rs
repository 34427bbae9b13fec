//! The options of a registration, by their names in Python.

use pyo3::prelude::*;
use srrf::{Method, Options, Probability, RotationRange};

use crate::refusal::{Fault, Refusal};

/// The options as Python gives them.
#[derive(Debug, Clone)]
pub struct Asked {
    pub method: String,
    pub rotation: String,
    pub refine: bool,
    pub weights: Option<String>,
    pub device: String,
    pub seed: u64,
    pub abstain_below: f64,
    pub scale: Option<AskedScale>,
}

/// What the source is multiplied by.
#[derive(Debug, Clone, FromPyObject)]
pub enum AskedScale {
    Factor(f64),
    Word(String),
}

/// As [`AskedScale`], understood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Nothing was said: an error where the clouds seem to be in different units.
    Ask,
    /// By this.
    Factor(f64),
    /// By what fits.
    Auto,
}

impl Asked {
    /// What is said of the scale.
    ///
    /// # Errors
    /// [`Fault::Option`].
    pub fn scale(&self) -> Result<Scale, Refusal> {
        match &self.scale {
            None => Ok(Scale::Ask),
            Some(AskedScale::Factor(factor)) if factor.is_finite() && *factor > 0.0 => {
                Ok(Scale::Factor(*factor))
            }
            Some(AskedScale::Word(word)) if word == "auto" => Ok(Scale::Auto),
            Some(other) => {
                let said = match other {
                    AskedScale::Factor(factor) => factor.to_string(),
                    AskedScale::Word(word) => format!("`{word}`"),
                };
                let message =
                    format!("scale is {said}: expected a finite number above 0, such as 0.001, or \"auto\"");
                Err(Refusal::new(Fault::Option, message))
            }
        }
    }

    /// The library's options.
    ///
    /// # Errors
    /// [`Fault::Option`] names the one that makes no sense.
    pub fn options(self) -> Result<Options, Refusal> {
        let refuse = |message: String| Refusal::new(Fault::Option, message);
        let method: Method = self.method.parse().map_err(|e: srrf::OptionsError| refuse(e.to_string()))?;
        let rotation = match self.rotation.as_str() {
            "so3" => RotationRange::Any,
            name => name.parse().map_err(|e: srrf::OptionsError| refuse(e.to_string()))?,
        };
        let below = self.abstain_below;
        let abstain_below = Probability::new(below)
            .ok_or_else(|| refuse(format!("abstain_below is {below}: a probability is from 0 to 1")))?;
        let defaults = Options::default();
        Ok(Options {
            method,
            rotation,
            refine: defaults.refine.filter(|_| self.refine),
            weights: self.weights,
            device: self.device,
            seed: self.seed,
            abstain_below,
            check_scale: self.scale.is_none(),
        })
    }
}
