//! [`EvalError`]: why an evaluation cannot be done.

use std::io;
use std::path::PathBuf;

use srrf_cloud::io::ArrayError;
use srrf_corrupt::datasets::SourceError;
use srrf_corrupt::{SeverityOutOfRange, UnknownCorruption};

use crate::methods::SetupError;
use crate::metrics::MetricError;

/// Why an evaluation cannot be done.
#[derive(Debug, thiserror::Error)]
pub enum EvalError {
    /// The data cannot be opened.
    #[error(
        "{source}\n\
         {origin}\n\
         Without data: `cargo run -p srrf-eval` evaluates on shapes that the program makes itself."
    )]
    Data {
        /// Where the path came from.
        origin: String,
        /// What is wrong with it.
        source: Box<SourceError>,
    },
    /// A shape cannot be read.
    #[error("{0}")]
    Shape(#[from] SourceError),
    /// A device did not give its numbers.
    #[error(transparent)]
    Copy(#[from] srrf_model::CopyError),
    /// A pair cannot be made.
    #[error("pair {item} of {group}: {source}")]
    Pair {
        /// Name of the group.
        group: String,
        /// Number of the pair in it.
        item: usize,
        /// What went wrong.
        source: Box<PairFault>,
    },
    /// A name that is no corruption.
    #[error("{0}; or `clean`")]
    Corruption(#[from] UnknownCorruption),
    /// A number that is no severity.
    #[error(transparent)]
    Severity(#[from] SeverityOutOfRange),
    /// A name that is no method.
    #[error("unknown method `{name}`: choose from {known}")]
    Method {
        /// The name that was given.
        name: String,
        /// The names there are.
        known: String,
    },
    /// A method cannot be set up.
    #[error("method {name}: {source}")]
    Setup {
        /// Its name.
        name: &'static str,
        /// What is wrong, and the way out.
        source: Box<SetupError>,
    },
    /// Options that cannot be used, or not together.
    #[error("{0}")]
    Usage(String),
    /// A file of arrays cannot be used.
    #[error(transparent)]
    Arrays(#[from] ArrayError),
    /// A file of transforms cannot be used.
    #[error("{path:?}: {problem}")]
    Transforms {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what is expected.
        problem: String,
    },
    /// Clouds of one group differ in size, so that they make no array.
    #[error("cannot export {group}: the clouds of {array} differ in size")]
    Ragged {
        /// Name of the group.
        group: String,
        /// Name of the array.
        array: String,
    },
    /// The folder for results cannot be used.
    #[error("cannot write results to {path:?}: {source}; choose another folder with --output")]
    OutDir {
        /// The folder.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The answers of earlier runs cannot be read, or new ones not be kept.
    #[error("cannot keep answers in {path:?}: {source}; choose another folder with --cache")]
    Cache {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The file for exported pairs cannot be made.
    #[error("cannot write pairs to {path:?}: {source}; choose another file with --export-pairs")]
    ExportPath {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// A result cannot be written.
    #[error("cannot write {path:?}: {source}")]
    Output {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// A picture cannot be drawn.
    #[error("cannot draw {path:?}: {problem}")]
    Picture {
        /// The file.
        path: PathBuf,
        /// What went wrong.
        problem: String,
    },
    /// The errors of a method cannot be summed up.
    #[error("{group}, {method}: {source}")]
    Metric {
        /// Name of the group.
        group: String,
        /// Name of the method.
        method: String,
        /// What is wrong.
        source: MetricError,
    },
    /// Worker threads cannot be started.
    #[error("cannot start worker threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Usage and input are the user's to put right; the rest is a failure.
impl From<EvalError> for srrf_args::Failure {
    fn from(error: EvalError) -> Self {
        if error.is_usage() { Self::input(error) } else { Self::other(error) }
    }
}

/// Why a pair cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum PairFault {
    /// The shape cannot be had, corrupted or posed.
    #[error(transparent)]
    Synthesis(#[from] srrf_corrupt::PairError),
    /// The points that were chosen make no cloud.
    #[error(transparent)]
    Cloud(#[from] srrf_cloud::CloudError),
    /// The method whose skeletons are the points cannot register the whole pair.
    #[error(transparent)]
    Skeletons(#[from] srrf_cloud::RegisterError),
    /// The method makes no skeletons.
    #[error("the method makes no skeletons")]
    NoSkeletons,
}

impl EvalError {
    /// Whether it is what the user can put right: usage and input.
    pub fn is_usage(&self) -> bool {
        !matches!(self, Self::Output { .. } | Self::Picture { .. } | Self::Metric { .. } | Self::Threads(_))
    }
}
