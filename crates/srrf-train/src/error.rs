//! Why a run does not begin, or stops.

use std::path::PathBuf;

use srrf_model::weights::WeightsError;

use crate::checkpoint::CheckpointError;
use crate::config::ConfigError;
use crate::data::ShapesError;
use crate::step::StepError;
use crate::validate::ValidateError;

/// Why a run does not begin, or stops.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// The configuration cannot be used.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The run would write a file that it reads.
    #[error(transparent)]
    Places(Box<srrf_args::Failure>),
    /// The configuration trains what nobody knows.
    #[error("{path}: `method` is \"{method}\"; choose from {known}")]
    Method {
        /// The configuration.
        path: PathBuf,
        /// What it names.
        method: String,
        /// What can be trained.
        known: String,
    },
    /// There is no such device.
    #[error(transparent)]
    Device(#[from] srrf_model::DeviceError),
    /// There are no shapes to train on.
    #[error(transparent)]
    Shapes(#[from] ShapesError),
    /// A file of the run cannot be written.
    #[error("{path}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// Another process trains in the folder.
    #[error(
        "{path}: another training ({process}) is at work in this folder; wait for it, or give another --run"
    )]
    Busy {
        /// The folder.
        path: PathBuf,
        /// What the other one wrote about itself.
        process: String,
    },
    /// The picture of the curves cannot be drawn.
    #[error("{path}: the curves cannot be drawn: {why}")]
    Picture {
        /// The folder.
        path: PathBuf,
        /// What the drawing said.
        why: String,
    },
    /// The checkpoint cannot be written or read.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The weights cannot be written.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// The device did not give its numbers.
    #[error(transparent)]
    Copy(#[from] srrf_model::CopyError),
    /// A step could not be made.
    #[error(transparent)]
    Step(#[from] StepError),
    /// A validation failed.
    #[error(transparent)]
    Validate(#[from] ValidateError),
    /// No thread could be started.
    #[error("no worker thread could be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The weights to start from cannot be read.
    #[error("start = {start:?}: {source}")]
    StartFile {
        /// The weights, as the configuration names them.
        start: String,
        /// What is wrong with them.
        #[source]
        source: Box<WeightsError>,
    },
    /// The weights to start from are of another network.
    #[error(
        "start = \"{start}\": its `{name}` does not fit this network; make [network] as that of the weights, or \
         leave `start` out"
    )]
    Start {
        /// The first parameter that does not fit.
        name: String,
        /// The weights, as the configuration names them.
        start: String,
    },
    /// There are more devices than shards.
    #[error(
        "{devices} devices, and a batch has {shards} shards: the rest would stand still. Lower `optimizer.shard`, or \
         name fewer devices"
    )]
    Devices {
        /// Number of devices.
        devices: usize,
        /// Shards of a batch.
        shards: usize,
    },
    /// Losses or gradients stay non-finite.
    #[error(
        "the loss or its gradient was not finite in {0} steps in a row; the last checkpoint is from before. \
         Lower `learning_rate` or `optimizer.clip_norm`"
    )]
    NotFinite(usize),
    /// There is a checkpoint, and no word on what to do with it.
    #[error(
        "{path} holds a run that stands at step {step}; add --resume to go on, or --restart to start over"
    )]
    Exists {
        /// The folder.
        path: PathBuf,
        /// Where the run stands.
        step: usize,
    },
}

impl TrainError {
    /// Whether what was asked for or given is wrong, and not the machine.
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Config(_)
            | Self::Places(_)
            | Self::Method { .. }
            | Self::Device(_)
            | Self::Shapes(_)
            | Self::Busy { .. }
            | Self::StartFile { .. }
            | Self::Start { .. }
            | Self::Devices { .. }
            | Self::Exists { .. } => true,
            Self::Checkpoint(error) => {
                !matches!(error, CheckpointError::Write(_) | CheckpointError::NotFinite { .. })
            }
            Self::Io { .. }
            | Self::Picture { .. }
            | Self::Weights(_)
            | Self::Copy(_)
            | Self::Step(_)
            | Self::Validate(_)
            | Self::Threads(_)
            | Self::NotFinite(_) => false,
        }
    }
}
