//! [`Refusal`]: why a call fails, and which exception of the package says so.

use std::error::Error;
use std::fmt;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use srrf::ScaleDoubt;
use srrf_args::Failure;
use srrf_cloud::CloudError;
use srrf_cloud::io::IoError;
use srrf_corrupt::{CorruptError, PairError};
use srrf_eval::EvalError;

/// The classes of exceptions; they stand in `python/srrf/_errors.py` by these names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// A cloud or a pose that cannot be used.
    Input,
    /// An option that makes no sense, or weights or a device that cannot be used.
    Option,
    /// A file that cannot be read or written.
    File,
    /// A file that is not there.
    MissingFile,
    /// Two clouds without an answer.
    NoPose,
    /// A fault of the library.
    Internal,
}

impl Fault {
    fn class(self) -> &'static str {
        match self {
            Self::Input => "InputError",
            Self::Option => "OptionError",
            Self::File => "FileError",
            Self::MissingFile => "MissingFileError",
            Self::NoPose => "NoPoseError",
            Self::Internal => "InternalError",
        }
    }
}

/// Why a call fails.
#[derive(Debug)]
pub struct Refusal {
    fault: Fault,
    message: String,
}

impl Refusal {
    /// With a message that says the fact and the way out.
    pub fn new(fault: Fault, message: impl Into<String>) -> Self {
        Self { fault, message: message.into() }
    }

    /// Of a registration, with the names of its clouds.
    pub fn registering(error: srrf::Error, source: &str, target: &str) -> Self {
        match error {
            srrf::Error::Source(e) => Self::cloud(source, &e),
            srrf::Error::Target(e) => Self::cloud(target, &e),
            other => other.into(),
        }
    }

    /// A cloud, by its name, that cannot be used.
    pub fn cloud(name: &str, error: &CloudError) -> Self {
        Self::new(Fault::Input, Failure::cloud(name, error).to_string())
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl Error for Refusal {}

impl From<Refusal> for PyErr {
    fn from(refusal: Refusal) -> Self {
        Python::attach(|py| {
            let class = py.import("srrf._errors").and_then(|errors| errors.getattr(refusal.fault.class()));
            match class.and_then(|class| class.call1((&refusal.message,))) {
                Ok(exception) => PyErr::from_value(exception),
                Err(_) => PyRuntimeError::new_err(refusal.message),
            }
        })
    }
}

impl From<srrf::Error> for Refusal {
    fn from(error: srrf::Error) -> Self {
        use srrf::Error as E;
        let message = error.to_string();
        match error {
            E::Source(e) => Self::cloud("source", &e),
            E::Target(e) => Self::cloud("target", &e),
            E::Scale(doubt) => Self::new(Fault::Input, other_units(&doubt)),
            E::Weights(_) | E::Device(_) | E::Calibration(_) => Self::new(Fault::Option, message),
            E::NoPose(_) | E::NoSkeleton | E::Refine(_) => Self::new(
                Fault::NoPose,
                format!("{message}; look at both clouds, or give a first guess by `initial`"),
            ),
            _ => Self::new(Fault::Internal, message),
        }
    }
}

/// The switches of the program that are options of `srrf.read`.
const READING: [&str; 7] = ["columns", "array", "layout", "scan", "topic", "message", "max-memory"];

/// A message of the program, with the names that options have here.
pub fn in_python(message: &str) -> String {
    let mut said = message.to_owned();
    for name in READING {
        let option = format!("{}=", name.replace('-', "_"));
        said = said.replace(&format!("--{name} "), &option).replace(&format!("--{name}"), &option);
    }
    match said == message {
        true => said,
        false => format!("{said} (options of srrf.read)"),
    }
}

/// What speaks for two units, and the options that mend it.
fn other_units(doubt: &ScaleDoubt) -> String {
    let [source, target] = doubt.sizes;
    let units = doubt.units().map_or_else(String::new, |[source, target]| {
        format!(
            ", as of {source} and {target}, which scale=srrf.unit_factor(\"{source}\", \"{target}\") mends"
        )
    });
    format!(
        "source and target seem to be in different units of length: their radii are {:.4e} and {:.4e}{units}; pass \
         scale=FACTOR, what the source is to be multiplied by, scale=\"auto\" to estimate it, or scale=1 to take both as \
         they are",
        source.radius, target.radius
    )
}

impl From<IoError> for Refusal {
    fn from(error: IoError) -> Self {
        let missing =
            matches!(&error, IoError::Read { source, .. } if source.kind() == std::io::ErrorKind::NotFound);
        let message = in_python(&Failure::from(error).to_string());
        Self::new(if missing { Fault::MissingFile } else { Fault::File }, message)
    }
}

impl From<CorruptError> for Refusal {
    fn from(error: CorruptError) -> Self {
        Self::new(Fault::Input, format!("{error}; pass a larger cloud, or take another corruption"))
    }
}

impl From<PairError> for Refusal {
    fn from(error: PairError) -> Self {
        Self::new(Fault::Input, error.to_string())
    }
}

impl From<EvalError> for Refusal {
    fn from(error: EvalError) -> Self {
        let fault = match error {
            EvalError::Usage(_) => Fault::Option,
            EvalError::Data { .. } => Fault::File,
            _ => Fault::Input,
        };
        Self::new(fault, error.to_string())
    }
}
