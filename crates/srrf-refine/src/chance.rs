//! [`Chance`]: whether two clouds agree by more than chance.

use nalgebra::Vector3;
use serde::Serialize;
use srrf_cloud::Rigid;

use crate::orientations::orientations;
use crate::probe::{ONE_SPACING, Probe, SCALES, Shares, divergence};

/// Poses that tell what chance gives.
const BY_CHANCE: usize = 32;
/// They are shifted by up to so many spacings.
const SHIFT: f64 = 1.0;

/// What chance gives, and how far a pose is beyond it.
///
/// After the a-contrario method (Moisan and Stival 2004; Moisan, Moulon and Monasse 2012): the number of false alarms is the number
/// of poses that a search could have told apart, times the chance that one of them brings as many points together as this one does.
/// How many lie together by chance is measured where the clouds lie, with the source turned at random about the overlap.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Chance {
    /// Natural logarithm of the number of false alarms: below 0 the agreement is more than chance gives.
    pub log_false_alarms: f64,
    /// Share of the source within one spacing of the target under such random turns.
    pub share_source: f64,
    /// The same of the target.
    pub share_target: f64,
}

impl Chance {
    /// The probability that the agreement is no chance: 0 where as many false alarms are expected, near 1 where none is.
    pub fn confidence(&self) -> f64 {
        // NaN, too, has none.
        if self.log_false_alarms < 0.0 { 1.0 - self.log_false_alarms.exp() } else { 0.0 }
    }
}

/// Measures `pose`. `target_radius` is the root mean square radius of the target.
pub(crate) fn chance(probe: &Probe<'_>, pose: &Rigid, target_radius: f64) -> Chance {
    let (centre, radius) = probe.overlap(pose);
    let found = probe.shares(pose);
    let expected = probe.mean_shares(&turned(probe, pose, &centre));
    let trials = trials(probe, pose);
    let mut log_false_alarms = f64::INFINITY;
    for side in 0..2 {
        let spacing = probe.spacings()[side];
        for scale in 0..SCALES.len() {
            let expected = expected_share(&expected, side, scale, trials[side]);
            let log_chance = -beyond(found[side][scale], expected, trials[side]);
            let within = SCALES[scale] * spacing;
            // Cells of SO(3), whose volume is 8 pi^2, and of the target's ball.
            let log_poses = 3.0 * (1.0 + radius / within).ln()
                + 3.0 * (1.0 + target_radius / within).ln()
                + (8.0 * std::f64::consts::PI.powi(2) * 4.19).ln();
            let tests = (2 * SCALES.len()) as f64;
            log_false_alarms = log_false_alarms.min(tests.ln() + log_poses + log_chance);
        }
    }
    Chance {
        log_false_alarms,
        share_source: expected[0][ONE_SPACING],
        share_target: expected[1][ONE_SPACING],
    }
}

/// How unlikely a share is by chance, as a logarithm. Three points lie on the other cloud in any case: a pose can be laid through them.
fn beyond(share: f64, expected: f64, trials: f64) -> f64 {
    let (free, on) = (trials - 3.0, share * trials - 3.0);
    if free > 0.0 && on > 0.0 { free * divergence(on / free, expected) } else { 0.0 }
}

/// The pose with the source turned at random about `centre`, and shifted a little.
fn turned(probe: &Probe<'_>, pose: &Rigid, centre: &Vector3<f64>) -> Vec<Rigid> {
    let spacing = probe.source.spacing.max(probe.target.spacing);
    orientations(BY_CHANCE)
        .map(|rotation| {
            let shift = SHIFT * spacing * (rotation * Vector3::new(0.48, 0.6, 0.64));
            let turn = Rigid { rotation, translation: centre - rotation * centre + shift };
            turn.compose(pose)
        })
        .collect()
}

/// Points of each side that count on their own: what lies on one and the same point counts once.
pub(crate) fn trials(probe: &Probe<'_>, pose: &Rigid) -> [f64; 2] {
    let (asked, partners) = (probe.asked(), probe.partners(pose));
    [0, 1].map(|side| asked[side].len().min(partners[side]) as f64)
}

/// The expected share at a scale; small ones, of which few were seen, follow from the larger ones, since the chance to lie within a
/// distance falls with its cube at least as fast as points are spread.
fn expected_share(expected: &Shares, side: usize, scale: usize, trials: f64) -> f64 {
    let at_one = expected[side][ONE_SPACING].max(0.5 / (trials * BY_CHANCE as f64).max(1.0));
    let spread = if scale > ONE_SPACING { at_one * SCALES[scale].powi(3) } else { at_one };
    expected[side][scale].max(spread).min(1.0 - 1e-9)
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};
    use srrf_cloud::{EulerXyz, PointCloud};

    use super::*;
    use crate::prepared::RefineCloud;
    use crate::{RefineConfig, refine};

    /// Points in a ball.
    fn ball(seed: u64, n: usize) -> PointCloud {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut points = Vec::new();
        while points.len() < n {
            let p: [f64; 3] = std::array::from_fn(|_| 2.0 * rng.random::<f64>() - 1.0);
            if Vector3::from(p).norm() < 1.0 {
                points.push(p);
            }
        }
        PointCloud::new(points).unwrap()
    }

    fn measured(source: &PointCloud, target: &PointCloud, pose: &Rigid) -> Chance {
        let (s, t) = (RefineCloud::of(source), RefineCloud::of(target));
        chance(&Probe::new(&s, &t), &s.frame_to(&t).pose(pose), t.radius)
    }

    #[test]
    fn unrelated_points_agree_by_chance_and_copies_do_not() {
        let starts: Vec<Rigid> =
            orientations(200).map(|rotation| Rigid { rotation, ..Rigid::identity() }).collect();
        for n in [3, 5, 10, 32, 100, 300] {
            for seed in 0..3 {
                let (source, target) = (ball(seed, n), ball(seed + 100, n));
                // The best that a search over all turns finds.
                let found = refine(&source, &target, &starts, &RefineConfig::default()).unwrap();
                let said = measured(&source, &target, &found.target_from_source);
                assert!(said.log_false_alarms > 0.0 && said.confidence() == 0.0, "{n} {seed}: {said:?}");
            }
        }
        for n in [8, 16, 64, 400] {
            let source = ball(7, n);
            let turned =
                Rigid { rotation: EulerXyz::from_deg([30.0, -17.0, 109.0]).to_matrix(), ..Rigid::identity() };
            let said = measured(&source, &source.transformed(&turned), &turned);
            assert!(said.confidence() > 0.999, "{n}: {said:?}");
        }
    }

    #[test]
    fn a_cloud_in_one_point_of_the_other_agrees_with_anything() {
        let source = ball(1, 500);
        let small = PointCloud::new(source.points().iter().map(|p| p.map(|c| c / 1000.0)).collect()).unwrap();
        for (a, b) in [(&small, &source), (&source, &small)] {
            let said = measured(a, b, &Rigid::identity());
            assert_eq!(said.confidence(), 0.0, "{said:?}");
        }
    }
}
