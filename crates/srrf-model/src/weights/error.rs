//! Why weights cannot be used.

use std::path::PathBuf;

use crate::ops::CopyError;

/// Why weights could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum WeightsError {
    /// The file cannot be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// There is neither a file nor a model in the program of that name.
    #[error("{name}: no such file, and no model of that name in the program (it has {known})")]
    Unknown {
        /// What was asked for.
        name: String,
        /// The names of the models in the program.
        known: String,
    },
    /// A model that other builds of the program have.
    #[error(
        "{name}: no such file, and this build is without that model (it has {known}); take \
         crates/srrf-model/weights/{name}.safetensors from the repository, and give that file"
    )]
    NotInThisBuild {
        /// What was asked for.
        name: String,
        /// The names of the models in the program.
        known: String,
    },
    /// The bytes are no safetensors file, or a truncated one.
    #[error("{origin}: not a complete safetensors file: {source}")]
    Format {
        /// Where the bytes came from.
        origin: String,
        /// What the reader said.
        #[source]
        source: safetensors::SafeTensorError,
    },
    /// The header does not describe a network of this program.
    #[error(
        "{origin}: no network description under `{key}` in the header: {why}; was it written by srrf-train, for \
         this method?"
    )]
    Header {
        /// Where the bytes came from.
        origin: String,
        /// The entry that was looked for.
        key: &'static str,
        /// What is wrong.
        why: String,
    },
    /// The weights could not be copied from their device.
    #[error("{origin}: {source}")]
    Copy {
        /// The weights.
        origin: String,
        /// What went wrong.
        #[source]
        source: CopyError,
    },
    /// A parameter is not finite.
    #[error(
        "{origin}: parameter `{name}` has numbers that are not finite; train it again, or get another file"
    )]
    NotFinite {
        /// Where the weights came from.
        origin: String,
        /// Path of the parameter.
        name: String,
    },
    /// A parameter is missing, has another shape, or is of an unsupported type.
    #[error("{origin}: parameter `{name}`: {why}; these weights belong to a network of another architecture")]
    Parameter {
        /// Where the bytes came from.
        origin: String,
        /// Path of the parameter.
        name: String,
        /// What is wrong.
        why: String,
    },
}
