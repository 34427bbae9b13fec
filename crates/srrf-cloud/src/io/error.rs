//! What goes wrong with files of clouds.

use std::path::PathBuf;

use super::memory::in_words;
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
    /// The content can be read in several ways, or in none that the program knows: the user has to say which.
    #[error("{problem}; say which with `{switch}`")]
    Unclear {
        /// What there is.
        problem: String,
        /// The flag of the programs that answers; the field of [`ReadOptions`](super::ReadOptions) of the same name.
        switch: &'static str,
    },
    /// Reading would take more memory than is allowed.
    #[error(
        "{what}: reading takes {} of memory, and {} are allowed; allow more with `--max-memory`, or make the file \
         smaller first",
        in_words(*needed),
        in_words(*limit)
    )]
    Memory {
        /// What takes it.
        what: String,
        /// How many bytes.
        needed: u64,
        /// How many bytes are allowed.
        limit: u64,
    },
    /// The format cannot hold what is to be written.
    #[error("{0}")]
    Unwritable(String),
}

/// So that what reads and writes in one go has one kind of error; the way back is
/// [`std::io::Error::downcast`].
impl From<FormatError> for std::io::Error {
    fn from(error: FormatError) -> Self {
        Self::new(std::io::ErrorKind::InvalidData, error)
    }
}

impl FormatError {
    pub(super) fn truncated(expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::Truncated { expected: expected.into(), found: found.into() }
    }

    pub(super) fn unclear(problem: impl Into<String>, switch: &'static str) -> Self {
        Self::Unclear { problem: problem.into(), switch }
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
    /// Neither the name nor the content says a known format.
    #[error("{path:?}: {fact}; known are {known}; name one of them, or convert the file")]
    UnknownFormat {
        /// The file, or `-` for a stream.
        path: PathBuf,
        /// What was looked at.
        fact: &'static str,
        /// The known names and extensions.
        known: String,
    },
    /// The format is known, but this build leaves it out.
    #[error(
        "{path:?}: this build has no {format}; build it with `--features {format}`, or convert the file to PLY"
    )]
    LeftOut {
        /// The file.
        path: PathBuf,
        /// The format and the cargo feature, which have the same name.
        format: &'static str,
    },
    /// The content is of another format than the one that was asked for.
    #[error("{path:?}: not {asked} ({source}); its content is {found}: rename the file or name that format")]
    OtherFormat {
        /// The file.
        path: PathBuf,
        /// The format that the name or the caller says.
        asked: &'static str,
        /// The format of the content.
        found: &'static str,
        /// What was wrong when it was read as asked.
        source: FormatError,
    },
    /// The content is something else that has a name, and is not read.
    #[error("{path:?}: this is {what}")]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it is, and what to do about it.
        what: &'static str,
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
