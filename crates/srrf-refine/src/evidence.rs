//! [`Evidence`]: what speaks for a pose.

use nalgebra::{Matrix3, Matrix6, Vector3};
use serde::Serialize;
use srrf_cloud::Rigid;

use crate::matching::{Side, side_matches};
use crate::prepared::RefineCloud;
use crate::solve::NormalEquations;

/// What speaks for a pose. Taken from the points that the last level of the refinement looked at:
/// all of them, or voxel centroids of large clouds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evidence {
    /// Median distance between neighbouring points, of the sparser cloud; unit of the clouds.
    pub spacing: f64,
    /// Distance under which a match is an inlier: one `spacing`.
    pub inlier_threshold: f64,
    /// Source points with a target point within the threshold.
    pub inliers: usize,
    /// Source points that were asked: the denominator of `fitness`.
    pub source_points: usize,
    /// Target points that were asked: the denominator of `overlap_target`.
    pub target_points: usize,
    /// `inliers / source_points`, in [0, 1] (Open3D's `fitness`, which counts over the source).
    pub fitness: f64,
    /// Share of the target with a source point within the threshold, in [0, 1].
    pub overlap_target: f64,
    /// Root mean square distance of the inliers; 0 without any.
    pub inlier_rmse: f64,
    /// `sum J^T J` over the inliers of the source, `J = [-[y - c]x | I]`, `y` the matched target point:
    /// rotation first (radians), then translation, for a motion after the pose in the target's axes
    /// about `information_centre`. Open3D's `get_information_matrix_from_point_clouds` is the same sum about
    /// the origin ([`Evidence::information_at_origin`]); small_gicp's `H` has the same order, yet moves in
    /// the source frame and holds its weights. Divided by the variance of a match it is the inverse covariance of the
    /// pose, as far as matches are right and independent.
    pub information: Matrix6<f64>,
    /// `c`: the mean of the target, target frame.
    pub information_centre: Vector3<f64>,
}

impl Evidence {
    /// The information matrix about the origin of the target frame, as Open3D gives it. Loses digits
    /// where the clouds lie far from the origin.
    pub fn information_at_origin(&self) -> Matrix6<f64> {
        // A turn about the origin is the turn about c and the shift omega x c = -[c]x omega.
        let mut change = Matrix6::identity();
        let shift: Matrix3<f64> = -self.information_centre.cross_matrix();
        change.fixed_view_mut::<3, 3>(3, 0).copy_from(&shift);
        change.transpose() * self.information * change
    }
}

/// Measures a pose between the inputs.
pub(crate) fn evidence(source: &RefineCloud, target: &RefineCloud, pose: &Rigid) -> Evidence {
    let local = source.frame_to(target).pose(pose);
    let (s, t) = (source.fine(), target.fine());
    let spacing = s.spacing.max(t.spacing);
    let limit = spacing * spacing;
    let mut sums = NormalEquations::default();
    let (mut inliers, mut squares) = (0, 0.0);
    for (_, mut found) in side_matches(s, t, &local, Side::Source) {
        let squared = (found.moved - found.fixed).norm_squared();
        if squared <= limit {
            inliers += 1;
            squares += squared;
            found.moved = found.fixed;
            sums.add(&found, 1.0, 0.0);
        }
    }
    let covered = side_matches(s, t, &local, Side::Target)
        .iter()
        .filter(|(_, m)| (m.moved - m.fixed).norm_squared() <= limit)
        .count();
    Evidence {
        spacing,
        inlier_threshold: spacing,
        inliers,
        source_points: s.points().len(),
        target_points: t.points().len(),
        fitness: inliers as f64 / s.points().len() as f64,
        overlap_target: covered as f64 / t.points().len() as f64,
        inlier_rmse: if inliers > 0 { (squares / inliers as f64).sqrt() } else { 0.0 },
        information: sums.hessian,
        information_centre: target.centre,
    }
}
