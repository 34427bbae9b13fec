//! Trains the SRRF network and the learned baselines: configuration, pairs, schedule, checkpoints, the
//! loop. [`seam`] is what lies between the loop and what it trains.

pub mod checkpoint;
pub mod cli;
pub mod config;
pub mod data;
mod error;
mod export;
mod folder;
mod log;
pub mod nets;
pub mod optimizer;
mod options;
pub mod prefetch;
mod resources;
pub mod rows;
pub mod run;
pub mod schedule;
pub mod seam;
mod session;
pub mod stage;
mod start;
pub mod step;
mod validate;
pub mod workers;

pub use config::TrainConfig;
pub use error::TrainError;
pub use options::{Ended, Existing, RunOptions};
pub use seam::Trained;
pub use session::{Overrides, train, train_layers};
