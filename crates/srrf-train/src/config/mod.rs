//! The typed configuration of a training run: a TOML file, or a small one that `extends` another. Unknown keys are errors,
//! every number has a range, and the resolved configuration is saved beside every result.

mod error;
mod extends;
mod keys;
mod sections;
mod sweep;
mod train_config;

pub use error::ConfigError;
pub use extends::Layers;
pub use keys::{Keys, key_reference};
pub use sections::{DataConfig, DataSource, DrawConfig, KeepConfig, OptimizerConfig, OptimizerKind};
pub use sweep::{SweepRun, read_layers, read_sweep};
pub use train_config::{StartConfig, TrainConfig};
