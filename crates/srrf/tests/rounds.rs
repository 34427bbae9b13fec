//! Where there is no doubt, the first round of starts is the only one; where there is, others follow.
#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

mod common;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use srrf::{Method, Options, Outcome, Registrar, Request, Stage, Warning};
use srrf_cloud::{EulerXyz, PointCloud, Rigid};

const WIDER: Stage = Stage::FpfhRansacWider;

fn stages(found: &Outcome) -> Vec<Stage> {
    found.times.iter().map(|time| time.stage).collect()
}

/// The part of a cloud below a height of a direction.
fn below(cloud: &PointCloud, direction: Vector3<f64>, height: f64) -> PointCloud {
    let kept = |p: &&[f64; 3]| Vector3::from(**p).dot(&direction) < height;
    PointCloud::new(cloud.points().iter().filter(kept).copied().collect()).unwrap()
}

#[test]
fn doubt_asks_for_more_starts() {
    let shape = common::shape(1500);
    let truth = Rigid {
        rotation: EulerXyz::from_deg([40.0, -70.0, 130.0]).to_matrix(),
        translation: Vector3::new(0.3, -0.2, 0.1),
    };
    let registrar = Registrar::new(Options { method: Method::FpfhRansac, ..Options::default() }).unwrap();

    let sure = registrar.register(&Request::new(&shape, &shape.transformed(&truth))).unwrap();
    assert!(sure.probability.get() > 0.9, "{}", sure.probability);
    assert!(!stages(&sure).contains(&WIDER), "{:?}", stages(&sure));
    assert!(sure.refinement.unwrap().starts.len() <= 4);

    // What is left of one cloud is hardly in the other.
    let (one, other) = (below(&shape, Vector3::x(), -0.05), below(&shape, -Vector3::x(), 0.1));
    let doubtful = registrar.register(&Request::new(&one, &other.transformed(&truth))).unwrap();
    assert!(doubtful.probability.get() < 0.9, "{}", doubtful.probability);
    let stages = stages(&doubtful);
    assert!(stages.contains(&WIDER), "{stages:?}");
    let mut stages: Vec<String> = stages.iter().map(Stage::to_string).collect();
    // The result holds the times by name: none may hide another.
    let count = stages.len();
    stages.sort_unstable();
    stages.dedup();
    assert_eq!(stages.len(), count, "{stages:?}");
    assert!(doubtful.refinement.unwrap().starts.len() > 20);
}

/// A cloud of 16 random points, and itself with noise.
fn few_points(seed: u64) -> (PointCloud, PointCloud) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0 };
    let source: Vec<[f64; 3]> = (0..16).map(|_| [normal(), 0.7 * normal(), 0.4 * normal()]).collect();
    let target = source.iter().map(|p| p.map(|c| c + 0.07 * normal())).collect();
    (PointCloud::new(source).unwrap(), PointCloud::new(target).unwrap())
}

#[test]
fn where_the_first_features_find_nothing_wider_ones_are_tried_at_once() {
    let registrar = Registrar::new(Options { method: Method::FpfhRansac, ..Options::default() }).unwrap();
    let tried_at_once = (0..16).filter(|seed| {
        let (source, target) = few_points(*seed);
        let Ok(found) = registrar.register(&Request::new(&source, &target)) else { return false };
        let stages = stages(&found);
        let at = |stage: Stage| stages.iter().position(|s| *s == stage);
        assert!(!found.warnings.iter().any(|w| matches!(w, Warning::NoPose { .. })), "{:?}", found.warnings);
        at(WIDER).is_some_and(|wider| Some(wider) < at(Stage::Refine))
    });
    assert!(tried_at_once.count() > 0);
}
