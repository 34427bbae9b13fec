//! Shapes and properties of the network's parts, at sizes that are pairwise distinct and odd, so
//! that a swapped axis cannot pass.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use burn::tensor::{Device, Tensor};
use common::{Numbers, difference, tensor, tiny, values};
use srrf_model::{
    BranchConfig, Pfi, Sem, Sfe, SkeletonBatch, SkeletonLoss, SkeletonLossConfig, SoftMatching, init,
    nearest_distance, skeleton_loss, spread,
};

const CLOUDS: usize = 3;
const POINTS: usize = 61;

fn clouds(seed: u64, clouds: usize, points: usize) -> Tensor<3> {
    tensor(&Numbers(seed).many(clouds * points * 3), [clouds, points, 3], &Device::flex())
}

/// `x[:, order, :]`.
fn reordered(x: &Tensor<3>, order: &[usize]) -> Tensor<3> {
    Tensor::cat(order.iter().map(|&i| x.clone().narrow(1, i, 1)).collect(), 1)
}

/// Largest difference of two tensors.
fn apart<const D: usize>(a: &Tensor<D>, b: &Tensor<D>) -> f64 {
    assert_eq!(a.dims(), b.dims());
    difference(&values(a), &values(b))
}

fn sem() -> Sem {
    init::seeded(tiny().sem.init(&Device::flex()), 3)
}

/// `W^T v` in `f64`, for weights `[samples, skeleton_points]` and rows `[samples, channels]`.
fn combined(weights: &[f64], rows: &[f64], skeleton_points: usize, channels: usize) -> Vec<f64> {
    let mut out = vec![0.0; skeleton_points * channels];
    for (w, row) in weights.chunks_exact(skeleton_points).zip(rows.chunks_exact(channels)) {
        for (j, w) in w.iter().enumerate() {
            for (c, v) in row.iter().enumerate() {
                out[j * channels + c] += w * v;
            }
        }
    }
    out
}

#[test]
fn skeletons_are_convex_combinations_of_sampled_points() {
    let x = clouds(1, CLOUDS, POINTS);
    let SkeletonBatch { points, radii, weights, samples } = sem().forward(x.clone()).unwrap();
    assert_eq!(samples.dims(), [CLOUDS, 23, 3]);
    assert_eq!(weights.dims(), [CLOUDS, 23, 19]);
    assert_eq!(points.dims(), [CLOUDS, 19, 3]);
    assert_eq!(radii.dims(), [CLOUDS, 19]);
    // Samples are points of the cloud; distances are floored at 1e-6.
    assert!(values(&nearest_distance(samples.clone(), x).unwrap()).iter().all(|&d| d <= 1.1e-6));

    let mut numbers = Numbers(2);
    for i in 0..CLOUDS {
        let of = |t: &Tensor<3>| values(&t.clone().narrow(0, i, 1));
        let (w, x, s) = (of(&weights), of(&samples), of(&points));
        assert!(w.iter().all(|&w| w >= 0.0));
        let sums = combined(&w, &[1.0; 23], 19, 1);
        assert!(difference(&sums, &[1.0; 19]) < 1e-5, "columns of W sum to 1: {sums:?}");
        assert!(difference(&combined(&w, &x, 19, 3), &s) < 1e-5, "S = W^T X*");

        // Inside the convex hull: no direction in which a skeleton point lies beyond all samples.
        for _ in 0..101 {
            let u = numbers.many(3);
            let furthest = |points: &[f64]| {
                let along = points.chunks_exact(3).map(|p| (0..3).map(|c| p[c] * u[c]).sum::<f64>());
                along.fold(f64::NEG_INFINITY, f64::max)
            };
            assert!(furthest(&s) <= furthest(&x) + 1e-6);
        }

        // R = W^T D with D the distance of each sample to its nearest skeleton point.
        let distance = |a: &[f64], b: &[f64]| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt();
        let nearest: Vec<f64> = x
            .chunks_exact(3)
            .map(|p| s.chunks_exact(3).map(|q| distance(p, q)).fold(f64::INFINITY, f64::min))
            .collect();
        let r = values(&radii.clone().narrow(0, i, 1));
        assert!(difference(&combined(&w, &nearest, 19, 1), &r) < 1e-5, "R = W^T D");
        assert!(r.iter().all(|&r| r >= 0.0));
    }
}

#[test]
fn skeletons_do_not_depend_on_the_order_of_the_points_nor_on_the_batch() {
    let (sem, x) = (sem(), clouds(4, CLOUDS, POINTS));
    let whole = sem.forward(x.clone()).unwrap();
    let shuffled = sem.forward(reordered(&x, &Numbers(5).permutation(POINTS))).unwrap();
    assert!(apart(&whole.points, &shuffled.points) < 1e-5);
    assert!(apart(&whole.radii, &shuffled.radii) < 1e-5);
    assert!(apart(&whole.samples, &shuffled.samples) == 0.0, "farthest points come in their own order");
    for i in 0..CLOUDS {
        let alone = sem.forward(x.clone().narrow(0, i, 1)).unwrap();
        assert!(apart(&whole.points.clone().narrow(0, i, 1), &alone.points) < 1e-6);
    }
    let other = sem.forward(clouds(6, CLOUDS, POINTS)).unwrap();
    assert!(apart(&whole.points, &other.points) > 0.05, "another cloud, another skeleton");
}

#[test]
fn skeletons_of_small_and_of_degenerate_clouds_are_finite() {
    // Fewer points than are sampled (11 of 23) and than are grouped (5 of 7), and all in one place.
    for (x, samples) in [
        (clouds(7, 2, 11), 11),
        (clouds(8, 2, 5), 5),
        (clouds(9, 2, 1), 1),
        (clouds(10, 2, POINTS) * 0.0, 23),
    ] {
        let skeleton = sem().forward(x).unwrap();
        assert_eq!(skeleton.weights.dims(), [2, samples, 19]);
        for found in [values(&skeleton.points), values(&skeleton.radii), values(&skeleton.weights)] {
            assert!(found.iter().all(|v| v.is_finite()));
        }
    }
}

#[test]
fn nearest_distances_and_spread_are_what_they_say() {
    let (a, b) = (clouds(11, 2, 7), clouds(12, 2, 13));
    let found = values(&nearest_distance(a.clone(), b.clone()).unwrap());
    let (a, b) = (values(&a), values(&b));
    for cloud in 0..2 {
        for i in 0..7 {
            let p = &a[(cloud * 7 + i) * 3..][..3];
            let to = |q: &[f64]| (0..3).map(|c| (p[c] - q[c]).powi(2)).sum::<f64>().sqrt();
            let least = b[cloud * 39..][..39].chunks_exact(3).map(to).fold(f64::INFINITY, f64::min);
            assert!((found[cloud * 7 + i] - least).abs() < 1e-6);
        }
    }
    // A cube with corners at +-1, anywhere: each corner is sqrt(3) from the mean.
    let cube: Vec<f64> =
        (0..24).map(|i| 5.0 + if (i / 3) >> (i % 3) & 1 == 0 { 1.0 } else { -1.0 }).collect();
    assert!((values(&spread(tensor(&cube, [1, 8, 3], &Device::flex())))[0] - 3.0_f64.sqrt()).abs() < 1e-6);
}

/// Shrinking both skeletons lowers the distribution distance and leaves it over the spread as it is; a target that shrinks
/// alone raises the latter.
#[test]
fn distribution_distance_over_the_spread_does_not_reward_shrinking() {
    let device = Device::flex();
    let config = SkeletonLossConfig {
        point_to_sphere: 0.0,
        radius: 0.0,
        distribution: 0.0,
        distribution_over_spread: 0.7,
        index_match: 0.0,
    };
    let skeleton = |seed: u64, factor: f64| SkeletonBatch {
        points: clouds(seed, 1, 19) * factor,
        radii: Tensor::zeros([1, 19], &device),
        weights: Tensor::zeros([1, 1, 19], &device),
        samples: Tensor::zeros([1, 1, 3], &device),
    };
    let rotation = tensor(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], [1, 3, 3], &device);
    let at = |source: f64, target: f64| {
        let cloud = clouds(5, 1, 40);
        let (x, y) = (skeleton(3, source), skeleton(4, target));
        let still = Tensor::zeros([1, 3], &device);
        skeleton_loss(&config, (cloud.clone(), &x), (cloud, &y), rotation.clone(), still).unwrap()
    };
    let number = |x: &Tensor<1>| values(x)[0];
    let (whole, half, lone) = (at(1.0, 1.0), at(0.5, 0.5), at(1.0, 0.5));
    assert!((number(&half.distribution) / number(&whole.distribution) - 0.5).abs() < 1e-4);
    let over = |loss: &SkeletonLoss| number(&loss.distribution_over_spread);
    assert!((over(&half) / over(&whole) - 1.0).abs() < 1e-4);
    assert!(over(&lone) > over(&whole));
    for loss in [&whole, &half] {
        let rest = number(&loss.total) - number(&loss.sampling);
        assert!((rest - 0.7 * over(loss)).abs() < 1e-5);
    }
}

fn sfe() -> Sfe {
    init::seeded(tiny().dense.sfe.init(&Device::flex()), 13)
}

#[test]
fn structural_features_follow_the_order_of_the_tokens_and_not_that_of_the_cloud() {
    let (sfe, cloud) = (sfe(), clouds(14, CLOUDS, POINTS));
    let tokens = cloud.clone().narrow(1, 0, 29);
    let features = sfe.forward(tokens.clone(), cloud.clone()).unwrap();
    assert_eq!(features.dims(), [CLOUDS, 29, 18]);

    let order = Numbers(15).permutation(29);
    let permuted = sfe.forward(reordered(&tokens, &order), cloud.clone()).unwrap();
    assert!(apart(&permuted, &reordered(&features, &order)) < 1e-4);
    let shuffled = sfe.forward(tokens.clone(), reordered(&cloud, &Numbers(16).permutation(POINTS))).unwrap();
    assert!(apart(&features, &shuffled) < 1e-4);
    let alone = sfe.forward(tokens.narrow(0, 1, 1), cloud.narrow(0, 1, 1)).unwrap();
    assert!(apart(&features.clone().narrow(0, 1, 1), &alone) < 1e-5);

    // The last step is a LayerNorm, at its initial scale and shift.
    for feature in values(&features).chunks_exact(18) {
        let mean = feature.iter().sum::<f64>() / 18.0;
        let variance = feature.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 18.0;
        assert!(mean.abs() < 1e-5 && (variance - 1.0).abs() < 1e-2, "{mean} {variance}");
    }
}

#[test]
fn structural_features_see_the_neighbours() {
    // Moving a point that is no token changes the features of the tokens near it, so the first LFI
    // looks at the whole cloud; the other cloud of the batch stays as it is.
    let (sfe, cloud) = (sfe(), clouds(17, 2, POINTS));
    let tokens = cloud.clone().narrow(1, 0, 29);
    let before = sfe.forward(tokens.clone(), cloud.clone()).unwrap();
    let place = tokens.clone().slice([0..1, 3..4]) + 0.001;
    let changed = cloud.clone().slice_assign([0..1, 50..51, 0..3], place);
    let after = sfe.forward(tokens, changed).unwrap();
    assert!(apart(&before.clone().narrow(0, 0, 1), &after.clone().narrow(0, 0, 1)) > 1e-2);
    assert!(apart(&before.narrow(0, 1, 1), &after.narrow(0, 1, 1)) < 1e-6);
}

fn pfi() -> Pfi {
    init::seeded(tiny().skeleton.pfi.init(45, &Device::flex()), 18)
}

fn features(seed: u64, clouds: usize, n: usize, width: usize) -> Tensor<3> {
    tensor(&Numbers(seed).many(clouds * n * width), [clouds, n, width], &Device::flex())
}

/// Sources and targets change places.
fn swapped(x: &Tensor<3>) -> Tensor<3> {
    let half = x.dims()[0] / 2;
    Tensor::cat(vec![x.clone().narrow(0, half, half), x.clone().narrow(0, 0, half)], 0)
}

#[test]
fn interaction_treats_source_and_target_alike() {
    let (pfi, f, x) = (pfi(), features(19, 6, 19, 45), clouds(20, 6, 19));
    let phi = pfi.forward(f.clone(), x.clone());
    assert_eq!(phi.dims(), [6, 19, 45]);
    assert!(apart(&pfi.forward(swapped(&f), swapped(&x)), &swapped(&phi)) < 1e-5);

    // Reordered points: their features follow, the other cloud's do not care.
    let order = Numbers(21).permutation(19);
    let reordered_source = |t: &Tensor<3>| {
        Tensor::cat(vec![reordered(&t.clone().narrow(0, 0, 3), &order), t.clone().narrow(0, 3, 3)], 0)
    };
    let permuted = pfi.forward(reordered_source(&f), reordered_source(&x));
    assert!(apart(&permuted, &reordered_source(&phi)) < 1e-5);
}

#[test]
fn interaction_reaches_the_partner_and_no_other_pair() {
    let (pfi, f, x) = (pfi(), features(22, 6, 19, 45), clouds(23, 6, 19));
    let before = pfi.forward(f.clone(), x.clone());
    // Target of pair 1 (cloud 4 of 6) changes.
    let after = pfi.forward(f.slice_assign([4..5, 0..19, 0..45], features(24, 1, 19, 45)), x);
    for cloud in 0..6 {
        let moved = apart(&before.clone().narrow(0, cloud, 1), &after.clone().narrow(0, cloud, 1));
        assert_eq!(moved > 1e-3, cloud == 1 || cloud == 4, "cloud {cloud}: {moved}");
    }
}

#[test]
fn matches_are_expectations_over_the_target() {
    let (n, m, width) = (13, 17, 9);
    let matching = SoftMatching::new(&Device::flex());
    let y = clouds(25, CLOUDS, m);
    let found =
        matching.forward(features(26, CLOUDS, n, width), features(27, CLOUDS, m, width), y.clone(), None);
    assert_eq!(found.points.dims(), [CLOUDS, n, 3]);
    assert_eq!(found.probabilities.dims(), [CLOUDS, n, m]);
    let probabilities = values(&found.probabilities);
    for row in probabilities.chunks_exact(m) {
        assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-6 && row.iter().all(|&p| p > 0.0));
    }
    assert!(apart(&found.probabilities.clone().matmul(y.clone()), &found.points) < 1e-6);

    // Features that are all alike match everything with everything: the mean of the target.
    let ones = Tensor::ones([CLOUDS, n, width], &Device::flex());
    let even =
        matching.forward(ones.clone(), Tensor::ones([CLOUDS, m, width], &Device::flex()), y.clone(), None);
    assert!(apart(&even.points, &y.clone().mean_dim(1).expand([CLOUDS, n, 3])) < 1e-6);

    // Features that single a target point out match it.
    let one_hot = Tensor::<2>::eye(m, &Device::flex()).unsqueeze::<3>().repeat_dim(0, CLOUDS) * 30.0;
    let order = Numbers(28).permutation(m);
    let exact = matching.forward(reordered(&one_hot, &order), one_hot, y.clone(), None);
    assert!(apart(&exact.points, &reordered(&y, &order)) < 1e-5);
}

#[test]
fn branches_of_all_points_and_of_tokens() {
    let (x, y) = (clouds(29, CLOUDS, POINTS), clouds(30, CLOUDS, POINTS));
    let config = BranchConfig { tokens: 29, ..tiny().dense };
    let branch = init::seeded(config.init(&Device::flex()), 31);
    for (tokens, n) in [(29, 29), (0, POINTS), (POINTS, POINTS), (1001, POINTS)] {
        let found = branch.clone().with_tokens(tokens).forward(x.clone(), y.clone(), 0.5).unwrap();
        assert_eq!(found.rotation.dims(), [CLOUDS, 3, 3]);
        assert_eq!(found.translation.dims(), [CLOUDS, 3]);
        assert_eq!(found.probabilities.dims(), [CLOUDS, n, n]);
        for points in [&found.source_points, &found.target_points, &found.matches] {
            assert_eq!(points.dims(), [CLOUDS, n, 3]);
        }
        let distance = values(&nearest_distance(found.source_points, x.clone()).unwrap());
        assert!(distance.iter().all(|&d| d <= 1.1e-6), "tokens are points of the cloud");
    }
    // The phase chooses other tokens.
    let at = |phase| branch.forward(x.clone(), y.clone(), phase).unwrap().source_points;
    assert!(apart(&at(0.0), &at(0.9)) > 0.1);
}
