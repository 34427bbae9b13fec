//! Clouds in any unit, anywhere: the frame of a pair, batches, and the network behind the
//! `Register` seam.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use std::collections::BTreeMap;

use burn::tensor::Device;
use common::{Numbers, difference, ratios, tiny, values};
use nalgebra::Vector3;
use srrf_cloud::{CloudError, PointCloud, Register, RegisterError, Registration, Rigid, SoftMatch};
use srrf_model::{
    BranchRatios, CommonRatios, InferenceConfig, IntegrationRule, Matches, McNemar, NetworkBranch, PairBatch,
    SrrfConfig, SrrfRegister, embedded, init, network_frame, weights,
};

/// Far from the origin, as map coordinates in metres are.
const UTM: [f64; 3] = [500_000.0, 4_500_000.0, 120.0];

fn cloud(seed: u64, n: usize) -> PointCloud {
    let points = Numbers(seed).many(n * 3);
    PointCloud::new(points.chunks_exact(3).map(|p| [p[0], 0.6 * p[1], 0.3 * p[2]]).collect()).unwrap()
}

/// `factor p + offset`.
fn placed(cloud: &PointCloud, factor: f64, offset: [f64; 3]) -> PointCloud {
    let place = |p: &[f64; 3]| [0, 1, 2].map(|c| factor * p[c] + offset[c]);
    PointCloud::new(cloud.points().iter().map(place).collect()).unwrap()
}

fn drawn(seed: u64) -> Rigid {
    let mut numbers = Numbers(seed);
    Rigid { rotation: numbers.rotation(45.0), translation: Vector3::from_vec(numbers.many(3)) }
}

/// Largest distance between the images of the points of a cloud under two poses.
fn image_gap(cloud: &PointCloud, a: &Rigid, b: &Rigid) -> f64 {
    let gap = |p: &[f64; 3]| (Vector3::from(a.apply(p)) - Vector3::from(b.apply(p))).norm();
    cloud.points().iter().map(gap).fold(0.0, f64::max)
}

#[test]
fn frames_centre_scale_and_are_undone() {
    for (factor, offset) in [(1.0, [0.0; 3]), (37.0, UTM), (1e-4, [1.0, -2.0, 3.0])] {
        let source = placed(&cloud(1, 61), factor, offset);
        let pose = drawn(2);
        let target = source.transformed(&pose);
        let frame = network_frame(&source, &target);

        let mut sums = [Vector3::zeros(); 2];
        let mut squares = 0.0;
        for (p, q) in source.points().iter().zip(target.points()) {
            let (p, q) = (Vector3::from(frame.source(p)), Vector3::from(frame.target(q)));
            sums = [sums[0] + p, sums[1] + q];
            squares += (p.norm_squared() + q.norm_squared()) / 122.0;
        }
        assert!(sums.iter().all(|sum| sum.norm() / 61.0 < 1e-9 / factor.min(1.0)), "{sums:?}");
        assert!((squares.sqrt() - 0.6).abs() < 1e-6);

        // The frames commute with the pose, and the conversion is undone.
        let inside = frame.pose(&pose);
        for p in source.points() {
            let one = Vector3::from(frame.target(&pose.apply(p)));
            let other = Vector3::from(inside.apply(&frame.source(p)));
            assert!((one - other).norm() < 1e-8 / factor.min(1.0));
        }
        let back = frame.undo_pose(&inside);
        assert!(image_gap(&source, &back, &pose) < 1e-6 * factor.max(1e-3));
    }
}

#[test]
fn batches_hold_network_units_and_return_poses() {
    let device = Device::flex();
    let poses = [drawn(3), drawn(4), drawn(5)];
    let sources = [placed(&cloud(6, 61), 1.0, UTM), cloud(7, 61), placed(&cloud(8, 61), 250.0, [0.0; 3])];
    let targets: Vec<PointCloud> = sources.iter().zip(&poses).map(|(s, pose)| s.transformed(pose)).collect();
    let pairs: Vec<(&PointCloud, &PointCloud)> = sources.iter().zip(&targets).collect();
    let batch = PairBatch::new(&pairs, &device).unwrap();
    assert_eq!(batch.source.dims(), [3, 61, 3]);
    assert_eq!(batch.target.dims(), [3, 61, 3]);

    // The true poses carry the source tensors onto the target tensors, and come back.
    let (rotation, translation) = batch.truth(&poses);
    let moved = srrf_model::transform(batch.source.clone(), rotation.clone(), translation.clone());
    assert!(difference(&values(&moved), &values(&batch.target)) < 1e-6);
    for ((found, pose), source) in
        batch.poses(&rotation, &translation).unwrap().iter().zip(&poses).zip(&sources)
    {
        let extent = 2.0 * source.to_unit_sphere().1.radius;
        assert!(image_gap(source, &found.unwrap(), pose) < 1e-6 * extent, "also far from the origin");
    }

    // One pose that is not finite spoils no other.
    let broken =
        translation.slice_assign([1..2, 0..1], burn::tensor::Tensor::full([1, 1], f32::NAN, &device));
    let found = batch.poses(&rotation, &broken).unwrap();
    assert_eq!(found.iter().map(Option::is_some).collect::<Vec<_>>(), [true, false, true]);
}

#[test]
fn batches_need_equal_numbers_of_points() {
    let device = Device::flex();
    let (a, b) = (cloud(9, 13), cloud(10, 11));
    assert!(PairBatch::new(&[], &device).is_none());
    assert!(PairBatch::new(&[(&a, &b)], &device).is_none());
    assert!(PairBatch::new(&[(&a, &a), (&b, &b)], &device).is_none());
    // Coinciding points have no scale; they are centred and keep their own.
    let dot = PointCloud::new(vec![[7.0; 3]; 13]).unwrap();
    let batch = PairBatch::new(&[(&dot, &dot)], &device).unwrap();
    assert!(values(&batch.source).iter().all(|&v| v == 0.0));
}

fn network() -> SrrfRegister {
    network_with(InferenceConfig::default())
}

fn network_with(inference: InferenceConfig) -> SrrfRegister {
    with_config(SrrfConfig { inference, ..tiny() })
}

fn with_config(config: SrrfConfig) -> SrrfRegister {
    let device = Device::flex();
    let model = init::seeded(config.init(&device), 12);
    let bytes = weights::to_safetensors(&model, &config, "tiny", &BTreeMap::new()).unwrap();
    SrrfRegister::new(weights::from_safetensors(&bytes, "memory", &device).unwrap(), device)
}

fn gap_deg(a: &Registration, b: &Registration) -> f64 {
    a.target_from_source.angle_to_deg(&b.target_from_source)
}

#[test]
fn answers_hold_both_branches() {
    let network = network();
    assert_eq!(network.name(), "srrf");
    let answer = network.register(&cloud(13, 61), &cloud(14, 67)).unwrap();
    assert_eq!(answer.iterations, 2, "two passes by default");
    assert_eq!(answer.branches.iter().map(|b| b.kind.name()).collect::<Vec<_>>(), ["dense", "skeleton"]);
    for branch in &answer.branches {
        assert!((0.0..=1.0).contains(&branch.inlier_ratio));
        assert!((branch.target_from_source.rotation.determinant() - 1.0).abs() < 1e-12);
    }
    assert!((answer.target_from_source.rotation.determinant() - 1.0).abs() < 1e-12);

    // The same input gives the same answer, whatever was registered in between.
    network.register(&cloud(15, 3), &cloud(13, 61)).unwrap();
    assert_eq!(network.register(&cloud(13, 61), &cloud(14, 67)).unwrap(), answer);
}

/// The fused pose is the blend of the branches' by the lambda that is reported: the rotation the projection of the blended
/// rotations, and the place of the source's mean, about which the network works, the blend of its places.
fn is_the_blend(answer: &Registration, source: &PointCloud) {
    let lambda = answer.lambda.unwrap();
    assert!((0.0..=1.0).contains(&lambda));
    let [dense, skeleton] = [0, 1].map(|i| answer.branches[i].target_from_source);
    let blended =
        Rigid::nearest_rotation(&(dense.rotation * lambda + skeleton.rotation * (1.0 - lambda))).unwrap();
    assert!((blended - answer.target_from_source.rotation).norm() < 1e-5);
    let mean: [f64; 3] = source.centroid().into();
    let place = |pose: &Rigid| Vector3::from(pose.apply(&mean));
    let wanted = place(&dense) * lambda + place(&skeleton) * (1.0 - lambda);
    assert!((wanted - place(&answer.target_from_source)).norm() < 1e-5);
    assert!(dense.angle_to_deg(&skeleton) > 0.1, "branches that agree would hide a wrong lambda");
}

#[test]
fn lambda_is_the_number_that_the_pose_was_made_with() {
    let device = Device::flex();
    let (source, target) = (cloud(13, 61), cloud(14, 61));
    let mut lambdas = Vec::new();
    for passes in [1, 2, 3] {
        for integration in [
            IntegrationRule::SoftMatch(ratios(0.4, 0.3)),
            IntegrationRule::Nearest(BranchRatios { sharpness: 2.0, ..ratios(0.4, 0.3) }),
            IntegrationRule::BothWays(ratios(0.4, 0.3)),
            IntegrationRule::Common(CommonRatios { threshold: 0.4, sharpness: 1.0, skeleton_weight: 0.5 }),
            IntegrationRule::McNemar(McNemar { threshold: 0.4, standard_errors: 1.0 }),
        ] {
            let inference = InferenceConfig { passes, ..InferenceConfig::default() };
            let config = SrrfConfig { integration, inference, ..tiny() };
            let answer = with_config(config).register(&source, &target).unwrap();
            is_the_blend(&answer, &source);
            lambdas.push(answer.lambda.unwrap());
        }
    }
    assert!(lambdas.iter().any(|l| *l > 0.01 && *l < 0.49 || *l > 0.51 && *l < 0.99), "{lambdas:?}");

    for name in embedded::names() {
        let loaded = embedded::load(name, &device).unwrap().unwrap();
        let answer = SrrfRegister::new(loaded, device.clone()).register(&source, &target).unwrap();
        is_the_blend(&answer, &source);
    }
    let alone = network().alone(NetworkBranch::Dense).register(&source, &target).unwrap();
    assert_eq!(alone.lambda, None);
}

/// A branch alone is what one gets by hand: its own pose of one pass, applied, and its own pose of the next.
#[test]
fn a_branch_alone_starts_each_pass_from_its_own_pose() {
    let (source, target) = (cloud(13, 61), cloud(14, 61));
    let once = network_with(InferenceConfig::paper());
    for (i, which) in [NetworkBranch::Dense, NetworkBranch::Skeleton].into_iter().enumerate() {
        let alone = network().alone(which);
        assert_eq!(alone.name(), ["srrf-dense-alone", "srrf-skeleton-alone"][i]);
        let found = alone.register(&source, &target).unwrap();
        let pose =
            |source: &PointCloud| once.register(source, &target).unwrap().branches[i].target_from_source;
        let first = pose(&source);
        let both = pose(&source.transformed(&first)).compose(&first);
        assert!(found.target_from_source.angle_to_deg(&both) < 0.01);
        assert!(image_gap(&source, &found.target_from_source, &both) < 1e-3);
        // The fused pose, from which the branches of the whole network go on, is another one.
        assert!(first.angle_to_deg(&once.register(&source, &target).unwrap().target_from_source) > 0.1);
    }
}

#[test]
fn skeletons_come_in_the_coordinates_of_their_clouds() {
    let (source, target) = (placed(&cloud(25, 61), 40.0, UTM), cloud(26, 61));
    let answer = network().register(&source, &target).unwrap();
    let skeletons = answer.skeletons.unwrap();
    for (cloud, skeleton) in [(&source, skeletons.source), (&target, skeletons.target)] {
        assert_eq!((skeleton.points.len(), skeleton.radii.len()), (19, 19));
        let radius = cloud.to_unit_sphere().1.radius;
        let slack = 1e-6 * radius;
        assert!(skeleton.radii.iter().all(|r| (0.0..radius).contains(r)), "lengths of the cloud");
        for axis in 0..3 {
            let of = |points: &[[f64; 3]]| {
                let values = points.iter().map(|p| p[axis]);
                (values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max))
            };
            let (low, high) = of(cloud.points());
            let (least, most) = of(&skeleton.points);
            assert!(low - slack <= least && most <= high + slack, "inside the box of the cloud");
            assert!(most > least, "and not one point");
        }
    }
}

#[test]
fn unusable_clouds_are_refused_by_side() {
    let (network, good) = (network(), cloud(16, 61));
    let cloud = |points: Vec<[f64; 3]>| PointCloud::new(points).unwrap();
    let line = cloud((0..31).map(|i| [f64::from(i), 2.0 * f64::from(i), -1.0]).collect());
    let two = cloud(vec![[0.0; 3], [1.0, 0.0, 0.0]]);
    let dot = cloud(vec![[3.0; 3]; 9]);
    for (bad, wanted) in [
        (&line, CloudError::Collinear),
        (&dot, CloudError::Collinear),
        (&two, CloudError::TooFew { have: 2, need: 3 }),
    ] {
        match network.register(bad, &good) {
            Err(RegisterError::Source(found)) => assert_eq!(found, wanted),
            other => panic!("{other:?}"),
        }
        match network.register(&good, bad) {
            Err(RegisterError::Target(found)) => assert_eq!(found, wanted),
            other => panic!("{other:?}"),
        }
    }
    // Three points, coinciding points among others, and a plane are enough.
    let three = cloud(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let doubled = cloud(good.points().iter().chain(good.points()).copied().collect());
    for (source, target) in [(&three, &three), (&three, &good), (&good, &three), (&doubled, &good)] {
        let pose = network.register(source, target).unwrap().target_from_source;
        assert!(pose.rotation.iter().chain(pose.translation.iter()).all(|v| v.is_finite()));
    }
}

#[test]
fn numbers_beyond_measure_are_an_error() {
    let (network, good) = (network(), cloud(17, 61));
    for factor in [1e155, 1e200, 1e300] {
        let huge = placed(&good, factor, [0.0; 3]);
        for (source, target) in [(&huge, &huge), (&huge, &good), (&good, &huge)] {
            let error = network.register(source, target).unwrap_err();
            let (RegisterError::Source(why) | RegisterError::Target(why)) = &error else { panic!("{error}") };
            assert!(matches!(why, CloudError::OutOfRange { .. }), "{factor:e}: {why:?}");
        }
    }
    for factor in [1e99, 1e-99] {
        let cloud = placed(&good, factor, [0.0; 3]);
        assert!(network.register(&cloud, &cloud).is_ok());
    }
}

#[test]
fn answers_follow_translation_scale_and_order() {
    let network = network();
    let (source, target) = (cloud(18, 61), cloud(19, 61));
    let plain = network.register(&source, &target).unwrap();
    let pose = plain.target_from_source;

    // Each cloud anywhere: the rotation stays, the images move with the target. In metres at map
    // coordinates, f64 itself rounds at 1e-9.
    for (a, b) in [([5.0, -7.0, 0.25], [-300.0, 2.0, 1.0]), (UTM, [0.0; 3]), (UTM, UTM)] {
        let (moved_source, moved_target) = (placed(&source, 1.0, a), placed(&target, 1.0, b));
        let moved = network.register(&moved_source, &moved_target).unwrap();
        assert!(gap_deg(&plain, &moved) < 0.01, "{}", gap_deg(&plain, &moved));
        for (p, q) in source.points().iter().zip(moved_source.points()) {
            let wanted = Vector3::from(pose.apply(p)) + Vector3::from(b);
            assert!((Vector3::from(moved.target_from_source.apply(q)) - wanted).norm() < 1e-3);
        }
    }

    // Another unit for both.
    for unit in [0.3048, 1000.0, 1e-9, 1e12] {
        let scaled =
            network.register(&placed(&source, unit, [0.0; 3]), &placed(&target, unit, [0.0; 3])).unwrap();
        assert!(gap_deg(&plain, &scaled) < 0.01);
        let gap = scaled.target_from_source.translation / unit - pose.translation;
        assert!(gap.norm() < 1e-3);
    }

    // Another order.
    let order = Numbers(20).permutation(61);
    let shuffled = PointCloud::new(order.iter().map(|&i| source.points()[i]).collect()).unwrap();
    assert!(gap_deg(&plain, &network.register(&shuffled, &target).unwrap()) < 0.05);
}

#[test]
fn more_points_than_the_network_takes_are_subsampled_and_passes_are_chained() {
    let mut network = network();
    let (source, target) = (cloud(21, 211), cloud(22, 97));
    network.max_points = 61;
    let one = network.register(&source, &target).unwrap();
    // Even samples do not depend on the order, also far from the origin.
    let mut turned = source.points().to_vec();
    turned.reverse();
    let far = placed(&PointCloud::new(turned).unwrap(), 1.0, UTM);
    assert!(gap_deg(&one, &network.register(&far, &target).unwrap()) < 0.05);

    // Two passes are one pass, and one more on the source as the first left it.
    network.passes = 2;
    let two = network.register(&source, &target).unwrap();
    assert_eq!(two.iterations, 2);
    network.passes = 1;
    network.max_points = 1024;
    let (source, target) = (cloud(23, 61), cloud(24, 61));
    let first = network.register(&source, &target).unwrap().target_from_source;
    let second = network.register(&source.transformed(&first), &target).unwrap();
    network.passes = 2;
    let both = network.register(&source, &target).unwrap();
    let chained = second.target_from_source.compose(&first);
    assert!(image_gap(&source, &both.target_from_source, &chained) < 1e-9);
    for (branch, last) in both.branches.iter().zip(&second.branches) {
        let chained = last.target_from_source.compose(&first);
        assert!(image_gap(&source, &branch.target_from_source, &chained) < 1e-9);
    }
}

#[test]
fn the_header_says_how_the_network_is_used() {
    let (source, target) = (cloud(25, 61), cloud(26, 61));
    let last = InferenceConfig { passes: 3, last_tokens: Some(0), last_matches: Matches::Best, prior: None };
    let answer = network_with(last.clone()).register(&source, &target).unwrap();
    assert_eq!((answer.iterations, answer.matches.len()), (3, 61), "all points are tokens");
    // Every match is a target point.
    let matched = |m: &SoftMatch| {
        let near = |p: &&[f64; 3]| (0..3).all(|c| (p[c] - m.target[c]).abs() < 1e-5);
        target.points().iter().any(|p| near(&p))
    };
    assert!(answer.matches.iter().all(matched));
    // The passes before the last one take the mean, on as many tokens as the branch has.
    let mut first = network_with(InferenceConfig::default());
    let pose = first.register(&source, &target).unwrap().target_from_source;
    let last = network_with(InferenceConfig { passes: 1, ..last });
    let then = last.register(&source.transformed(&pose), &target).unwrap().target_from_source.compose(&pose);
    assert!(image_gap(&source, &answer.target_from_source, &then) < 1e-9);
    first.passes = 1;
    let soft = first.register(&source, &target).unwrap();
    assert!(soft.matches.len() < 61 && !soft.matches.iter().all(matched));
}

#[test]
fn a_narrow_prior_matches_each_point_with_the_nearest_one() {
    let (source, target) = (cloud(25, 61), cloud(26, 61));
    let best =
        InferenceConfig { last_tokens: Some(0), last_matches: Matches::Best, ..InferenceConfig::default() };
    let prior = |passes| InferenceConfig { passes, prior: Some(1e-3), ..best.clone() };
    // The first pass knows of no pose, and takes no notice.
    let without = InferenceConfig { prior: None, ..prior(1) };
    let first = network_with(without).register(&source, &target).unwrap().target_from_source;
    assert_eq!(network_with(prior(1)).register(&source, &target).unwrap().target_from_source, first);

    let soft = network_with(InferenceConfig { passes: 1, ..InferenceConfig::default() });
    let placed = soft.register(&source, &target).unwrap().target_from_source;
    let answer = network_with(prior(2)).register(&source, &target).unwrap();
    assert_eq!(answer.matches.len(), 61);
    for m in &answer.matches {
        let at = placed.apply(&m.source);
        let off = |p: &[f64; 3]| (0..3).map(|c| (p[c] - at[c]).powi(2)).sum::<f64>().sqrt();
        let nearest = target.points().iter().map(off).fold(f64::MAX, f64::min);
        assert!(off(&m.target) < nearest + 1e-3, "{} {nearest}", off(&m.target));
    }
}
