//! [`Scatter`]: how far the pose would scatter with other noise on the same clouds.

use std::collections::BTreeMap;

use nalgebra::{Matrix6, Vector3, Vector6};
use serde::Serialize;
use srrf_cloud::Rigid;

use crate::matching::{Side, side_matches};
use crate::prepared::RefineCloud;
use crate::solve::{Match, NormalEquations};
use crate::{Metric, RefineConfig};

/// Side of a block of matches whose residuals may hang together, in point spacings.
const BLOCK: f64 = 4.0;
/// Matches farther apart than so many spacings are none.
const NEAR: f64 = 1.0;

/// The covariance of the pose, from its own residuals: `H^-1 (sum_b g_b g_b^T) H^-1`, the sandwich of an M-estimator (Huber 1967), with
/// the gradients `g` summed over blocks of neighbours, whose residuals are not independent (Conley 1999). Nothing is assumed of the
/// noise but that it is the same beyond a few spacings; what all points have in common, such as a bent cloud, it cannot see.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Scatter {
    /// Covariance of a motion after the pose in the target's axes about `centre`: rotation first (radians), then translation. Infinite
    /// where too few matches are left.
    pub covariance: Matrix6<f64>,
    /// The mean of the target, target frame.
    pub centre: Vector3<f64>,
}

impl Scatter {
    /// Standard deviations of the rotation about x, y and z, degrees.
    pub fn rotation_deg(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| self.covariance[(i, i)].max(0.0).sqrt().to_degrees())
    }

    /// Standard deviations of the translation of the centre along x, y and z, unit of the clouds.
    pub fn translation(&self) -> [f64; 3] {
        [3, 4, 5].map(|i| self.covariance[(i, i)].max(0.0).sqrt())
    }
}

/// Measures `pose`, between the centred clouds.
pub(crate) fn spread(
    source: &RefineCloud,
    target: &RefineCloud,
    pose: &Rigid,
    config: &RefineConfig,
) -> Scatter {
    let (s, t) = (source.fine(), target.fine());
    let spacing = s.spacing.max(t.spacing);
    // What the last stage of the refinement minimises.
    let soft = config.soft && s.points().len().max(t.points().len()) <= config.soft_points;
    let (a, b) = if soft { Metric::PointToPoint.weights() } else { config.metric.weights() };
    let end = if soft { f64::INFINITY } else { config.end_spacings * spacing };
    let mut all = NormalEquations::default();
    let mut blocks: BTreeMap<[i64; 3], Vector6<f64>> = BTreeMap::new();
    for side in [Side::Source, Side::Target] {
        for (_, found) in side_matches(s, t, pose, side) {
            let squared = (found.moved - found.fixed).norm_squared();
            if squared > (NEAR * spacing).powi(2) {
                continue;
            }
            let w = if end.is_finite() { (end * end / (end * end + squared)).powi(2) } else { 1.0 };
            let one = equations(&found, a * w, b * w);
            all.merge(&one);
            let block = std::array::from_fn(|c| (found.fixed[c] / (BLOCK * spacing)).floor() as i64);
            *blocks.entry(block).or_insert_with(Vector6::zeros) += one.gradient;
        }
    }
    Scatter { covariance: covariance(&all, &blocks, target.radius), centre: target.centre }
}

fn equations(found: &Match, a: f64, b: f64) -> NormalEquations {
    let mut one = NormalEquations::default();
    one.add(found, a, b);
    one
}

fn covariance(all: &NormalEquations, blocks: &BTreeMap<[i64; 3], Vector6<f64>>, radius: f64) -> Matrix6<f64> {
    let none = Matrix6::from_diagonal_element(f64::INFINITY);
    let n = blocks.len() as f64;
    if n < 7.0 {
        return none;
    }
    // In units in which the radius is 1, so that turns and shifts are alike.
    let scale = Matrix6::from_diagonal(&Vector6::from_fn(|i, _| if i < 3 { 1.0 / radius } else { 1.0 }));
    let hessian = scale * all.hessian * scale;
    let meat = blocks.values().map(|g| scale * g).fold(Matrix6::zeros(), |sum, g| sum + g * g.transpose());
    let damped = hessian + Matrix6::identity() * (1e-9 * hessian.trace() / 6.0);
    match damped.try_inverse() {
        Some(inverse) => {
            let own = inverse * meat * inverse * (n / (n - 6.0));
            scale * own * scale
        }
        None => none,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};
    use srrf_cloud::PointCloud;

    use super::*;
    use crate::refine;

    /// Points of a bent sheet with a wall, `noise` on each.
    fn scene(noise: f64, rng: &mut ChaCha8Rng) -> PointCloud {
        let mut base = ChaCha8Rng::seed_from_u64(8);
        let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let points = (0..500).map(|i| {
            let [u, v]: [f64; 2] = base.random();
            let p = if i % 3 == 0 { [u, 0.0, v] } else { [u, 2.0 * v, 0.3 * (3.0 * u + v).sin()] };
            p.map(|c| c + noise * normal())
        });
        PointCloud::new(points.collect()).unwrap()
    }

    #[test]
    fn predicts_how_copies_with_other_noise_scatter() {
        let config = RefineConfig::default();
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let mut poses = Vec::new();
        let mut predicted = Vector6::zeros();
        for _ in 0..60 {
            let (source, target) = (scene(0.004, &mut rng), scene(0.004, &mut rng));
            let found = refine(&source, &target, &[Rigid::identity()], &config).unwrap();
            let (s, t) = (RefineCloud::of(&source), RefineCloud::of(&target));
            let said = spread(&s, &t, &s.frame_to(&t).pose(&found.target_from_source), &config);
            predicted += said.covariance.diagonal() / 60.0;
            let turn = Rotation3::from_matrix_unchecked(found.target_from_source.rotation).scaled_axis();
            let moved: [f64; 3] = said.centre.into();
            let shift = Vector3::from(found.target_from_source.apply(&moved)) - said.centre;
            poses.push(Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z));
        }
        let mean = poses.iter().sum::<Vector6<f64>>() / 60.0;
        let seen = poses.iter().map(|p| (p - mean).component_mul(&(p - mean))).sum::<Vector6<f64>>() / 59.0;
        for i in 0..6 {
            let ratio = (predicted[i] / seen[i]).sqrt();
            assert!((0.7..1.4).contains(&ratio), "{i}: {ratio} {predicted} {seen}");
        }
    }

    #[test]
    fn copies_do_not_scatter_and_little_says_nothing() {
        let cloud = scene(0.0, &mut ChaCha8Rng::seed_from_u64(1));
        let prepared = RefineCloud::of(&cloud);
        let config = RefineConfig::default();
        let exact = spread(&prepared, &prepared, &Rigid::identity(), &config);
        assert!(exact.translation().iter().chain(&exact.rotation_deg()).all(|d| *d < 1e-9), "{exact:?}");
        let away = Rigid { translation: Vector3::new(50.0, 0.0, 0.0), ..Rigid::identity() };
        assert_eq!(spread(&prepared, &prepared, &away, &config).translation(), [f64::INFINITY; 3]);
    }
}
