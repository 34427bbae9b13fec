//! [`Failure`]: what went wrong, whose turn it is, and why.

use std::error::Error;
use std::fmt;
use std::process::ExitCode;

use srrf_cloud::CloudError;
use srrf_cloud::io::{FormatError, IoError};

use crate::exit::{FAILED, USAGE};

/// Why a program stops: a message with a way out, an exit code, and the error behind it.
#[derive(Debug)]
pub struct Failure {
    code: u8,
    message: String,
    source: Option<Box<dyn Error + Send + Sync>>,
}

impl Failure {
    /// Bad usage or input: exit code 2.
    pub fn usage(message: String) -> Self {
        Self { code: USAGE, message, source: None }
    }

    /// Anything else: exit code 1.
    pub fn failed(message: String) -> Self {
        Self { code: FAILED, message, source: None }
    }

    /// An error that usage or input causes.
    pub fn input(error: impl Error + Send + Sync + 'static) -> Self {
        Self::usage(error.to_string()).because(error)
    }

    /// An error that nobody typed.
    pub fn other(error: impl Error + Send + Sync + 'static) -> Self {
        Self::failed(error.to_string()).because(error)
    }

    /// The same failure, with the error behind it.
    pub fn because(self, error: impl Error + Send + Sync + 'static) -> Self {
        Self { source: Some(Box::new(error)), ..self }
    }

    /// The same failure, with the flag or the thing that it is about in front.
    #[must_use]
    pub fn at(self, what: &str) -> Self {
        Self { message: format!("{what}: {}", self.message), ..self }
    }

    /// Outputs that could not be written once the work was done, if there are any; `left` says where the answer is all the
    /// same. Exit code 1, whatever theirs are.
    pub fn of_outputs(failures: Vec<Self>, left: Option<String>) -> Option<Self> {
        let parts = failures.iter().map(|failure| failure.message.clone()).chain(left);
        let message = parts.collect::<Vec<_>>().join("; ");
        let first = failures.into_iter().next()?;
        Some(Self { code: FAILED, message, source: first.source })
    }

    /// A cloud, by its name, that cannot be used.
    pub fn cloud(name: &str, error: &CloudError) -> Self {
        Self::usage(format!("{name:?}: {error}{}", way_out(error))).because(error.clone())
    }

    /// Whether the user can put it right.
    pub fn is_usage(&self) -> bool {
        self.code == USAGE
    }

    /// 2 for bad usage or input, 1 for the rest.
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(self.code)
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl Error for Failure {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.source.as_deref().map(|source| source as _)
    }
}

/// Reading fails because of the input, writing because of the place.
impl From<IoError> for Failure {
    fn from(error: IoError) -> Self {
        let hint = match &error {
            IoError::Read { source, .. } if source.kind() == std::io::ErrorKind::NotFound => {
                "; check the path"
            }
            IoError::Read { .. } => "; check what it is and who may read it",
            IoError::Write { .. } => "; choose another place or format for the output",
            IoError::Format { source: FormatError::Unclear { .. } | FormatError::Memory { .. }, .. } => "",
            IoError::Format { .. } => {
                "; is the file complete, and of the format that its name says? Write it again, or convert it to PLY"
            }
            IoError::Cloud { source, .. } => way_out(source),
            IoError::UnknownFormat { .. }
            | IoError::Foreign { .. }
            | IoError::LeftOut { .. }
            | IoError::OtherFormat { .. }
            | IoError::NotFinite { .. } => "",
        };
        let message = format!("{error}{hint}");
        let code = if matches!(error, IoError::Write { .. }) { FAILED } else { USAGE };
        Self { code, message, source: Some(Box::new(error)) }
    }
}

fn way_out(error: &CloudError) -> &'static str {
    match error {
        CloudError::Empty => "; is it the right file?",
        CloudError::NotFinite { .. } | CloudError::Stray { .. } => "; remove such points first",
        CloudError::OutOfRange { .. } => "; scale the cloud first",
        CloudError::TooFew { .. } | CloudError::Collinear => {
            "; take a cloud with three points or more that are not on one line"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fact_and_way_out() {
        let missing = IoError::Read {
            path: "a.ply".into(),
            source: std::io::Error::from(std::io::ErrorKind::NotFound),
        };
        let failure = Failure::from(missing);
        let message = failure.to_string();
        assert!(failure.is_usage() && message.contains("\"a.ply\""), "{message}");
        assert!(message.ends_with("check the path"), "{message}");
        assert!(failure.source().is_some_and(|e| e.is::<IoError>()), "the error behind it is kept");
        let full = IoError::Write { path: "b.ply".into(), source: std::io::Error::other("no space") };
        let failure = Failure::from(full);
        assert!(!failure.is_usage() && failure.to_string().contains("b.ply"));
        let outputs = [Failure::usage("no room".into()), Failure::failed("no place".into())].into();
        let outputs = Failure::of_outputs(outputs, Some("the pose is here".into())).unwrap();
        assert_eq!(outputs.to_string(), "no room; no place; the pose is here");
        assert!(!outputs.is_usage() && Failure::of_outputs(Vec::new(), Some("here".into())).is_none());
        let few = Failure::cloud("c.xyz", &CloudError::TooFew { have: 2, need: 3 }).to_string();
        assert!(few.starts_with("\"c.xyz\": the cloud has 2 points"), "{few}");
    }
}
