//! When a pose is right: the one definition of the workspace.
//!
//! A probability ([`Certainty`](crate::Certainty)) is that of [`is_right`]; tables, the calibration and the
//! comparison on real scans count by it. The recall of tables is another number: an offset of the
//! translation itself, in the unit of the clouds, as the literature has it.

use nalgebra::Vector3;

use crate::{PointCloud, Rigid};

/// Largest angle of a right pose, in degrees.
pub const RIGHT_ROTATION_DEG: f64 = 5.0;

/// Largest miss of a right pose, as a share of the target's radius.
pub const RIGHT_RADIUS_SHARE: f64 = 0.1;

/// What the two numbers are, for people.
pub const RIGHT_IN_WORDS: &str = "within 5° and a tenth of the target's radius";

/// Whether `found` is right: under [`RIGHT_ROTATION_DEG`] from `truth`, and at the source's centroid under
/// [`RIGHT_RADIUS_SHARE`] of the target's radius from where `truth` brings it. Both map source to target; the
/// radius is the root mean square distance of the target's points from their centroid. A pose that is not
/// finite is wrong.
pub fn is_right(found: &Rigid, truth: &Rigid, source: &PointCloud, target: &PointCloud) -> bool {
    let at = source.centroid().into();
    let miss = Vector3::from(found.apply(&at)) - Vector3::from(truth.apply(&at));
    found.angle_to_deg(truth) < RIGHT_ROTATION_DEG && miss.norm() < RIGHT_RADIUS_SHARE * rms_radius(target)
}

/// Root mean square distance of the points from their centroid.
fn rms_radius(cloud: &PointCloud) -> f64 {
    let centre = cloud.centroid();
    let square: f64 = cloud.points().iter().map(|p| (Vector3::from(*p) - centre).norm_squared()).sum();
    (square / cloud.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    /// The corners of a box about (7, 8, 9) whose root mean square radius is `radius`.
    fn corners(radius: f64) -> PointCloud {
        let side = radius / 3f64.sqrt();
        let at = |i: usize, c: usize| if i >> c & 1 == 0 { -side } else { side };
        let points = (0..8).map(|i| std::array::from_fn(|c| [7.0, 8.0, 9.0][c] + at(i, c)));
        PointCloud::new(points.collect()).unwrap()
    }

    fn turned_about_the_middle(deg: f64) -> Rigid {
        let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), deg.to_radians()).into_inner();
        let middle = Vector3::new(7.0, 8.0, 9.0);
        Rigid { rotation, translation: middle - rotation * middle }
    }

    #[test]
    fn the_angle_and_the_miss_at_the_centroid_both_count() {
        let (source, target) = (corners(1.0), corners(2.0));
        let truth = Rigid::identity();
        // Far from the origin, a turn about the cloud moves the translation much, yet the pose is right.
        assert!(is_right(&turned_about_the_middle(4.9), &truth, &source, &target));
        assert!(!is_right(&turned_about_the_middle(5.1), &truth, &source, &target));
        // A tenth of the target's radius, not of the source's.
        for (shift, right) in [(0.19, true), (0.21, false)] {
            let moved = Rigid { translation: Vector3::new(0.0, shift, 0.0), ..truth };
            assert_eq!(is_right(&moved, &truth, &source, &target), right, "{shift}");
            assert!(!is_right(&moved, &truth, &target, &source), "{shift}");
        }
    }

    #[test]
    fn a_pose_with_nan_is_wrong() {
        let cloud = corners(1.0);
        let nan = Rigid { translation: Vector3::new(f64::NAN, 0.0, 0.0), ..Rigid::identity() };
        assert!(!is_right(&nan, &Rigid::identity(), &cloud, &cloud));
    }
}
