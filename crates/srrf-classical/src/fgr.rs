//! Fast global registration.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use serde::{Deserialize, Serialize};
use srrf_cloud::{PairFrame, Register, RegisterError, Registration, Rigid, Solid};
use srrf_refine::{Deformed, Match, NormalEquations, RefineConfig, RefineTarget};

use crate::correspond::{FeatureMatches, correspond};
use crate::fpfh_cloud::FpfhCloud;

/// Settings of [`Fgr`]. Defaults are Open3D's where not said otherwise; lengths are in voxels, which
/// follow from the clouds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FgrConfig {
    /// Clouds are thinned to at most so many points. Default 3,000; Open3D leaves the voxel to the user.
    pub points: usize,
    /// Radius of the features, in voxels. Default 5, as in Open3D's tutorial.
    pub feature_voxels: f64,
    /// Final scale of the kernel, in voxels. Default 0.5, as in Open3D's tutorial.
    pub distance_voxels: f64,
    /// Iterations of the optimisation. Default 64.
    pub iterations: usize,
    /// Factor by which the squared scale falls every fourth iteration. Default 1.4.
    pub division_factor: f64,
    /// Least ratio of an edge's lengths in the two clouds, in the tuple test. Default 0.95.
    pub tuple_scale: f64,
    /// Most tuples. Default 1,000.
    pub max_tuples: usize,
    /// Seed of the tuples. Default 0.
    pub seed: u64,
    /// The refinement behind it. Default on; the paper has none.
    pub refine: Option<RefineConfig>,
}

impl Default for FgrConfig {
    fn default() -> Self {
        Self {
            points: 3000,
            feature_voxels: 5.0,
            distance_voxels: 0.5,
            iterations: 64,
            division_factor: 1.4,
            tuple_scale: 0.95,
            max_tuples: 1000,
            seed: 0,
            refine: Some(RefineConfig { deformed: Deformed::Halfway, ..RefineConfig::default() }),
        }
    }
}

/// Fast global registration (Zhou, Park and Koltun 2016): reciprocal matches of FPFH, the tuple test,
/// and one robust optimisation with graduated non-convexity; then refinement.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Fgr {
    /// The settings.
    pub config: FgrConfig,
}

impl Fgr {
    /// The method with these settings.
    pub fn new(config: FgrConfig) -> Self {
        Self { config }
    }
}

impl Register for Fgr {
    fn name(&self) -> &str {
        "fgr"
    }

    fn register_solid(&self, source: Solid<'_>, target: Solid<'_>) -> Result<Registration, RegisterError> {
        let config = &self.config;
        let (source_ready, target_ready) = FpfhCloud::pair(source, target)?;
        let matches = correspond(&source_ready, &target_ready, config.points, config.feature_voxels, 30)?;
        let pairs = tuple_test(&matches, config);
        if pairs.len() < 3 {
            return Err(RegisterError::NoPose(
                format!(
                    "{} of {} matches pass the tuple test, at least 3 are needed; lower `tuple_scale`",
                    pairs.len(),
                    matches.pairs.len()
                )
                .into(),
            ));
        }
        let pose = optimise(&pairs, config.distance_voxels * matches.voxel, config);
        let Some(refine) = &config.refine else {
            return Ok(Registration { iterations: config.iterations, ..Registration::from_pose(pose) });
        };
        let refined = RefineTarget::new(target, refine)?.refine(source, &[pose])?;
        Ok(Registration {
            converged: refined.converged,
            iterations: config.iterations + refined.iterations,
            ..Registration::from_pose(refined.target_from_source)
        })
    }
}

type PointPair = ([f64; 3], [f64; 3]);

/// The matches of random triples whose edges have like lengths in both clouds (section 3.1 of the
/// paper); all matches where hardly any triple passes.
fn tuple_test(matches: &FeatureMatches, config: &FgrConfig) -> Vec<PointPair> {
    let all: Vec<PointPair> = matches
        .pairs
        .iter()
        .map(|&(i, j)| (matches.source[i as usize], matches.target[j as usize]))
        .collect();
    if all.len() < 3 {
        return all;
    }
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
    let mut kept = Vec::new();
    // Open3D draws a hundred times as often as there are matches.
    for _ in 0..100 * all.len() {
        let triple: [usize; 3] = std::array::from_fn(|_| rng.random_range(0..all.len()));
        let edges = [(triple[0], triple[1]), (triple[1], triple[2]), (triple[2], triple[0])];
        let like = edges.iter().all(|&(i, j)| {
            let (s, t) = (distance(&all[i].0, &all[j].0), distance(&all[i].1, &all[j].1));
            s > 0.0 && s > config.tuple_scale * t && t > config.tuple_scale * s
        });
        if like {
            kept.extend(triple.map(|i| all[i]));
            if kept.len() >= 3 * config.max_tuples {
                break;
            }
        }
    }
    if kept.len() < 30 { all } else { kept }
}

/// Minimises `sum mu r^2 / (mu + r^2)` with `mu` falling from the squared size of the clouds to `end^2`
/// (the scaled Geman-McClure kernel and line process of section 3.2).
fn optimise(pairs: &[PointPair], end: f64, config: &FgrConfig) -> Rigid {
    let mean = |side: fn(&PointPair) -> [f64; 3]| {
        pairs.iter().map(|p| nalgebra::Vector3::from(side(p))).sum::<nalgebra::Vector3<f64>>()
            / pairs.len() as f64
    };
    let (x0, y0) = (mean(|p| p.0), mean(|p| p.1));
    let size = pairs.iter().map(|p| (nalgebra::Vector3::from(p.0) - x0).norm()).fold(0.0, f64::max);
    let least = end * end;
    let mut mu = (size * size).max(least);
    // Between centred points, so that far clouds lose no digits.
    let frame = PairFrame::about(x0, y0);
    let mut pose = Rigid::identity();
    for iteration in 0..config.iterations {
        let mut sums = NormalEquations::default();
        for (x, y) in pairs {
            let moved = nalgebra::Vector3::from(pose.apply(&frame.source(x)));
            let fixed = nalgebra::Vector3::from(frame.target(y));
            let weight = (mu / (mu + (moved - fixed).norm_squared())).powi(2);
            sums.add(&Match { moved, fixed, normal: nalgebra::Vector3::zeros() }, weight, 0.0);
        }
        let Some(next) = sums.step(&pose, size.max(f64::MIN_POSITIVE)) else { break };
        pose = next;
        if iteration % 4 == 3 {
            mu = (mu / config.division_factor).max(least);
        }
    }
    frame.undo_pose(&pose)
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (nalgebra::Vector3::from(*a) - nalgebra::Vector3::from(*b)).norm()
}

#[cfg(test)]
mod tests {
    use srrf_cloud::EulerXyz;

    use super::*;

    #[test]
    fn outliers_lose_their_say() {
        let truth = Rigid {
            rotation: EulerXyz::from_deg([80.0, -40.0, 60.0]).to_matrix(),
            translation: [4e5, -3.0, 1.0].into(),
        };
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut point = || -> [f64; 3] { std::array::from_fn(|_| rng.random_range(-1.0..1.0)) };
        let pairs: Vec<PointPair> = (0..100)
            .map(|i| {
                let x = point();
                (x, if i % 4 == 0 { truth.apply(&point()) } else { truth.apply(&x) })
            })
            .collect();
        let found = optimise(&pairs, 0.02, &FgrConfig::default());
        assert!(found.angle_to_deg(&truth) < 0.1, "{}", found.angle_to_deg(&truth));
    }

    #[test]
    fn the_tuple_test_keeps_rigid_triples() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut point = || -> [f64; 3] { std::array::from_fn(|_| rng.random_range(-1.0..1.0)) };
        let source: Vec<[f64; 3]> = (0..200).map(|_| point()).collect();
        let target = source.iter().enumerate().map(|(i, p)| if i < 100 { *p } else { point() }).collect();
        let matches = FeatureMatches {
            source,
            target,
            voxel: 0.1,
            pairs: (0..200).map(|i| (i, i)).collect(),
            one_way: vec![],
        };
        let kept = tuple_test(&matches, &FgrConfig::default());
        let right = kept.iter().filter(|(x, y)| x == y).count();
        assert!(kept.len() > 300 && right as f64 > 0.9 * kept.len() as f64, "{right} of {}", kept.len());
    }
}
