//! Scans of one thing from several sides: what of a cloud is seen from a place.

use std::collections::HashMap;

use nalgebra::{Rotation3, Vector3};
use srrf_cloud::{CloudError, PointCloud, Rigid};

/// Points this much farther than the nearest of their cell, in cells, are hidden.
const HIDDEN_CELLS: f64 = 2.5;

/// The points of `cloud` that are seen from `eye`, by a depth buffer of cells that are `cell_rad` wide (radians). Needs a dense cloud:
/// several points a cell, or what is behind shows through.
///
/// # Errors
/// [`CloudError::Empty`] where the cloud has no point away from the eye.
pub fn seen_from(cloud: &PointCloud, eye: [f64; 3], cell_rad: f64) -> Result<PointCloud, CloudError> {
    let eye = Vector3::from(eye);
    let polar = |p: &[f64; 3]| {
        let ray = Vector3::from(*p) - eye;
        let range = ray.norm();
        let row = (ray.z / range).clamp(-1.0, 1.0).asin();
        // Cells stay about square away from the equator.
        let column = ray.y.atan2(ray.x) * row.cos();
        (((column / cell_rad).floor() as i64, (row / cell_rad).floor() as i64), range)
    };
    let mut nearest: HashMap<(i64, i64), f64> = HashMap::new();
    for p in cloud.points() {
        let (cell, range) = polar(p);
        let kept = nearest.entry(cell).or_insert(range);
        *kept = kept.min(range);
    }
    let seen = |p: &&[f64; 3]| {
        let (cell, range) = polar(p);
        range > 0.0 && nearest.get(&cell).is_some_and(|n| range <= n + HIDDEN_CELLS * cell_rad * n)
    };
    PointCloud::new(cloud.points().iter().filter(seen).copied().collect())
}

/// The places of a camera that goes around an object on a turntable: `count` of them on a circle of this `distance` about the z axis, seen
/// from `height`.
pub fn turntable(count: usize, distance: f64, height: f64) -> Vec<[f64; 3]> {
    (0..count)
        .map(|i| {
            let turn = std::f64::consts::TAU * i as f64 / count as f64;
            [distance * turn.cos(), distance * turn.sin(), height]
        })
        .collect()
}

/// A motion from three angles about the axes (radians) and a shift, for scans that lie anywhere.
pub fn anywhere(angles: [f64; 3], shift: [f64; 3]) -> Rigid {
    let rotation = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]).into_inner();
    Rigid { rotation, translation: Vector3::from(shift) }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand::rngs::ChaCha8Rng;

    use super::*;

    #[test]
    fn half_of_a_ball_is_seen_and_it_is_the_near_half() {
        use rand::RngExt;
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let ball: Vec<[f64; 3]> = (0..30_000)
            .map(|_| Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0f64)).normalize().into())
            .collect();
        let ball = PointCloud::new(ball).unwrap();
        let seen = seen_from(&ball, [4.0, 0.0, 0.0], 0.02).unwrap();
        // From four radii away the cap within acos(1/4) is seen: 3/8 of the ball.
        let share = seen.len() as f64 / ball.len() as f64;
        assert!((share - 0.375).abs() < 0.06, "{share}");
        // Between the points of the rim one looks through at a few behind it.
        let behind = seen.points().iter().filter(|p| p[0] < 0.05).count();
        assert!(behind * 50 < seen.len(), "{behind} of {}", seen.len());
    }

    #[test]
    fn places_lie_on_the_circle_and_poses_are_motions() {
        let places = turntable(8, 2.0, 0.5);
        assert_eq!(places[2].map(|c| (c * 1e9).round() / 1e9), [0.0, 2.0, 0.5]);
        let pose = anywhere([0.1, -2.0, 3.0], [1.0, 2.0, 3.0]);
        assert!((pose.rotation.determinant() - 1.0).abs() < 1e-12);
    }
}
