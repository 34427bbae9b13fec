//! [`Warning`]: what a user should know of an answer.

use std::fmt;
use std::sync::Arc;

use serde::{Serialize, Serializer};
use srrf_cloud::RegisterError;
use srrf_cloud::io::Note;

use crate::options::Method;
use crate::probability::Probability;
use crate::scale::ScaleDoubt;

/// What a user should know of an answer. [`fmt::Display`] gives a sentence.
#[derive(Debug, Clone)]
pub enum Warning {
    /// One of the methods found no pose.
    NoPose {
        /// The method.
        method: Method,
        /// Why not.
        why: Arc<RegisterError>,
    },
    /// The pose may well be wrong.
    Doubtful {
        /// The probability that it is right.
        probability: Probability,
    },
    /// The clouds may be in different units of length.
    Scale(ScaleDoubt),
    /// A scale was asked for that the clouds do not determine well.
    ScaleUndetermined {
        /// What was found.
        factor: f64,
        /// Its standard error, where there is one.
        spread: Option<f64>,
    },
    /// The pose that was given lays the clouds far apart, and its inverse lays them close.
    Inverted {
        /// Median distance of the source's points from the target, at the pose.
        given: f64,
        /// At its inverse.
        inverse: f64,
    },
    /// Points of a cloud were left out, because a coordinate is NaN or infinite.
    LeftOut {
        /// Name of the cloud.
        cloud: String,
        /// How many.
        points: usize,
    },
    /// What a user should know of how a file was read.
    Reading {
        /// Name of the cloud.
        cloud: String,
        /// What.
        note: Note,
    },
}

impl Warning {
    pub(crate) fn no_pose(method: Method, why: RegisterError) -> Self {
        Self::NoPose { method, why: Arc::new(why) }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoPose { method, why } => {
                let who = match method {
                    Method::Srrf => "The network",
                    Method::FpfhRansac => "FPFH with RANSAC",
                    Method::Icp => "ICP",
                    Method::Auto | Method::Given => "The search",
                };
                write!(f, "{who} found no pose: {why}.")
            }
            Self::Doubtful { probability } => write!(
                f,
                "The pose is right with a probability of {:.0}% only: check it, give a first guess, or crop both clouds \
                 to what they share.",
                100.0 * probability.get()
            ),
            Self::Scale(doubt) => write!(f, "The clouds may be in different units of length: {doubt}."),
            Self::ScaleUndetermined { factor, spread: Some(spread) } => {
                write!(
                    f,
                    "The clouds do not determine the scale well: {factor:.4} with a standard error of {spread:.4}."
                )
            }
            Self::ScaleUndetermined { factor, spread: None } => {
                write!(f, "The clouds do not determine the scale, {factor:.4} is as good as any other.")
            }
            Self::Inverted { given, inverse } => write!(
                f,
                "The pose that was given looks inverted: the source's points lie {given:.3e} off the target at it, and \
                 {inverse:.3e} at its inverse. If it is source_from_target, give its inverse."
            ),
            Self::LeftOut { cloud, points } => {
                let were = if *points == 1 {
                    "point with NaN or infinity was"
                } else {
                    "points with NaN or infinity were"
                };
                write!(f, "{cloud}: {points} {were} left out.")
            }
            Self::Reading { cloud, note } => write!(f, "{cloud}: {note}."),
        }
    }
}

/// As a sentence.
impl Serialize for Warning {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentences() {
        let left = |points| Warning::LeftOut { cloud: "a.ply".into(), points }.to_string();
        assert_eq!(left(1), "a.ply: 1 point with NaN or infinity was left out.");
        assert_eq!(left(2), "a.ply: 2 points with NaN or infinity were left out.");
        let note = Note::ExtraBytes { bytes: 2 };
        let reading = Warning::Reading { cloud: "a.stl".into(), note }.to_string();
        assert_eq!(reading, "a.stl: passed over 2 bytes behind the end.");
        let doubtful = Warning::Doubtful { probability: Probability::new(0.123).unwrap() };
        assert!(
            doubtful.to_string().starts_with("The pose is right with a probability of 12% only: check it")
        );
        let none = Warning::no_pose(Method::FpfhRansac, RegisterError::NoPose("too few".into()));
        assert_eq!(none.to_string(), "FPFH with RANSAC found no pose: no pose found: too few.");
        assert_eq!(serde_json::to_value(&none).unwrap(), none.to_string());
    }
}
