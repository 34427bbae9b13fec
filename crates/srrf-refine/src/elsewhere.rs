//! Where else the clouds may fit: turns of a pose, by any rotation, that leave the source near the target.

use nalgebra::{Matrix3, Vector3};
use srrf_cloud::Rigid;

use crate::orientations::{best_apart, orientations};
use crate::probe::Probe;

/// Rotations all around: one within about 12 degrees of any.
const ROTATIONS: usize = 1500;
/// Points of the source that are turned.
const POINTS: usize = 64;
/// Width of the score, in radii: what a turn to the middle between two tried ones moves points by.
const WIDTH: f64 = 0.15;
/// Two rotations closer than this are one, radians.
const APART: f64 = 0.4;
/// Turns that score less than this share of the pose itself are not worth a run: of those that end within a tenth of its rank, one in
/// twenty scores less.
const LEAST: f64 = 0.72;
/// Most turns.
const MOST: usize = 8;

/// The pose turned about `centre`, the middle of the overlap, whose radius is `radius`, by the rotations that leave the source nearest
/// to the target; best first. What a body looks like from one side may fit on another of its sides, and neither is a symmetry of what
/// was seen.
pub(crate) fn elsewhere(probe: &Probe<'_>, pose: &Rigid, centre: &Vector3<f64>, radius: f64) -> Vec<Rigid> {
    let asked = probe.asked()[0];
    let stride = asked.len().div_ceil(POINTS);
    let from_centre: Vec<Vector3<f64>> =
        asked.iter().step_by(stride).map(|p| Vector3::from(pose.apply(p)) - centre).collect();
    let squared = (WIDTH * radius).powi(2);
    let score = |rotation: &Matrix3<f64>| -> f64 {
        let near = |p: &Vector3<f64>| {
            let turned = rotation * p + centre;
            squared / (squared + probe.target.index.nearest(&turned.into()).1)
        };
        from_centre.iter().map(near).sum()
    };
    let turned = |rotation: Matrix3<f64>| Rigid {
        rotation: rotation * pose.rotation,
        translation: rotation * (pose.translation - centre) + centre,
    };
    best_apart(orientations(ROTATIONS).collect(), score, LEAST, APART, MOST).into_iter().map(turned).collect()
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};
    use srrf_cloud::PointCloud;

    use super::*;
    use crate::prepared::RefineCloud;

    fn sampled(seed: u64, at: impl Fn([f64; 2]) -> [f64; 3]) -> RefineCloud {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        RefineCloud::of(&PointCloud::new((0..1500).map(|_| at(rng.random())).collect()).unwrap())
    }

    fn found(at: impl Fn([f64; 2]) -> [f64; 3]) -> Vec<Rigid> {
        let (source, target) = (sampled(1, &at), sampled(2, &at));
        let pose = source.frame_to(&target).pose(&Rigid::identity());
        let probe = Probe::new(&source, &target);
        let (centre, radius) = probe.overlap(&pose);
        let found = elsewhere(&probe, &pose, &centre, radius);
        // The middle stays where it is, and nothing near the pose is told.
        for other in &found {
            let moved = Vector3::from(other.compose(&pose.inverse()).apply(&centre.into())) - centre;
            assert!(moved.norm() < 1e-9, "{moved}");
            assert!(other.angle_to_deg(&pose) > 0.99 * APART.to_degrees());
        }
        found
    }

    #[test]
    fn a_ball_fits_turned_by_anything_and_three_bars_nowhere_else() {
        let ball = found(|[u, v]| {
            let (z, turn) = (2.0 * u - 1.0, std::f64::consts::TAU * v);
            let r = (1.0 - z * z).sqrt();
            [r * turn.cos(), r * turn.sin(), z]
        });
        assert_eq!(ball.len(), MOST);
        for (i, one) in ball.iter().enumerate() {
            assert!(ball[..i].iter().all(|other| other.angle_to_deg(one) > 0.99 * APART.to_degrees()));
        }
        let bars = found(|[u, v]| match 6.0 * v {
            v if v < 1.0 => [0.5 * u, 0.0, 0.0],
            v if v < 3.0 => [0.0, u, 0.0],
            _ => [0.0, 0.0, 1.5 * u],
        });
        assert!(bars.is_empty(), "{bars:?}");
    }
}
