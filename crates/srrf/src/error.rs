//! [`Error`]: why clouds could not be registered.

use std::fmt;

use srrf_cloud::CloudError;
use srrf_model::weights::WeightsError;
use srrf_model::{CopyError, DeviceError};
use srrf_refine::RefineError;

use crate::calibration::CalibrationError;
use crate::scale::ScaleDoubt;
use crate::warning::Warning;

/// Why clouds could not be registered.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The weights cannot be used.
    #[error("weights: {0}")]
    Weights(#[source] WeightsError),
    /// The device cannot be used.
    #[error("{0}")]
    Device(#[source] DeviceError),
    /// The device did not give its numbers.
    #[error(transparent)]
    Copy(#[from] CopyError),
    /// The calibration in the program is damaged.
    #[error("{0}")]
    Calibration(#[source] CalibrationError),
    /// The source cannot be used.
    #[error("source: {0}")]
    Source(#[source] CloudError),
    /// The target cannot be used.
    #[error("target: {0}")]
    Target(#[source] CloudError),
    /// The clouds seem to be in different units of length.
    #[error("{0}")]
    Scale(ScaleDoubt),
    /// No method found a pose.
    #[error("no pose found: {0}")]
    NoPose(#[source] NoPose),
    /// Another thread set the flag of [`crate::Request::until`].
    #[error("stopped")]
    Stopped,
    /// The skeleton that the network found is not finite.
    #[error("no skeleton found: it is not finite; are the coordinates extreme?")]
    NoSkeleton,
    /// The refinement could not run.
    #[error("refinement: {0}")]
    Refine(#[source] RefineError),
}

/// What each method said that found no pose.
#[derive(Debug)]
pub struct NoPose(pub Vec<Warning>);

impl fmt::Display for NoPose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sentences: Vec<String> = self.0.iter().map(Warning::to_string).collect();
        f.write_str(&sentences.join(" "))
    }
}

/// The source is why the first of them found none.
impl std::error::Error for NoPose {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.0.iter().find_map(|warning| match warning {
            Warning::NoPose { why, .. } => Some(why.as_ref() as _),
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::error::Error as _;

    use srrf_cloud::RegisterError;

    use super::*;
    use crate::Method;

    #[test]
    fn no_pose_says_why_and_keeps_it() {
        let why = RegisterError::NoPose("too few".into());
        let error = Error::NoPose(NoPose(vec![Warning::no_pose(Method::Srrf, why)]));
        assert_eq!(error.to_string(), "no pose found: The network found no pose: no pose found: too few.");
        let root = error.source().unwrap().source().unwrap();
        assert!(root.is::<RegisterError>(), "{root:?}");
    }
}
