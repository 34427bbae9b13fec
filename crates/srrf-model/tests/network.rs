//! The whole network and the integration of its two poses.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use burn::tensor::{Device, Tensor};
use common::{Numbers, difference, ratios, row_major, tensor, tiny, values};
use nalgebra::{Matrix3, Vector3};
use srrf_cloud::Rigid;
use srrf_model::{
    BranchRatios, CommonRatios, Fusion, IntegrationRule, McNemar, PosedMatches, SrrfOutput, init,
};

const BATCH: usize = 3;
const POINTS: usize = 61;

fn forward(source: &Tensor<3>, target: &Tensor<3>) -> SrrfOutput {
    let config = tiny();
    let model = init::seeded(config.init(&Device::flex()), 1);
    model.forward(&config.integration, source.clone(), target.clone(), 0.5).unwrap()
}

fn pair(seed: u64) -> (Tensor<3>, Tensor<3>) {
    let mut numbers = Numbers(seed);
    let mut cloud = || tensor(&numbers.many(BATCH * POINTS * 3), [BATCH, POINTS, 3], &Device::flex());
    (cloud(), cloud())
}

fn shuffled(x: &Tensor<3>, seed: u64) -> Tensor<3> {
    let order = Numbers(seed).permutation(x.dims()[1]);
    Tensor::cat(order.iter().map(|&i| x.clone().narrow(1, i, 1)).collect(), 1)
}

/// Every pose of an output, rotations then translations: dense, skeleton, fused.
fn poses(output: &SrrfOutput) -> [(Vec<f64>, Vec<f64>); 3] {
    [
        (values(&output.dense.rotation), values(&output.dense.translation)),
        (values(&output.skeleton.rotation), values(&output.skeleton.translation)),
        (values(&output.fused.rotation), values(&output.fused.translation)),
    ]
}

fn assert_proper(rotations: &[f64]) {
    for r in rotations.chunks_exact(9).map(Matrix3::from_row_slice) {
        assert!((r.determinant() - 1.0).abs() < 1e-5, "{r}");
        assert!((r.transpose() * r - Matrix3::identity()).abs().max() < 1e-5, "{r}");
    }
}

#[test]
fn output_holds_every_stage() {
    let (x, y) = pair(2);
    let output = forward(&x, &y);
    for skeleton in [&output.source_skeleton, &output.target_skeleton] {
        assert_eq!(skeleton.points.dims(), [BATCH, 19, 3]);
        assert_eq!(skeleton.radii.dims(), [BATCH, 19]);
    }
    assert_eq!(output.dense.matches.dims(), [BATCH, 29, 3]);
    assert_eq!(output.skeleton.probabilities.dims(), [BATCH, 19, 19]);
    for (rotation, translation) in poses(&output) {
        assert_eq!((rotation.len(), translation.len()), (BATCH * 9, BATCH * 3));
        assert_proper(&rotation);
    }
    let fused = &output.fused;
    assert_eq!(fused.lambda.len(), BATCH);
    for i in 0..BATCH {
        let (c, s) = (fused.dense_inlier_ratio[i], fused.skeleton_inlier_ratio[i]);
        assert!((0.0..=1.0).contains(&c) && (0.0..=1.0).contains(&s));
        let wanted = if c + s > 0.0 { c / (c + s) } else { 0.5 };
        assert!((fused.lambda[i] - wanted).abs() < 1e-12);
    }
}

#[test]
fn poses_do_not_depend_on_the_order_of_the_points() {
    let (x, y) = pair(3);
    let plain = forward(&x, &y);
    for (x, y) in [(shuffled(&x, 4), y.clone()), (x.clone(), shuffled(&y, 5))] {
        let other = forward(&x, &y);
        for ((r, t), (other_r, other_t)) in poses(&plain).iter().zip(&poses(&other)) {
            assert!(difference(r, other_r) < 1e-3 && difference(t, other_t) < 1e-3);
        }
        assert_eq!(plain.fused.lambda, other.fused.lambda);
    }
    let (other, _) = pair(6);
    let other = forward(&other, &y);
    assert!(difference(&poses(&plain)[0].0, &poses(&other)[0].0) > 0.05, "other points, another pose");
}

#[test]
fn pairs_of_a_batch_do_not_touch() {
    let (x, y) = pair(7);
    let whole = poses(&forward(&x, &y));
    for i in 0..BATCH {
        let alone = poses(&forward(&x.clone().narrow(0, i, 1), &y.clone().narrow(0, i, 1)));
        for ((r, t), (r1, t1)) in whole.iter().zip(&alone) {
            assert!(difference(&r[i * 9..][..9], r1) < 1e-4 && difference(&t[i * 3..][..3], t1) < 1e-4);
        }
    }
}

/// One branch, given as correspondences and the pose that it claims.
struct Claim {
    pose: Rigid,
    points: Vec<f64>,
    matches: Vec<f64>,
}

/// `inliers` of `n` correspondences agree with `pose`, the others are off by 1.
fn claim(pose: Rigid, inliers: usize, n: usize, numbers: &mut Numbers) -> Claim {
    let points = numbers.many(n * 3);
    let matches = points.chunks_exact(3).enumerate().flat_map(|(i, p)| {
        let image = pose.apply(&[p[0], p[1], p[2]]);
        if i < inliers { image } else { [image[0] + 1.0, image[1], image[2]] }
    });
    Claim { pose, matches: matches.collect(), points }
}

fn fuse(config: &IntegrationRule, dense: &Claim, skeleton: &Claim, source: &[f64], target: &[f64]) -> Fusion {
    let device = Device::flex();
    let tensors = |claim: &Claim| {
        let n = claim.points.len() / 3;
        (
            tensor::<3>(&row_major(&claim.pose.rotation), [1, 3, 3], &device),
            tensor::<2>(claim.pose.translation.as_slice(), [1, 3], &device),
            tensor::<3>(&claim.points, [1, n, 3], &device),
            tensor::<3>(&claim.matches, [1, n, 3], &device),
        )
    };
    let (dense, skeleton) = (tensors(dense), tensors(skeleton));
    let cloud = |points: &[f64]| tensor::<3>(points, [1, points.len() / 3, 3], &device);
    config
        .fuse(
            PosedMatches { rotation: &dense.0, translation: &dense.1, points: &dense.2, matches: &dense.3 },
            PosedMatches {
                rotation: &skeleton.0,
                translation: &skeleton.1,
                points: &skeleton.2,
                matches: &skeleton.3,
            },
            &cloud(source),
            &cloud(target),
        )
        .unwrap()
}

fn fused_pose(fusion: &Fusion) -> Rigid {
    Rigid {
        rotation: Matrix3::from_row_slice(&values(&fusion.rotation)),
        translation: Vector3::from_column_slice(&values(&fusion.translation)),
    }
}

fn drawn(degrees: f64, numbers: &mut Numbers) -> Rigid {
    Rigid { rotation: numbers.rotation(degrees), translation: Vector3::from_vec(numbers.many(3)) }
}

#[test]
fn lambda_weighs_the_inlier_ratios() {
    let mut numbers = Numbers(8);
    let paper = IntegrationRule::SoftMatch(ratios(0.05, 0.1));
    let sharper = BranchRatios { sharpness: 2.0, ..ratios(0.05, 0.1) };
    let sharp = IntegrationRule::SoftMatch(sharper.clone());
    let handicapped = IntegrationRule::SoftMatch(BranchRatios { skeleton_weight: 0.5, ..sharper });
    let cloud = numbers.many(21);
    // Inliers of 5 dense and of 7 skeleton correspondences, and lambda at sharpness 1 and 2.
    for (dense, skeleton, lambda, lambda_sharp) in [
        (5, 7, 0.5, 0.5),
        (3, 0, 1.0, 1.0),
        (0, 1, 0.0, 0.0),
        (0, 0, 0.5, 0.5),
        (5, 3, 0.7, 49.0 / 58.0), // 1 / (1 + 3/7)
    ] {
        let (a, b) = (drawn(45.0, &mut numbers), drawn(45.0, &mut numbers));
        let (c, s) = (claim(a, dense, 5, &mut numbers), claim(b, skeleton, 7, &mut numbers));
        let fusion = fuse(&paper, &c, &s, &cloud, &cloud);
        assert_eq!(fusion.dense_inlier_ratio, [dense as f64 / 5.0]);
        assert_eq!(fusion.skeleton_inlier_ratio, [skeleton as f64 / 7.0]);
        assert!((fusion.lambda[0] - lambda).abs() < 1e-12);
        assert!((fuse(&sharp, &c, &s, &cloud, &cloud).lambda[0] - lambda_sharp).abs() < 1e-12);
        // Half the skeleton's ratio counts: a quarter, squared. Where neither has inliers, both count alike.
        let odds = 0.25 * (1.0 - lambda_sharp) / lambda_sharp;
        let wanted = if dense + skeleton > 0 { 1.0 / (1.0 + odds) } else { 0.5 };
        assert!((fuse(&handicapped, &c, &s, &cloud, &cloud).lambda[0] - wanted).abs() < 1e-12);

        let pose = fused_pose(&fusion);
        let blend = lambda * a.translation + (1.0 - lambda) * b.translation;
        assert!((pose.translation - blend).abs().max() < 1e-6);
        // On the arc between both rotations, no nearer to one than its weight allows.
        assert_proper(&values(&fusion.rotation));
        let (to_a, to_b, whole) = (pose.angle_to_deg(&a), pose.angle_to_deg(&b), a.angle_to_deg(&b));
        assert!((to_a + to_b - whole).abs() < 1e-3, "{to_a} + {to_b} is not {whole}");
        if lambda == 0.5 {
            assert!((to_a - to_b).abs() < 1e-3);
        } else {
            assert_eq!(to_a < to_b, lambda > 0.5);
        }
    }
}

#[test]
fn common_correspondences_judge_both_poses() {
    let mut numbers = Numbers(11);
    let config =
        IntegrationRule::Common(CommonRatios { threshold: 0.05, sharpness: 1.0, skeleton_weight: 1.0 });
    let ahead = |standard_errors| IntegrationRule::McNemar(McNemar { threshold: 0.05, standard_errors });
    let three = ahead(3.0);
    let cloud = numbers.many(21);
    let (a, b) = (drawn(45.0, &mut numbers), drawn(45.0, &mut numbers));
    // The skeleton branch's pose explains 9 or 10 of the 12 matches, the dense branch's own pose one of the others.
    for (explained, lambda) in [(9, 1.0), (10, 0.0)] {
        let mut dense = claim(b, explained, 12, &mut numbers);
        dense.pose = a;
        let last = [dense.points[33], dense.points[34], dense.points[35]];
        dense.matches[33..].copy_from_slice(&a.apply(&last));
        let skeleton = claim(b, 7, 7, &mut numbers); // its own matches play no part
        let fusion = fuse(&config, &dense, &skeleton, &cloud, &cloud);
        assert_eq!(fusion.dense_inlier_ratio, [1.0 / 12.0]);
        assert_eq!(fusion.skeleton_inlier_ratio, [explained as f64 / 12.0]);
        assert!((fusion.lambda[0] - 1.0 / (1.0 + explained as f64)).abs() < 1e-12);
        // (9 - 1) / sqrt(10) is 2.53 and (10 - 1) / sqrt(11) is 2.71: below 3, and on two sides of 2.6.
        assert_eq!(fuse(&three, &dense, &skeleton, &cloud, &cloud).lambda, [1.0]);
        let between = ahead(2.6);
        assert_eq!(fuse(&between, &dense, &skeleton, &cloud, &cloud).lambda, [lambda]);
    }
}

#[test]
fn poses_that_agree_are_kept_and_opposite_ones_stay_rotations() {
    let mut numbers = Numbers(9);
    let config = tiny().integration;
    let cloud = numbers.many(33);
    for _ in 0..7 {
        let pose = drawn(180.0, &mut numbers);
        let (c, s) = (claim(pose, 5, 5, &mut numbers), claim(pose, 0, 7, &mut numbers));
        let fused = fused_pose(&fuse(&config, &c, &s, &cloud, &cloud));
        assert!(fused.angle_to_deg(&pose) < 1e-4);
        assert!((fused.translation - pose.translation).abs().max() < 1e-6);

        // Half a turn apart with equal weights: the blend has rank 1.
        let half_turn = Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0));
        let opposite = Rigid { rotation: pose.rotation * half_turn, ..pose };
        let s = claim(opposite, 0, 7, &mut numbers);
        let paper = IntegrationRule::SoftMatch(ratios(0.05, 0.1));
        let fusion = fuse(&paper, &claim(pose, 0, 5, &mut numbers), &s, &cloud, &cloud);
        assert_eq!(fusion.lambda, [0.5]);
        assert_proper(&values(&fusion.rotation));
    }
}

#[test]
fn nearest_test_counts_points_of_the_whole_cloud() {
    let mut numbers = Numbers(10);
    let config = IntegrationRule::Nearest(ratios(0.05, 0.2));
    let mut source = numbers.many(33);
    for (i, p) in source.chunks_exact_mut(3).enumerate() {
        p[0] = i as f64; // no two points closer than 1
    }
    let pose = drawn(45.0, &mut numbers);
    let mut target: Vec<f64> = source.chunks_exact(3).flat_map(|p| pose.apply(&[p[0], p[1], p[2]])).collect();
    // 4 of 11 points of the target are moved by 0.1: beyond the dense threshold, within the other;
    // 2 of these by 10.
    for i in 0..4 {
        target[i * 3 + 1] += if i < 2 { 10.0 } else { 0.1 };
    }
    let (c, s) = (claim(pose, 0, 5, &mut numbers), claim(pose, 0, 7, &mut numbers));
    let fusion = fuse(&config, &c, &s, &source, &target);
    assert_eq!(fusion.dense_inlier_ratio, [7.0 / 11.0]);
    assert_eq!(fusion.skeleton_inlier_ratio, [9.0 / 11.0]);

    // Neither pose fits anything.
    let away = Rigid { translation: Vector3::repeat(100.0), ..pose };
    let (c, s) = (claim(away, 5, 5, &mut numbers), claim(away, 7, 7, &mut numbers));
    let fusion = fuse(&config, &c, &s, &source, &target);
    assert_eq!((fusion.dense_inlier_ratio, fusion.lambda), (vec![0.0], vec![0.5]));
}
