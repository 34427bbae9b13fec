//! [`AppliedScale`]: what a source was multiplied by.

use schemars::JsonSchema;
use serde::Serialize;

/// Where the factor of a source comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ScaleOrigin {
    /// Units that were given.
    Units,
    /// A factor that was given.
    Given,
    /// Found in the clouds.
    Estimated,
}

/// A factor by which the coordinates of the source were multiplied before its pose was found:
/// `target ~ R (factor * source) + t`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct AppliedScale {
    /// The factor.
    pub factor: f64,
    /// Its standard error (a jackknife over eighths of the space), where it was estimated.
    pub spread: Option<f64>,
    /// Where it comes from.
    pub origin: ScaleOrigin,
}
