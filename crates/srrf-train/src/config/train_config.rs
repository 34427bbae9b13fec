//! [`TrainConfig`]: what a run is, as it is read and checked.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::{JsonSchema, schema_for};
use serde::{Deserialize, Serialize};
use srrf_corrupt::PairConfig;
use srrf_model::SrrfConfig;
use srrf_model::ranges::out_of_range;

use super::error::ConfigError;
use super::extends::Layers;
use super::sections::{DataConfig, DataSource, DrawConfig, KeepConfig, OptimizerConfig};
use super::sweep::read_layers;
use crate::seam::{StageOf, Trained};

/// A training run of the network of sizes `C`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, bound = "")]
#[schemars(bound = "")]
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
    #[schemars(length(min = 1, max = 1000))]
    pub stages: Vec<StageOf<C>>,
    /// Validation and checkpoints.
    #[serde(default)]
    pub keep: KeepConfig,
}

/// Weights to start from: files, or names of models in the program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "must be a file or a name, or a table of them by part of the network")]
pub enum StartConfig {
    /// All of a network.
    Whole(String),
    /// Its parts by name (`sem`, `dense`, `skeleton`), each from its own. Others are random.
    Parts(BTreeMap<String, String>),
}

impl<C: Trained> TrainConfig<C> {
    /// Reads and checks a file, or a run of a list, `list.toml#name`.
    ///
    /// # Errors
    /// [`ConfigError`], which names the file and the key.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        Self::resolve(&read_layers(path)?)
    }

    /// Resolves and checks what files say together.
    ///
    /// # Errors
    /// [`ConfigError`], which names the file and the key.
    pub fn resolve(layers: &Layers) -> Result<Self, ConfigError> {
        let config: Self = match layers.alone() {
            Some(text) => toml::from_str(text).map_err(|source| ConfigError::Parse {
                path: layers.file_of("").into(),
                source: Box::new(source),
            })?,
            None => serde_path_to_error::deserialize(layers.merged()).map_err(|error| {
                let key = error.path().to_string();
                let path = layers.file_of(&key).into();
                ConfigError::Key { path, key, source: Box::new(error.into_inner()) }
            })?,
        };
        match config.wrong_value() {
            Some((key, why)) => Err(ConfigError::Value { path: layers.file_of(&key).into(), key, why }),
            None => Ok(config),
        }
    }

    /// The first value out of its range, with what it must be.
    fn wrong_value(&self) -> Option<(String, String)> {
        let wrong = |key: &str, why: &str| Some((key.to_string(), why.to_string()));
        if self.method.as_deref().unwrap_or(SrrfConfig::METHOD) != C::METHOD {
            return wrong("method", "is another than the one that reads this");
        }
        if !is_file_name(&self.name) {
            return wrong("name", "must be a file name: letters, digits, `.`, `_`, `-`, and not a dot first");
        }
        match toml::Value::try_from(self) {
            Ok(value) => {
                if let Some(found) = out_of_range(&schema_for!(Self), &value) {
                    return Some(found);
                }
            }
            Err(why) => return Some(("seed".into(), format!("cannot be written as TOML: {why}"))),
        }
        if self.data.source == DataSource::Shapes && self.data.shapes <= self.data.validation {
            return wrong("data.shapes", "must be more than data.validation");
        }
        if self.data.source == DataSource::Shapes && self.data.path.is_some() {
            return wrong("data.path", "is for `source = \"modelnet\"`; built-in shapes are in no file");
        }
        if self.pairs.points < 16 {
            return wrong("pairs.points", "must be 16 or more");
        }
        let optimizer = &self.optimizer;
        if !optimizer.batch.is_multiple_of(optimizer.shard) {
            return wrong("optimizer.batch", "must be a multiple of optimizer.shard");
        }
        for (i, stage) in self.stages.iter().enumerate() {
            if let Some((field, why)) = C::wrong_parts(&stage.trains) {
                return wrong(&format!("stages[{i}].{field}"), why);
            }
        }
        if self.data.source == DataSource::Shapes && self.seed == srrf_eval::data::TEST_SHAPES_SEED {
            return wrong("seed", "is the one of the shapes that srrf-eval tests on; choose another");
        }
        let checked = self.network.check();
        checked.err().map(|wrong| (format!("network.{}", wrong.key), wrong.why))
    }
}

/// Whether a name can be that of a folder, of weights and of a row in a table, on every system.
fn is_file_name(name: &str) -> bool {
    let plain = |c: char| c.is_alphanumeric() || "._-+ ".contains(c);
    !name.is_empty() && name.len() <= 100 && !name.starts_with(['.', ' ', '-']) && name.chars().all(plain)
}
