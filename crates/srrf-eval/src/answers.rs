//! What a run keeps: every answer on every pair.

use srrf_cloud::{Certainty, Rigid};

use crate::certainty::Claim;
use crate::chamfer::SkeletonAgreement;
use crate::metrics::PoseError;
use crate::pairs::Group;
use crate::rows::TableRow;

/// A method's answer on one pair.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Its errors.
    pub error: PoseError,
    /// The pose; `None` where there is none.
    pub pose: Option<Rigid>,
    /// Why there is no pose.
    pub failure: Option<String>,
    /// Iterations that the method used.
    pub iterations: Option<usize>,
    /// Whether the method's own stopping rule was met.
    pub converged: Option<bool>,
    /// Time of the call; `None` for the oracle and transforms from a file.
    pub seconds: Option<f64>,
    /// How well the skeletons agree under the true pose; only in the row of a method that makes
    /// skeletons, not in those of its branches.
    pub skeletons: Option<SkeletonAgreement>,
    /// How sure the method is of its pose, from methods that say so.
    pub certainty: Option<Certainty>,
}

/// A pair with the answers of all rows.
#[derive(Debug, Clone)]
pub struct PairRecord {
    /// Number of its group.
    pub group: usize,
    /// Its number in the group.
    pub item: usize,
    /// Name of the shape.
    pub id: String,
    /// Its category; empty if unknown.
    pub class: String,
    /// Whether its category is symmetric about an axis.
    pub symmetric: bool,
    /// The true pose.
    pub truth: Rigid,
    /// The answers, one for each of [`RunOutcome::rows`].
    pub answers: Vec<Answer>,
}

/// All answers of a run.
#[derive(Debug, Clone)]
pub struct RunOutcome {
    /// The groups.
    pub groups: Vec<Group>,
    /// The rows, in the order of the tables.
    pub rows: Vec<TableRow>,
    /// The pairs, group after group.
    pub records: Vec<PairRecord>,
}

impl Answer {
    pub(crate) fn new(pose: Option<Rigid>, failure: Option<String>, truth: &Rigid) -> Self {
        let error = PoseError::new(pose.as_ref(), truth);
        Self {
            error,
            pose,
            failure,
            iterations: None,
            converged: None,
            seconds: None,
            skeletons: None,
            certainty: None,
        }
    }

    /// What the method says of its pose, and whether it is right; `None` from an answer without a certainty. No pose is a
    /// claim too.
    pub(crate) fn claim(&self) -> Option<Claim> {
        let right = self.error.right.unwrap_or(false);
        match self.certainty {
            Some(c) if self.pose.is_some() => {
                Some(Claim { probability: c.probability, abstain: c.abstain, right })
            }
            _ if self.pose.is_none() => Some(Claim::NO_POSE),
            _ => None,
        }
    }
}
