//! [`Failure`]: what went wrong, and the exit code that says whose turn it is.

use std::fmt;
use std::process::ExitCode;

use srrf_cloud::CloudError;
use srrf_cloud::io::IoError;

/// Why the program stops.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Failure {
    /// Bad usage or input: exit code 2.
    Usage(String),
    /// Anything else: exit code 1.
    Other(String),
}

impl Failure {
    /// 2 for bad usage or input, 1 for the rest.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::Usage(_) => ExitCode::from(2),
            Self::Other(_) => ExitCode::from(1),
        }
    }

    /// A cloud, by its name, that cannot be used.
    pub fn cloud(name: &str, error: &CloudError) -> Self {
        Self::Usage(format!("{name:?}: {error}{}", way_out(error)))
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(message) | Self::Other(message) => f.write_str(message),
        }
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
            IoError::Format { .. } => {
                "; is the file complete, and of the format that its name says? Write it again, or convert it to PLY"
            }
            IoError::Cloud { source, .. } => way_out(source),
            IoError::UnknownFormat { .. }
            | IoError::LeftOut { .. }
            | IoError::OtherFormat { .. }
            | IoError::NotFinite { .. } => "",
        };
        let message = format!("{error}{hint}");
        if matches!(error, IoError::Write { .. }) { Self::Other(message) } else { Self::Usage(message) }
    }
}

fn way_out(error: &CloudError) -> &'static str {
    match error {
        CloudError::Empty => "; is it the right file?",
        CloudError::NotFinite { .. } => "; remove such points first",
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
        assert!(
            matches!(&failure, Failure::Usage(m) if m.contains("\"a.ply\"") && m.ends_with("check the path"))
        );
        let full = IoError::Write { path: "b.ply".into(), source: std::io::Error::other("no space") };
        assert!(matches!(Failure::from(full), Failure::Other(m) if m.contains("b.ply")));
        let few = Failure::cloud("c.xyz", &CloudError::TooFew { have: 2, need: 3 }).to_string();
        assert!(few.starts_with("\"c.xyz\": the cloud has 2 points"), "{few}");
    }
}
