//! Poses that many points voted for.

use nalgebra::Vector3;
use srrf_cloud::Rigid;

/// Poses that differ by less are one.
const ALIKE_DEG: f64 = 20.0;
/// The same for where they put the part's centre, in diameters.
const ALIKE: f64 = 0.1;

/// A pose and the votes for it and poses alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VotedPose {
    /// `target ~ R source + t`.
    pub target_from_source: Rigid,
    /// Sum of the votes; only its ratio to others means something.
    pub votes: f64,
}

/// Joins alike poses, most votes first, and keeps the best.
pub(super) fn cluster(
    mut all: Vec<VotedPose>,
    centre: [f64; 3],
    diameter: f64,
    keep: usize,
) -> Vec<VotedPose> {
    all.sort_by(|a, b| b.votes.total_cmp(&a.votes));
    let mut found: Vec<(VotedPose, Vector3<f64>)> = Vec::new();
    for pose in all {
        let at: Vector3<f64> = pose.target_from_source.apply(&centre).into();
        let alike = |(known, there): &&mut (VotedPose, Vector3<f64>)| {
            (at - *there).norm() < ALIKE * diameter
                && known.target_from_source.angle_to_deg(&pose.target_from_source) < ALIKE_DEG
        };
        match found.iter_mut().find(alike) {
            Some((known, _)) => known.votes += pose.votes,
            None => found.push((pose, at)),
        }
    }
    let mut best: Vec<VotedPose> = found.into_iter().map(|(pose, _)| pose).collect();
    best.sort_by(|a, b| b.votes.total_cmp(&a.votes));
    best.truncate(keep);
    best
}

#[cfg(test)]
mod tests {
    use srrf_cloud::EulerXyz;

    use super::*;

    #[test]
    fn alike_poses_add_their_votes() {
        let at = |degrees: f64, x: f64, votes: f64| {
            let rotation = EulerXyz::from_deg([0.0, 0.0, degrees]).to_matrix();
            VotedPose { target_from_source: Rigid { rotation, translation: [x, 0.0, 0.0].into() }, votes }
        };
        let all = vec![at(0.0, 0.0, 2.0), at(90.0, 0.0, 3.0), at(15.0, 0.05, 1.5), at(0.0, 0.5, 1.0)];
        let found = cluster(all.clone(), [0.0; 3], 2.0, 9);
        assert_eq!(found, [at(0.0, 0.0, 3.5), at(90.0, 0.0, 3.0), at(0.0, 0.5, 1.0)]);
        assert_eq!(cluster(all, [0.0; 3], 2.0, 1).len(), 1);
    }
}
