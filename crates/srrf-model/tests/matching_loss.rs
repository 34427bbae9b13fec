//! The matching loss against plain loops in `f64`.

mod common;

use burn::tensor::{Device, Tensor};
use common::{Numbers, tensor, values};
use srrf_model::matching_loss;

const BATCH: usize = 2;
const SOURCES: usize = 5;
const TARGETS: usize = 7;

struct Case {
    points: Vec<f64>,
    targets: Vec<f64>,
    scores: Vec<f64>,
    rotation: Vec<f64>,
    translation: Vec<f64>,
}

fn case() -> Case {
    let numbers = |seed: u64, count: usize| Numbers(seed).many(count);
    let (c, s) = (0.8, 0.6);
    let turn = [c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0];
    Case {
        points: numbers(1, BATCH * SOURCES * 3),
        targets: numbers(2, BATCH * TARGETS * 3),
        scores: numbers(3, BATCH * SOURCES * TARGETS),
        rotation: turn.repeat(BATCH),
        translation: numbers(4, BATCH * 3),
    }
}

fn softmax(scores: &[f64]) -> Vec<f64> {
    let most = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = scores.iter().map(|s| (s - most).exp()).sum();
    scores.iter().map(|s| (s - most).exp() / sum).collect()
}

fn squared(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

impl Case {
    /// For each source point of each pair: its label over the targets, and its weight.
    fn labels(&self) -> Vec<(Vec<f64>, f64)> {
        let mut found = Vec::new();
        for pair in 0..BATCH {
            let of = |all: &[f64], count: usize, i: usize| -> Vec<f64> {
                all[(pair * count + i) * 3..][..3].to_vec()
            };
            let targets: Vec<Vec<f64>> = (0..TARGETS).map(|j| of(&self.targets, TARGETS, j)).collect();
            let nearest = |j: usize| {
                let others = (0..TARGETS).filter(|&i| i != j);
                others.map(|i| squared(&targets[i], &targets[j])).fold(f64::INFINITY, f64::min).min(1.0)
            };
            let spacing = (0..TARGETS).map(nearest).sum::<f64>() / TARGETS as f64;
            for i in 0..SOURCES {
                let x = of(&self.points, SOURCES, i);
                let placed: Vec<f64> = (0..3)
                    .map(|r| {
                        let row = &self.rotation[pair * 9 + 3 * r..][..3];
                        row.iter().zip(&x).map(|(m, v)| m * v).sum::<f64>() + self.translation[pair * 3 + r]
                    })
                    .collect();
                let d: Vec<f64> = targets.iter().map(|y| squared(&placed, y) / spacing).collect();
                let weight = (-0.5 * d.iter().copied().fold(f64::INFINITY, f64::min)).exp();
                found.push((softmax(&d.iter().map(|d| -2.0 * d).collect::<Vec<_>>()), weight));
            }
        }
        found
    }

    fn loss(&self, probabilities: Tensor<3>) -> Tensor<1> {
        self.loss_with(probabilities, None)
    }

    fn loss_with(&self, probabilities: Tensor<3>, matched: Option<Tensor<3>>) -> Tensor<1> {
        let device = Device::flex();
        matching_loss(
            probabilities,
            matched,
            tensor(&self.points, [BATCH, SOURCES, 3], &device),
            tensor(&self.targets, [BATCH, TARGETS, 3], &device),
            tensor(&self.rotation, [BATCH, 3, 3], &device),
            tensor(&self.translation, [BATCH, 3], &device),
        )
    }
}

#[test]
fn it_is_the_weighted_divergence_from_the_labels() {
    let case = case();
    let probabilities: Vec<f64> = case.scores.chunks_exact(TARGETS).flat_map(softmax).collect();
    let (mut sum, mut weights) = (0.0, 0.0);
    for ((label, weight), p) in case.labels().iter().zip(probabilities.chunks_exact(TARGETS)) {
        let divergence: f64 = label.iter().zip(p).map(|(q, p)| q * ((q + 1e-9).ln() - (p + 1e-9).ln())).sum();
        sum += weight * divergence;
        weights += weight;
    }
    let found = case.loss(tensor(&probabilities, [BATCH, SOURCES, TARGETS], &Device::flex()));
    let (found, wanted) = (values(&found)[0], sum / weights);
    assert!(wanted > 0.1 && (found - wanted).abs() < 1e-5 * wanted, "{found} {wanted}");
}

#[test]
fn it_is_zero_at_the_labels_alone() {
    let case = case();
    let labels: Vec<f64> = case.labels().into_iter().flat_map(|(label, _)| label).collect();
    let at_labels = values(&case.loss(tensor(&labels, [BATCH, SOURCES, TARGETS], &Device::flex())))[0];
    assert!(at_labels.abs() < 1e-5, "{at_labels}"); // f32 labels
    let even = vec![1.0 / TARGETS as f64; labels.len()];
    assert!(values(&case.loss(tensor(&even, [BATCH, SOURCES, TARGETS], &Device::flex())))[0] > 0.1);
}

#[test]
fn slack_learns_which_points_have_a_match() {
    let case = case();
    let device = Device::flex();
    let even =
        tensor(&vec![1.0 / TARGETS as f64; BATCH * SOURCES * TARGETS], [BATCH, SOURCES, TARGETS], &device);
    let weights: Vec<f64> = case.labels().into_iter().map(|(_, weight)| weight).collect();
    let with = |matched: &[f64]| {
        let matched = tensor(matched, [BATCH, SOURCES, 1], &device);
        values(&case.loss_with(even.clone(), Some(matched)))[0] - values(&case.loss(even.clone()))[0]
    };
    assert!(with(&weights).abs() < 1e-5, "nothing to learn at the weights: {}", with(&weights));
    let matched: Vec<f64> = Numbers(6).many(weights.len()).iter().map(|v| 0.5 + 0.4 * v).collect();
    let divergence = |q: f64, p: f64| if q > 0.0 { q * (q / p).ln() } else { 0.0 };
    let pairs = weights.iter().zip(&matched);
    let wanted = pairs.map(|(w, p)| divergence(*w, *p) + divergence(1.0 - w, 1.0 - p)).sum::<f64>();
    let wanted = wanted / weights.len() as f64;
    assert!(wanted > 0.01 && (with(&matched) - wanted).abs() < 1e-4 * wanted, "{} {wanted}", with(&matched));
}

#[test]
fn coinciding_targets_and_far_sources_are_fine() {
    let mut case = case();
    case.targets = [0.25; BATCH * TARGETS * 3].to_vec();
    case.points.iter_mut().for_each(|p| *p += 1e3);
    let even = vec![1.0 / TARGETS as f64; BATCH * SOURCES * TARGETS];
    let probabilities = tensor(&even, [BATCH, SOURCES, TARGETS], &Device::flex().autodiff()).require_grad();
    let loss = case.loss(probabilities.clone());
    let gradient = probabilities.grad(&loss.backward()).map(|g| values(&g)).unwrap_or_default();
    assert!(values(&loss)[0].is_finite() && gradient.iter().all(|g| g.is_finite()), "{gradient:?}");
}
