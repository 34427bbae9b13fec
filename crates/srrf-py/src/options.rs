//! The options of a registration, by their names in Python.

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
}

impl Asked {
    /// The library's options.
    ///
    /// # Errors
    /// [`Fault::Option`] names the one that makes no sense.
    #[allow(clippy::needless_update, reason = "options to come keep their defaults")]
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
            ..defaults
        })
    }
}
