//! One stage of a run, and how the learning rate falls within it.

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// One stage of the run. `P` says what of the network it trains; its keys stand beside these.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, bound = "P: Serialize + DeserializeOwned")]
#[schemars(bound = "P: JsonSchema")]
pub struct StageConfig<P> {
    /// Name in logs.
    pub name: String,
    /// Length in passes over the training shapes, one pair a shape; may be a fraction.
    #[schemars(range(max = 100000.0), extend("exclusiveMinimum" = 0.0))]
    pub epochs: f64,
    /// What of the network it trains.
    #[serde(flatten)]
    pub trains: P,
    /// Learning rate at the start (after warm-up).
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0))]
    pub learning_rate: f64,
    /// How it falls.
    pub schedule: RateSchedule,
}

/// How the learning rate falls within a stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum RateSchedule {
    /// Multiplied by `factor` at each milestone. Milestones are epochs of a run of `of_epochs`;
    /// where the stage is shorter or longer they move in proportion.
    Milestones {
        /// Epochs at which the rate falls. The paper: 75, 150, 200.
        #[schemars(length(max = 1000), inner(range(min = 0.0, max = 100000.0)))]
        at: Vec<f64>,
        /// Length of the run they were made for. The paper: 250.
        #[schemars(range(max = 100000.0), extend("exclusiveMinimum" = 0.0))]
        of_epochs: f64,
        /// The paper: 0.1.
        #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
        factor: f64,
    },
    /// Linear warm-up, then half a cosine to zero.
    Cosine {
        /// Share of the stage that warms up.
        #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 1.0))]
        warmup: f64,
    },
}
