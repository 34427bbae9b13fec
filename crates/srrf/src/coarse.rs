//! [`CoarsePose`]: what the network found, before any refinement.

use srrf_cloud::{Branch, Registration, Rigid, Skeletons, SoftMatch};

use crate::target::PreparedPair;

/// What the network found, before any refinement, in input coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct CoarsePose {
    /// The fused pose.
    pub target_from_source: Rigid,
    /// The poses of the branches (`dense` and `skeleton`), each with its inlier ratio gamma.
    pub branches: Vec<Branch>,
    /// Weight of the dense branch in the fused pose, the number that the pose was made with.
    pub lambda: Option<f64>,
    /// Skeletons, in input coordinates.
    pub skeletons: Option<Skeletons>,
    /// Soft matches of the dense branch, in input coordinates.
    pub matches: Vec<SoftMatch>,
}

impl CoarsePose {
    /// What the network found between the centred clouds of `pair`.
    pub(crate) fn new(found: &Registration, pair: &PreparedPair) -> Self {
        let mut branches = found.branches.clone();
        for branch in &mut branches {
            branch.target_from_source = pair.frame.undo_pose(&branch.target_from_source);
        }
        let frame = &pair.frame;
        let mut skeletons = found.skeletons.clone();
        if let Some(Skeletons { source, target }) = &mut skeletons {
            source.points.iter_mut().for_each(|p| *p = frame.undo_source(p));
            target.points.iter_mut().for_each(|p| *p = frame.undo_target(p));
        }
        let mut matches = found.matches.clone();
        for m in &mut matches {
            m.source = frame.undo_source(&m.source);
            m.target = frame.undo_target(&m.target);
        }
        let target_from_source = pair.frame.undo_pose(&found.target_from_source);
        Self { target_from_source, branches, lambda: found.lambda, skeletons, matches }
    }
}
