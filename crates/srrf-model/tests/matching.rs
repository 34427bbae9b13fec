//! Soft matching beyond the paper: normalised scores, and slack by Sinkhorn.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{DType, Device, Tensor};
use common::{Numbers, difference, tensor, tensor64, values};
use srrf_cloud::{PairFrame, PointCloud};
use srrf_model::{Matches, MatchingConfig, PositionPrior, SoftMatching, init, network_frame, sinkhorn};

const CLOUDS: usize = 3;
const SOURCES: usize = 5;
const TARGETS: usize = 7;
const WIDTH: usize = 11;
const BOTH: MatchingConfig = MatchingConfig { normalise: true, sinkhorn: 4 };

fn matching(config: &MatchingConfig) -> SoftMatching {
    init::seeded(config.init(&Device::flex()), 1)
}

fn features(seed: u64, points: usize) -> Vec<f64> {
    Numbers(seed).many(CLOUDS * points * WIDTH)
}

fn targets() -> Vec<f64> {
    Numbers(3).many(CLOUDS * TARGETS * 3)
}

/// Parameters as `f64`.
struct Double;

impl ModuleMapper for Double {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (id, tensor, mapper) = param.consume();
        Param::from_mapped_value(id, tensor.cast(DType::F64), mapper)
    }
}

#[test]
fn sinkhorn_agrees_with_the_form_in_logarithms() {
    let (n, m) = (SOURCES, TARGETS);
    let scores: Vec<f64> = Numbers(4).many(n * m).iter().map(|v| 4.0 * v).collect();
    let found = values(&sinkhorn(tensor64(&scores, [1, n, m], &Device::flex()), 20).matrix());
    let mut log = vec![vec![0.0; m + 1]; n + 1];
    (0..n * m).for_each(|i| log[i / m][i % m] = scores[i]);
    for _ in 0..20 {
        for row in log.iter_mut().take(n) {
            let sum = row.iter().map(|v: &f64| v.exp()).sum::<f64>().ln();
            row.iter_mut().for_each(|v| *v -= sum);
        }
        for j in 0..m {
            let sum = log.iter().map(|row| row[j].exp()).sum::<f64>().ln();
            log.iter_mut().for_each(|row| row[j] -= sum);
        }
    }
    let wanted: Vec<f64> = (0..n * m).map(|i| log[i / m][i % m].exp()).collect();
    assert!(difference(&found, &wanted) < 1e-12);
    let sums = |i: usize| found[i * m..(i + 1) * m].iter().sum::<f64>();
    assert!((0..n).all(|i| sums(i) < 1.01) && (0..n).any(|i| sums(i) > 0.5));
}

#[test]
fn normalised_scores_do_not_know_how_long_features_are() {
    let found = |scale: f64| {
        let scaled = |seed: u64, n: usize| -> Tensor<3> {
            tensor(&features(seed, n), [CLOUDS, n, WIDTH], &Device::flex()) * scale
        };
        let config = MatchingConfig { normalise: true, ..MatchingConfig::default() };
        let y = tensor(&targets(), [CLOUDS, TARGETS, 3], &Device::flex());
        let found = matching(&config).forward(scaled(1, SOURCES), scaled(2, TARGETS), y, None);
        assert!(found.matched.is_none());
        values(&found.points)
    };
    // The variance is kept above 1e-6, which is 1e-4 of that of the shorter features.
    assert!(difference(&found(1.0), &found(30.0)) < 1e-3);
}

#[test]
fn slack_takes_what_has_no_match() {
    // Source i looks like target i, but for the last one, which looks like nothing.
    let (n, m) = (SOURCES, TARGETS);
    let one_hot = |row: usize, column: usize| f64::from(row == column && row + 1 < n);
    let x: Vec<f64> = (0..CLOUDS * n * WIDTH).map(|i| one_hot(i / WIDTH % n, i % WIDTH)).collect();
    let y: Vec<f64> = (0..CLOUDS * m * WIDTH).map(|i| one_hot(i / WIDTH % m, i % WIDTH)).collect();
    let found = matching(&BOTH).forward(
        tensor(&x, [CLOUDS, n, WIDTH], &Device::flex()),
        tensor(&y, [CLOUDS, m, WIDTH], &Device::flex()),
        tensor(&targets(), [CLOUDS, m, 3], &Device::flex()),
        None,
    );
    let matched = found.matched.as_ref().map(values).unwrap_or_default();
    for of_cloud in matched.chunks_exact(n) {
        let (last, others) = of_cloud.split_last().unwrap();
        assert!(*last < 0.1 && others.iter().all(|p| *p > 0.5 && *p < 1.0), "{of_cloud:?}");
    }
    for (i, row) in values(&found.probabilities).chunks_exact(m).enumerate() {
        assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-5);
        assert!(i % n + 1 == n || row[i % n] > 0.7);
    }
    let expected = found.probabilities.matmul(tensor(&targets(), [CLOUDS, m, 3], &Device::flex()));
    assert!(difference(&values(&expected), &values(&found.points)) < 1e-6);
}

#[test]
fn gradients_are_those_of_finite_differences() {
    let device = Device::flex().autodiff();
    let (x, y) = (features(1, SOURCES), features(2, TARGETS));
    let weights = Numbers(5).many(CLOUDS * SOURCES * 4);
    let loss = |x: Tensor<3>| {
        let device = x.device();
        let config = BOTH.init(&device).map(&mut Double);
        let y = tensor64(&y, [CLOUDS, TARGETS, WIDTH], &device);
        let points = tensor64(&targets(), [CLOUDS, TARGETS, 3], &device);
        let found = config.forward(x, y, points, None);
        let both = Tensor::cat(found.matched.into_iter().chain([found.points]).collect(), 2);
        (both * tensor64(&weights, [CLOUDS, SOURCES, 4], &device)).sum()
    };
    let at = |x: &[f64], device: &Device| tensor64(x, [CLOUDS, SOURCES, WIDTH], device);
    let input = at(&x, &device).require_grad();
    let gradient = values(&input.grad(&loss(input.clone()).backward()).unwrap());
    assert!(gradient.iter().any(|g| g.abs() > 1e-2));
    for i in (0..x.len()).step_by(7) {
        let moved = |by: f64| {
            let mut x = x.clone();
            x[i] += by;
            values(&loss(at(&x, &Device::flex())))[0]
        };
        let wanted = (moved(1e-5) - moved(-1e-5)) / 2e-5;
        assert!((gradient[i] - wanted).abs() < 1e-6, "{i}: {} {wanted}", gradient[i]);
    }
}

#[test]
fn the_best_match_is_the_target_point_with_the_greatest_probability() {
    let device = Device::flex();
    for config in [MatchingConfig::default(), BOTH] {
        let run = |matches| {
            matching(&config).with_matches(matches).forward(
                tensor(&features(1, SOURCES), [CLOUDS, SOURCES, WIDTH], &device),
                tensor(&features(2, TARGETS), [CLOUDS, TARGETS, WIDTH], &device),
                tensor(&targets(), [CLOUDS, TARGETS, 3], &device),
                None,
            )
        };
        let (mean, best) = (run(Matches::Mean), run(Matches::Best));
        let probabilities = values(&mean.probabilities);
        assert_eq!(probabilities, values(&best.probabilities), "only the points differ");
        assert_eq!(mean.matched.map(|m| values(&m)), best.matched.map(|m| values(&m)));
        let points = values(&best.points);
        for (i, row) in probabilities.chunks(TARGETS).enumerate() {
            let chosen = (0..TARGETS).fold(0, |best, j| if row[j] > row[best] { j } else { best });
            let at = (i / SOURCES * TARGETS + chosen) * 3;
            let wanted: Vec<f64> = targets()[at..at + 3].iter().map(|v| f64::from(*v as f32)).collect();
            assert_eq!(points[3 * i..3 * i + 3], wanted, "point {i}");
        }
        assert!(difference(&points, &values(&mean.points)) > 0.01);
    }
}

#[test]
fn a_prior_weighs_the_probabilities() {
    let device = Device::flex();
    let log_prior: Vec<f64> = Numbers(6).many(CLOUDS * SOURCES * TARGETS);
    let run = |log_prior| {
        SoftMatching::new(&device).forward(
            tensor(&features(1, SOURCES), [CLOUDS, SOURCES, WIDTH], &device),
            tensor(&features(2, TARGETS), [CLOUDS, TARGETS, WIDTH], &device),
            tensor(&targets(), [CLOUDS, TARGETS, 3], &device),
            log_prior,
        )
    };
    let without = values(&run(None).probabilities);
    let with = values(&run(Some(tensor(&log_prior, [CLOUDS, SOURCES, TARGETS], &device))).probabilities);
    let rows = without.chunks_exact(TARGETS).zip(log_prior.chunks_exact(TARGETS));
    let wanted: Vec<f64> = rows
        .flat_map(|(row, prior)| {
            let weighed: Vec<f64> = row.iter().zip(prior).map(|(p, prior)| p * prior.exp()).collect();
            let sum: f64 = weighed.iter().sum();
            weighed.into_iter().map(move |p| p / sum)
        })
        .collect();
    assert!(difference(&with, &wanted) < 1e-6 && difference(&with, &without) > 0.01);
}

#[test]
fn the_position_prior_is_about_placed_points_not_centred_ones() {
    // Two pairs, far from the origin; the target of each lacks a part of the source, so their means differ.
    let (size, deviation) = (2.5, 0.2);
    let far = |seed: u64, n: usize| -> Vec<[f64; 3]> {
        let numbers = Numbers(seed).many(n * 3);
        numbers.chunks_exact(3).map(|p| [0, 1, 2].map(|c| size * p[c] + 1e3)).collect()
    };
    let sources = [far(7, SOURCES), far(8, SOURCES)];
    let targets = sources.clone().map(|cloud| cloud[1..].to_vec());
    let pairs: Vec<(PointCloud, PointCloud)> = sources
        .iter()
        .zip(&targets)
        .map(|(x, y)| (PointCloud::new(x.clone()).unwrap(), PointCloud::new(y.clone()).unwrap()))
        .collect();
    let frames: Vec<PairFrame> = pairs.iter().map(|(x, y)| network_frame(x, y)).collect();
    let network = |clouds: &[Vec<[f64; 3]>; 2], to: fn(&PairFrame, &[f64; 3]) -> [f64; 3]| -> Tensor<3> {
        let points = clouds.iter().zip(&frames).flat_map(|(c, frame)| c.iter().map(move |p| to(frame, p)));
        let points: Vec<f64> = points.flatten().collect();
        tensor64(&points, [2, points.len() / 6, 3], &Device::flex())
    };
    let (x, y) = (network(&sources, PairFrame::source), network(&targets, PairFrame::target));
    let found = values(&PositionPrior::new(deviation, &frames).log_density(x, y));
    let mut wanted = Vec::new();
    for ((x, y), frame) in sources.iter().zip(&targets).zip(&frames) {
        let unit = frame.undo_length(1.0);
        for a in x {
            for b in y {
                let square: f64 = (0..3).map(|c| ((a[c] - b[c]) / unit).powi(2)).sum();
                wanted.push(-square / (2.0 * deviation * deviation));
            }
        }
    }
    assert!(difference(&found, &wanted) < 1e-6 * wanted.iter().fold(0.0, |most: f64, v| most.max(v.abs())));
}
