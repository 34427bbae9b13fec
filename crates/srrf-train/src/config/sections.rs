//! The sections of a configuration: data, draws, optimiser, validation and checkpoints.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use srrf_corrupt::CorruptionKind;

/// The shapes that pairs are made from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DataConfig {
    /// `modelnet` (any layout that `--data` accepts) or `shapes` (built in).
    pub source: DataSource,
    /// Where the shapes are; `--data` and `$SRRF_DATA` come before it.
    #[serde(default)]
    pub path: Option<PathBuf>,
    /// Number of built-in shapes; unused for `modelnet`, unless `built_in` asks for some.
    #[serde(default = "default_shapes")]
    #[schemars(range(min = 1, max = 10_000_000))]
    pub shapes: usize,
    /// Share of the shards of a `modelnet` run that is made from built-in shapes instead, so that
    /// the network sees surfaces of another world, and clouds that were sampled twice in full.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub built_in: f64,
    /// Shapes split off the training set for validation, spread over it. The test set is never
    /// looked at.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub validation: usize,
}

fn default_shapes() -> usize {
    4000
}

/// Kinds of data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DataSource {
    /// The training split of ModelNet40.
    Modelnet,
    /// Procedural shapes, no download.
    Shapes,
}

/// How the corruption and the pose of a training pair are drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DrawConfig {
    /// Types to draw from; all 12 if empty.
    #[serde(default)]
    pub corruptions: Vec<CorruptionKind>,
    /// Severities to draw from.
    #[schemars(length(min = 1, max = 1000), inner(range(min = 1, max = 5)))]
    pub severities: Vec<u8>,
    /// Share of pairs without corruption.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub clean: f64,
    /// Share of pairs with a small pose only (`residual_deg`, `residual_translation`), so that the
    /// network can be applied to its own result.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub residual: f64,
    /// Largest angle of such a pair, about a random axis, in degrees.
    #[schemars(range(min = 0.0, max = 180.0))]
    pub residual_deg: f64,
    /// Largest translation of such a pair along each axis.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub residual_translation: f64,
    /// Share of shards whose clouds are sampled independently, without a common point.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub independent: f64,
    /// Points a cloud in such a shard (ModelNet40's 1,024 points make two halves of 512).
    #[schemars(range(min = 16, max = 65536))]
    pub independent_points: usize,
    /// Share of pairs whose shape is turned at random before anything else, and whose pose is a
    /// turn about a random axis by up to `turned_deg`, so that the network counts neither on
    /// upright objects nor on DCP's positive angles.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub turned: f64,
    /// Largest angle of such a pose, in degrees.
    #[schemars(range(min = 0.0, max = 180.0))]
    pub turned_deg: f64,
    /// Share of pairs that overlap in part only: each cloud keeps the part on one side of a plane,
    /// after its corruption.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub cropped: f64,
    /// Such a cloud keeps a share of its points between this and 1. RPMNet: 0.7.
    #[serde(default = "default_crop_keep")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub crop_keep: f64,
}

fn default_crop_keep() -> f64 {
    0.7
}

/// Optimiser and batches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OptimizerConfig {
    /// `adam` (weight decay added to the gradient, as PyTorch's Adam), `adamw` (decoupled) or `sgd`.
    pub kind: OptimizerKind,
    /// Pairs a step. The paper's schedule is DCP's, which uses 32.
    #[schemars(range(min = 1, max = 65536))]
    pub batch: usize,
    /// Pairs a shard: a batch is split into shards, each with its own graph and thread. The
    /// gradient is summed in the order of the shards, so the number of threads changes nothing.
    #[schemars(range(min = 1, max = 65536))]
    pub shard: usize,
    /// Weight decay. DCP: 1e-4.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub weight_decay: f64,
    /// Second moment's decay. Adam: 0.999. Unused by `sgd`.
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 1.0))]
    pub beta_2: f64,
    /// Momentum of `sgd`; none if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 1.0))]
    pub momentum: Option<f64>,
    /// The gradient is scaled down to this norm; 0 for never.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub clip_norm: f64,
}

impl OptimizerConfig {
    /// Shards a batch.
    pub fn shards(&self) -> usize {
        self.batch / self.shard
    }
}

/// Kinds of optimisers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OptimizerKind {
    /// Adam with L2 weight decay.
    Adam,
    /// Adam with decoupled weight decay.
    Adamw,
    /// Stochastic gradient descent with momentum.
    Sgd,
}

/// Validation and checkpoints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct KeepConfig {
    /// A checkpoint is written after this many minutes...
    #[schemars(range(max = 100000.0), extend("exclusiveMinimum" = 0.0))]
    pub checkpoint_minutes: f64,
    /// ...and at the end of each epoch of this many (0 for never).
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub checkpoint_epochs: f64,
    /// Validation runs each time this share of an epoch is done.
    #[schemars(range(max = 100000.0), extend("exclusiveMinimum" = 0.0))]
    pub validate_epochs: f64,
    /// Severity of the validation pairs.
    #[schemars(range(min = 1, max = 5))]
    pub validate_severity: u8,
}

impl Default for KeepConfig {
    fn default() -> Self {
        Self { checkpoint_minutes: 5.0, checkpoint_epochs: 1.0, validate_epochs: 0.25, validate_severity: 3 }
    }
}
