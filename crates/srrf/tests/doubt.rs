//! What the clouds do not determine is never an answer that one may rely on.
#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

mod common;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use srrf::{Error, Method, Options, Outcome, Registrar, Request};
use srrf_cloud::{CloudError, EulerXyz, PointCloud, Rigid};

fn registrar(method: Method) -> Registrar {
    Registrar::new(Options { method, check_scale: false, ..Options::default() }).unwrap()
}

/// What `method` answers from this first guess.
fn answer(method: Method, source: &PointCloud, target: &PointCloud, initial: Rigid) -> Outcome {
    registrar(method).register(&Request::new(source, target).with_initial(initial)).unwrap()
}

fn cloud(n: usize, mut at: impl FnMut() -> [f64; 3]) -> PointCloud {
    PointCloud::new((0..n).map(|_| at()).collect()).unwrap()
}

/// `n` points in a ball.
fn ball(n: usize, seed: u64) -> PointCloud {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    cloud(n, || {
        loop {
            let p: [f64; 3] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
            if Vector3::from(p).norm() < 1.0 {
                return p;
            }
        }
    })
}

/// The surface of a box, at random points.
fn boxed(n: usize, seed: u64, sides: [f64; 3]) -> PointCloud {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let areas = [sides[1] * sides[2], sides[0] * sides[2], sides[0] * sides[1]];
    cloud(n, || {
        let pick = rng.random_range(0.0..areas.iter().sum());
        let face = usize::from(pick > areas[0]) + usize::from(pick > areas[0] + areas[1]);
        let mut p: [f64; 3] = std::array::from_fn(|c| sides[c] * rng.random::<f64>());
        p[face] = if rng.random_bool(0.5) { 0.0 } else { sides[face] };
        p
    })
}

fn turned(degrees: [f64; 3]) -> Rigid {
    Rigid { rotation: EulerXyz::from_deg(degrees).to_matrix(), translation: Vector3::new(0.3, -0.2, 0.1) }
}

#[test]
fn few_unrelated_points_are_never_trusted() {
    let auto = registrar(Method::Auto);
    let sizes = [(3, 3), (10, 10), (32, 32), (100, 100), (3, 2000), (30, 2000), (300, 2000)];
    for (seed, (few, many)) in sizes.into_iter().enumerate() {
        let found =
            auto.register(&Request::new(&ball(few, seed as u64), &ball(many, seed as u64 + 50))).unwrap();
        assert!(found.abstain, "{few} {many}: {}", found.probability);
    }
}

#[test]
fn copies_of_a_few_irregular_points_are_answered() {
    for n in [16, 64] {
        let (source, truth) = (ball(n, 7), turned([30.0, 100.0, -20.0]));
        let found = answer(Method::Given, &source, &source.transformed(&truth), truth);
        assert!(found.target_from_source.angle_to_deg(&truth) < 1e-3 && !found.abstain, "{n}: {found:?}");
        assert_eq!((found.poses.len(), found.undetermined.len()), (1, 0));
    }
}

#[test]
fn a_scale_that_collapses_is_not_trusted() {
    let shape = common::shape(800);
    let small = PointCloud::new(shape.points().iter().map(|p| p.map(|c| c / 1000.0)).collect()).unwrap();
    let auto = registrar(Method::FpfhRansac);
    for (source, target) in [(&small, &shape), (&shape, &small)] {
        for method in [Method::Given, Method::Icp] {
            assert!(answer(method, source, target, Rigid::identity()).abstain);
        }
        if let Ok(found) = auto.register(&Request::new(source, target)) {
            assert!(found.abstain, "{}", found.probability);
        }
    }
}

#[test]
fn numbers_that_cannot_be_computed_with_are_named() {
    let (given, good) = (registrar(Method::Given), ball(50, 1));
    let huge = PointCloud::new(good.points().iter().map(|p| p.map(|c| c * 1e155)).collect()).unwrap();
    let error = given.register(&Request::new(&huge, &good)).unwrap_err();
    assert!(matches!(error, Error::Source(CloudError::OutOfRange { .. })), "{error}");
    let mut points = good.points().to_vec();
    points[17] = [1e160, 0.0, 0.0];
    let error = given.register(&Request::new(&good, &PointCloud::new(points).unwrap())).unwrap_err();
    assert!(matches!(error, Error::Target(CloudError::Stray { count: 1, index: 17, .. })), "{error}");
    // Nearly all points in one place: three places, which determine nothing.
    let mut heap = vec![[0.0; 3]; 500];
    heap.extend([[1.0, 0.0, 0.0], [0.0, 0.7, 0.2]]);
    let heap = PointCloud::new(heap).unwrap();
    assert!(answer(Method::Given, &heap, &heap, Rigid::identity()).abstain);
}

#[test]
fn a_cube_has_twenty_four_poses_and_a_box_four() {
    for (sides, poses) in [([1.0; 3], 24), ([1.0, 1.5, 2.2], 4)] {
        let truth = turned([20.0, -10.0, 15.0]);
        let (source, target) = (boxed(1500, 1, sides), boxed(1500, 2, sides).transformed(&truth));
        let found = answer(Method::Given, &source, &target, truth);
        assert_eq!(found.poses.len(), poses, "{:?}", found.features);
        assert!(
            found.abstain && found.undetermined.is_empty(),
            "{} {:?}",
            found.probability,
            found.undetermined
        );
        let whole: f64 = found.poses.iter().map(|p| p.probability.get()).sum();
        assert!(whole <= 1.0 && whole > 0.2, "{whole}");
        // Each of them is another one.
        for (i, one) in found.poses.iter().enumerate() {
            let angle = |p: &srrf::CandidatePose| p.target_from_source.angle_to_deg(&one.target_from_source);
            assert!(found.poses[..i].iter().all(|p| angle(p) > 60.0));
        }
    }
}

#[test]
fn samplings_of_a_box_join_no_map_however_many_loops_close() {
    for (sides, count) in [([1.0, 1.0, 1.0], 2), ([1.0, 1.5, 2.2], 4)] {
        let scans: Vec<PointCloud> = (0..count)
            .map(|i| {
                let turn = turned([80.0 * i as f64, 50.0 * i as f64, -70.0 * i as f64]);
                boxed(1000, 20 + i, sides).transformed(&turn)
            })
            .collect();
        let map = srrf::align(&scans).unwrap();
        let placed: Vec<_> = map.scans.iter().filter(|scan| !scan.abstain).collect();
        assert!(placed.is_empty(), "{sides:?}: {placed:?}");
    }
}
