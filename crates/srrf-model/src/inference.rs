//! How a trained network is used.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a trained network is used: chosen on validation pairs after the training, and kept in the header of the
/// weights. The paper's use is [`InferenceConfig::paper`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct InferenceConfig {
    /// How often the network is applied, each time to the source as the last pose left it. Default: 2, which
    /// on the validation part takes a tenth off RMSE(R) and a quarter off MAE(R) (`book/src/experiments`).
    #[schemars(range(min = 1, max = 100))]
    pub passes: usize,
    /// Tokens of the dense branch in the last pass, 0 for all points; those of the branch if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 65536))]
    pub last_tokens: Option<usize>,
    /// Where the points of the dense branch go in the last pass.
    pub last_matches: Matches,
    /// Standard deviation, along each axis and in network units (clouds of a root mean square radius of 0.6), of how
    /// far from where the pass before left a point its match is expected, in the passes after the first one (see
    /// [`PositionPrior`](crate::PositionPrior)). Default: none, all places are as likely.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0))]
    pub prior: Option<f64>,
}

/// Where a source point goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Matches {
    /// To the mean of the target points by their probabilities: the paper's soft matching.
    #[default]
    Mean,
    /// To the most probable target point. RGM, too, learns with soft assignments and tests with hard ones. A mean
    /// over two far places is neither of them.
    Best,
}

impl Default for InferenceConfig {
    fn default() -> Self {
        Self { passes: 2, last_tokens: None, last_matches: Matches::Mean, prior: None }
    }
}

impl InferenceConfig {
    /// One pass with soft matches.
    pub fn paper() -> Self {
        Self { passes: 1, ..Self::default() }
    }

    /// Whether this is the default, which weights files leave out.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}
