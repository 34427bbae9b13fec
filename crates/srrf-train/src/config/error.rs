//! What can be wrong with a configuration.

use std::path::PathBuf;

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
    /// A file that the configuration extends cannot be read.
    #[error("{path}: extends = \"{base}\": {source}")]
    Base {
        /// The file.
        path: PathBuf,
        /// What it extends, as it says.
        base: String,
        /// Why that cannot be read.
        #[source]
        source: Box<ConfigError>,
    },
    /// The file extends itself, by way of others.
    #[error("{path}: extends itself, by way of the files that `extends` names")]
    Circle {
        /// The file.
        path: PathBuf,
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
    /// The file, or one that it extends, has an unknown key or a value of the wrong type.
    #[error("{path}: `{key}`: {source}")]
    Key {
        /// The file that has the last word on the key.
        path: PathBuf,
        /// The key.
        key: String,
        /// What is wrong.
        #[source]
        source: Box<toml::de::Error>,
    },
    /// A value is out of its range.
    #[error("{path}: `{key}` {why}")]
    Value {
        /// The file that has the last word on the key.
        path: PathBuf,
        /// The key.
        key: String,
        /// What it must be.
        why: String,
    },
}
