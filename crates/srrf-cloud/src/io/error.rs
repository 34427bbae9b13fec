//! What goes wrong with files of clouds.

use std::path::PathBuf;

use crate::CloudError;

/// Why the bytes of a file are not a cloud.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FormatError {
    /// The file ends before what it announces.
    #[error("the file is cut short: {expected} announced, {found} found")]
    Truncated {
        /// What the file announces.
        expected: String,
        /// What there is.
        found: String,
    },
    /// A line of text cannot be understood.
    #[error("line {line}: {problem}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong with it.
        problem: String,
    },
    /// The content cannot be understood, or is of a kind that is not supported.
    #[error("{0}")]
    Content(String),
}

impl FormatError {
    pub(super) fn truncated(expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::Truncated { expected: expected.into(), found: found.into() }
    }

    pub(super) fn line(line: usize, problem: impl Into<String>) -> Self {
        Self::Line { line, problem: problem.into() }
    }
}

/// Why a file of a cloud cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum IoError {
    /// The file cannot be opened or read.
    #[error("cannot read {path:?}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The file cannot be written; no part of it remains.
    #[error("cannot write {path:?}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The extension is none of the known ones.
    #[error("{path:?}: the extension says no known format; known are {known}")]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// The known extensions.
        known: String,
    },
    /// The content does not follow the format.
    #[error("{path:?}: {source}")]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: FormatError,
    },
    /// Points have NaN or infinite coordinates.
    #[error(
        "{path:?}: {count} of {total} points have a coordinate that is NaN or infinite, the first is point \
         {first}; remove them first, or ask for them to be dropped"
    )]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// How many points.
        count: usize,
        /// Of how many.
        total: usize,
        /// Index of the first of them.
        first: usize,
    },
    /// The points are not a usable cloud.
    #[error("{path:?}: {source}")]
    Cloud {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: CloudError,
    },
}
