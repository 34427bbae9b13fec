//! The typed configuration of a training run: one TOML file, unknown keys are errors, values are
//! checked, and the resolved configuration is saved beside every result.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use srrf_corrupt::{CorruptionKind, PairConfig};
use srrf_model::{SkeletonLossConfig, SrrfConfig, defaults};

use crate::network::Trained;

/// Why a configuration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// The file is no valid TOML, has an unknown key or a value of the wrong type.
    #[error("{path}: {source}")]
    Parse {
        /// The file.
        path: PathBuf,
        /// What the parser said, with line and column.
        #[source]
        source: Box<toml::de::Error>,
    },
    /// A value is out of its range.
    #[error("{path}: `{key}` {why}")]
    Value {
        /// The file.
        path: PathBuf,
        /// The key.
        key: String,
        /// What it must be.
        why: String,
    },
}

/// A training run of the network of sizes `C`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, bound = "")]
pub struct TrainConfig<C: Trained = SrrfConfig> {
    /// What is trained: `srrf` if not given, or a learned baseline, see `configs/baselines/`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<String>,
    /// Name of the model and of its folder under `runs/`.
    pub name: String,
    /// Seed of the initial weights and of every draw.
    pub seed: u64,
    /// Weights to start from; random if not given. What they hold must have the sizes of this network.
    #[serde(default)]
    pub start: Option<StartConfig>,
    /// Where the network runs (`flex`, `ndarray`, `wgpu`, `vulkan`, `cuda`, `libtorch`); `--device` comes before
    /// it, and `flex` is used if neither is given. `cuda:1` is the second of its kind; the shards of a batch go in
    /// turn to the devices of a list, `cuda:0,cuda:1`. A run may go on on others.
    #[serde(default)]
    pub device: Option<String>,
    /// How the gradients of several devices come together. A run may go on with another.
    #[serde(default, skip_serializing_if = "Reduce::is_ordered")]
    pub reduce: Reduce,
    /// The shapes.
    pub data: DataConfig,
    /// How pairs are drawn.
    pub draw: DrawConfig,
    /// How pairs are made.
    #[serde(default)]
    pub pairs: PairConfig,
    /// Sizes of the network.
    pub network: C,
    /// Weights of the losses.
    pub losses: C::LossConfig,
    /// Optimiser and batches.
    pub optimizer: OptimizerConfig,
    /// The stages, one after the other.
    pub stages: Vec<StageConfig>,
    /// Validation and checkpoints.
    #[serde(default)]
    pub keep: KeepConfig,
}

/// How the gradients of several devices come together; the mean either way.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reduce {
    /// They are copied to the first device, which adds them in the order of the shards: the same bytes in every
    /// run, on every backend.
    #[default]
    Ordered,
    /// Burn's own distributed layer: NCCL's all-reduce, on CUDA only, in the order in which devices finish.
    Collective,
}

impl Reduce {
    fn is_ordered(&self) -> bool {
        *self == Self::Ordered
    }
}

/// Weights to start from: files, or names of models in the program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "must be a file or a name, or a table of them by part of the network")]
pub enum StartConfig {
    /// All of a network.
    Whole(String),
    /// Its parts by name (`sem`, `dense`, `skeleton`), each from its own. Others are random.
    Parts(BTreeMap<String, String>),
}

/// The shapes that pairs are made from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataConfig {
    /// `modelnet` (any layout that `--data` accepts) or `shapes` (built in).
    pub source: DataSource,
    /// Where the shapes are; `--data` and `$SRRF_DATA` come before it.
    #[serde(default)]
    pub path: Option<PathBuf>,
    /// Number of built-in shapes; unused for `modelnet`.
    #[serde(default = "default_shapes")]
    pub shapes: usize,
    /// Share of the shards of a `modelnet` run that is made from built-in shapes instead, so that
    /// the network sees surfaces of another world, and clouds that were sampled twice in full.
    #[serde(default)]
    pub built_in: f64,
    /// Shapes split off the training set for validation, spread over it. The test set is never
    /// looked at.
    pub validation: usize,
}

fn default_shapes() -> usize {
    4000
}

/// Kinds of data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DataSource {
    /// The training split of ModelNet40.
    Modelnet,
    /// Procedural shapes, no download.
    Shapes,
}

/// How the corruption and the pose of a training pair are drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DrawConfig {
    /// Types to draw from; all 12 if empty.
    #[serde(default)]
    pub corruptions: Vec<CorruptionKind>,
    /// Severities to draw from, 1 to 5.
    pub severities: Vec<u8>,
    /// Share of pairs without corruption.
    pub clean: f64,
    /// Share of pairs with a small pose only (`residual_deg`, `residual_translation`), so that the
    /// network can be applied to its own result.
    pub residual: f64,
    /// Largest angle of such a pair, about a random axis, in degrees.
    pub residual_deg: f64,
    /// Largest translation of such a pair along each axis.
    pub residual_translation: f64,
    /// Share of shards whose clouds are sampled independently, without a common point.
    pub independent: f64,
    /// Points a cloud in such a shard (ModelNet40's 1,024 points make two halves of 512).
    pub independent_points: usize,
    /// Share of pairs whose shape is turned at random before anything else, and whose pose is a
    /// turn about a random axis by up to `turned_deg`, so that the network counts neither on
    /// upright objects nor on DCP's positive angles.
    pub turned: f64,
    /// Largest angle of such a pose, in degrees.
    pub turned_deg: f64,
    /// Share of pairs that overlap in part only: each cloud keeps the part on one side of a plane,
    /// after its corruption.
    #[serde(default)]
    pub cropped: f64,
    /// Such a cloud keeps a share of its points between this and 1. RPMNet: 0.7.
    #[serde(default = "default_crop_keep")]
    pub crop_keep: f64,
}

fn default_crop_keep() -> f64 {
    0.7
}

/// Weights of the losses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LossConfig {
    /// The skeleton losses.
    pub skeleton: SkeletonLossConfig,
    /// Weight of `L_reg` of each branch; 1 is the paper. The other losses of a trained network are ten to a hundred
    /// times as large.
    #[serde(default = "defaults::one", skip_serializing_if = "defaults::is_one")]
    pub registration: f64,
    /// Weight of the correspondence loss of each branch; 0 is the paper.
    pub correspondence: f64,
    /// Weight of the matching loss of each branch ([`srrf_model::matching_loss`]); 0 is the paper.
    #[serde(default, skip_serializing_if = "defaults::is_zero")]
    pub matching: f64,
    /// Weight of `L_reg` of the fused pose, beside `registration` for that of each branch. At 0 the integration is left
    /// out of the training step, which saves its inlier test; the branches learn from their own poses.
    #[serde(default = "defaults::one")]
    pub fused: f64,
}

/// Optimiser and batches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OptimizerConfig {
    /// `adam` (weight decay added to the gradient, as PyTorch's Adam), `adamw` (decoupled) or `sgd`.
    pub kind: OptimizerKind,
    /// Pairs a step. The paper's schedule is DCP's, which uses 32.
    pub batch: usize,
    /// Pairs a shard: a batch is split into shards, each with its own graph and thread. The
    /// gradient is summed in the order of the shards, so the number of threads changes nothing.
    pub shard: usize,
    /// Weight decay. DCP: 1e-4.
    pub weight_decay: f64,
    /// Second moment's decay. Adam: 0.999. Unused by `sgd`.
    pub beta_2: f64,
    /// Momentum of `sgd`; none if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub momentum: Option<f64>,
    /// The gradient is scaled down to this norm; 0 for never.
    pub clip_norm: f64,
}

impl OptimizerConfig {
    /// Shards a batch.
    pub fn shards(&self) -> usize {
        self.batch / self.shard
    }
}

/// Kinds of optimisers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OptimizerKind {
    /// Adam with L2 weight decay.
    Adam,
    /// Adam with decoupled weight decay.
    Adamw,
    /// Stochastic gradient descent with momentum.
    Sgd,
}

/// What a stage does to the skeleton module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SemTraining {
    /// It is used as it is.
    Frozen,
    /// Chamfer pre-training.
    Chamfer,
    /// The skeleton losses.
    Skeleton,
}

/// One stage of the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageConfig {
    /// Name in logs.
    pub name: String,
    /// Length in passes over the training shapes, one pair a shape; may be a fraction.
    pub epochs: f64,
    /// What happens to the skeleton module.
    #[serde(default = "frozen")]
    pub sem: SemTraining,
    /// Whether the registration is trained: the two branches of SRRF, the whole of a baseline.
    #[serde(default = "yes")]
    pub registration: bool,
    /// Learning rate at the start (after warm-up).
    pub learning_rate: f64,
    /// How it falls.
    pub schedule: Schedule,
}

fn frozen() -> SemTraining {
    SemTraining::Frozen
}

fn yes() -> bool {
    true
}

/// How the learning rate falls within a stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Schedule {
    /// Multiplied by `factor` at each milestone. Milestones are epochs of a run of `of_epochs`;
    /// where the stage is shorter or longer they move in proportion.
    Milestones {
        /// Epochs at which the rate falls. The paper: 75, 150, 200.
        at: Vec<f64>,
        /// Length of the run they were made for. The paper: 250.
        of_epochs: f64,
        /// The paper: 0.1.
        factor: f64,
    },
    /// Linear warm-up, then half a cosine to zero.
    Cosine {
        /// Share of the stage that warms up.
        warmup: f64,
    },
}

/// Validation and checkpoints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct KeepConfig {
    /// A checkpoint is written after this many minutes...
    pub checkpoint_minutes: f64,
    /// ...and at the end of each epoch of this many (0 for never).
    pub checkpoint_epochs: f64,
    /// Validation runs each time this share of an epoch is done.
    pub validate_epochs: f64,
    /// Severity of the validation pairs.
    pub validate_severity: u8,
}

impl Default for KeepConfig {
    fn default() -> Self {
        Self { checkpoint_minutes: 5.0, checkpoint_epochs: 1.0, validate_epochs: 0.25, validate_severity: 3 }
    }
}

/// The `method` of a configuration file, `srrf` if it names none.
///
/// # Errors
/// [`ConfigError`] when the file cannot be read, is no TOML, or the method is no text.
pub fn method_of(path: &Path) -> Result<String, ConfigError> {
    #[derive(Deserialize)]
    struct Method {
        method: Option<String>,
    }
    let text =
        std::fs::read_to_string(path).map_err(|source| ConfigError::Read { path: path.into(), source })?;
    let found: Method = toml::from_str(&text)
        .map_err(|source| ConfigError::Parse { path: path.into(), source: Box::new(source) })?;
    Ok(found.method.unwrap_or_else(|| SrrfConfig::METHOD.to_string()))
}

impl<C: Trained> TrainConfig<C> {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// [`ConfigError`], which names the file and the key.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| ConfigError::Read { path: path.into(), source })?;
        let config: Self = toml::from_str(&text)
            .map_err(|source| ConfigError::Parse { path: path.into(), source: Box::new(source) })?;
        match config.wrong_value() {
            Some((key, why)) => Err(ConfigError::Value { path: path.into(), key, why }),
            None => Ok(config),
        }
    }

    /// The first value out of its range, with what it must be.
    fn wrong_value(&self) -> Option<(String, String)> {
        let wrong = |key: &str, why: &str| Some((key.to_string(), why.to_string()));
        if self.method.as_deref().unwrap_or(SrrfConfig::METHOD) != C::METHOD {
            return wrong("method", "is another than the one that reads this");
        }
        if self.name.is_empty() || self.name.contains(['/', '\\']) {
            return wrong("name", "must be a file name");
        }
        if self.data.validation == 0 {
            return wrong("data.validation", "must be 1 or more");
        }
        if self.data.source == DataSource::Shapes && self.data.shapes <= self.data.validation {
            return wrong("data.shapes", "must be more than data.validation");
        }
        if self.draw.severities.is_empty() || self.draw.severities.iter().any(|s| !(1..=5).contains(s)) {
            return wrong("draw.severities", "must be a list of numbers from 1 to 5");
        }
        let shares = [
            ("draw.clean", self.draw.clean),
            ("draw.residual", self.draw.residual),
            ("draw.independent", self.draw.independent),
            ("draw.turned", self.draw.turned),
            ("draw.cropped", self.draw.cropped),
            ("draw.crop_keep", self.draw.crop_keep),
            ("data.built_in", self.data.built_in),
        ];
        if let Some((key, _)) = shares.iter().find(|(_, share)| !(0.0..=1.0).contains(share)) {
            return wrong(key, "must lie between 0 and 1");
        }
        if self.pairs.points < 16 || self.draw.independent_points < 16 {
            return wrong("pairs.points", "and draw.independent_points must be 16 or more");
        }
        let optimizer = &self.optimizer;
        if optimizer.batch == 0 || optimizer.shard == 0 || !optimizer.batch.is_multiple_of(optimizer.shard) {
            return wrong("optimizer.batch", "must be a multiple of optimizer.shard, both 1 or more");
        }
        if !(1..=5).contains(&self.keep.validate_severity) {
            return wrong("keep.validate_severity", "must be 1 to 5");
        }
        if self.stages.is_empty() {
            return wrong("stages", "must hold at least one stage");
        }
        for (i, stage) in self.stages.iter().enumerate() {
            let key = |field: &str| format!("stages[{i}].{field}");
            if stage.epochs.is_nan() || stage.epochs <= 0.0 || !stage.epochs.is_finite() {
                return wrong(&key("epochs"), "must be more than 0");
            }
            if stage.learning_rate.is_nan() || stage.learning_rate <= 0.0 {
                return wrong(&key("learning_rate"), "must be more than 0");
            }
            if let Some((field, why)) = C::wrong_stage(stage) {
                return wrong(&key(field), why);
            }
        }
        if self.data.source == DataSource::Shapes && self.seed == srrf_eval::data::TEST_SHAPES_SEED {
            return wrong("seed", "is the one of the shapes that srrf-eval tests on; choose another");
        }
        let checked = self.network.check();
        checked.err().map(|wrong| (format!("network.{}", wrong.key), wrong.why))
    }
}
