//! Learning works: on eight pairs, every branch goes under one degree.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use burn::module::Module;
use burn::optim::{AdamConfig, GradientsParams};
use burn::tensor::{Device, Tensor};
use common::Numbers;
use nalgebra::Vector3;
use srrf_cloud::{PointCloud, Rigid};
use srrf_model::{
    BranchConfig, BranchOutput, BranchRatios, InferenceConfig, IntegrationRule, LevelConfig, MatchingConfig,
    PairBatch, PfiConfig, SemConfig, SfeConfig, SkeletonLossConfig, Srrf, SrrfConfig, chamfer,
    correspondence_loss, init, registration_loss, skeleton_loss,
};

const PAIRS: usize = 8;
const POINTS: usize = 96;

fn config() -> SrrfConfig {
    let level = |widths: &[usize]| LevelConfig { points: 32, neighbours: 8, widths: widths.to_vec() };
    let sfe = |neighbours| SfeConfig { layers: 2, neighbours, width: 32, heads: 4, mlp: 64 };
    let pfi = PfiConfig { blocks: 1, heads: 4, feed_forward: 96, position_hidden: 64, squeeze: 8 };
    SrrfConfig {
        sem: SemConfig {
            levels: vec![level(&[16, 32]), level(&[64])],
            global: 32,
            head: vec![64],
            skeleton_points: 24,
            logit_scale: 5.0,
        },
        dense: BranchConfig {
            tokens: 48,
            confidence: false,
            matching: MatchingConfig::default(),
            sfe: sfe(8),
            pfi: pfi.clone(),
        },
        skeleton: BranchConfig {
            tokens: 0,
            confidence: true,
            matching: MatchingConfig::default(),
            sfe: sfe(6),
            pfi,
        },
        integration: IntegrationRule::Nearest(BranchRatios {
            dense_threshold: 0.05,
            skeleton_threshold: 0.05,
            sharpness: 1.0,
            skeleton_weight: 1.0,
        }),
        inference: InferenceConfig::default(),
    }
}

/// A bracket: three bars of drawn lengths at right angles and a quarter ring, no two alike and none
/// with a symmetry.
fn bracket(numbers: &mut Numbers) -> PointCloud {
    let lengths: [f64; 3] = std::array::from_fn(|axis| 0.5 + 0.2 * axis as f64 + 0.2 * numbers.signed());
    let point = |i: usize, numbers: &mut Numbers| {
        let along = 0.5 + 0.5 * numbers.signed();
        let mut p = [0, 1, 2].map(|_| 0.05 * numbers.signed());
        match i % 4 {
            3 => {
                let angle = along * std::f64::consts::FRAC_PI_2;
                (p[0], p[1], p[2]) = (0.6 * angle.cos(), 0.6 * angle.sin(), p[2] + lengths[2]);
            }
            axis => p[axis] += along * lengths[axis] * 1.5,
        }
        p
    };
    PointCloud::new((0..POINTS).map(|i| point(i, numbers)).collect()).unwrap()
}

/// Eight pairs: the target is the posed source, in another order.
fn pairs() -> Vec<(PointCloud, PointCloud, Rigid)> {
    let mut numbers = Numbers(1);
    (0..PAIRS)
        .map(|_| {
            let source = bracket(&mut numbers);
            let pose = Rigid {
                rotation: numbers.rotation(45.0),
                translation: Vector3::from_vec(numbers.many(3)) * 0.5,
            };
            let moved = source.transformed(&pose);
            let order = numbers.permutation(POINTS);
            let target = PointCloud::new(order.iter().map(|&i| moved.points()[i]).collect()).unwrap();
            (source, target, pose)
        })
        .collect()
}

/// From `high` down to a hundredth of it along half a cosine.
fn rate(high: f64, step: usize, steps: usize) -> f64 {
    let turn = step as f64 / steps as f64 * std::f64::consts::PI;
    high * (0.505 + 0.495 * turn.cos())
}

/// The pairs as the network sees them, with their true poses.
struct Lesson {
    batch: PairBatch,
    truth: Vec<Rigid>,
    rotation: Tensor<3>,
    translation: Tensor<2>,
}

impl Lesson {
    fn new(device: &Device) -> Self {
        let pairs = pairs();
        let clouds: Vec<(&PointCloud, &PointCloud)> = pairs.iter().map(|(s, t, _)| (s, t)).collect();
        let truth: Vec<Rigid> = pairs.iter().map(|(_, _, pose)| *pose).collect();
        let batch = PairBatch::new(&clouds, device).unwrap();
        let (rotation, translation) = batch.truth(&truth);
        Self { batch, truth, rotation, translation }
    }

    fn clouds(&self) -> (Tensor<3>, Tensor<3>) {
        (self.batch.source.clone(), self.batch.target.clone())
    }

    /// The skeleton module, after Chamfer pre-training and the skeleton losses.
    fn with_skeletons(&self, mut model: Srrf, warm: usize, steps: usize) -> Srrf {
        let config = SkeletonLossConfig {
            point_to_sphere: 0.3,
            radius: 0.4,
            distribution: 0.25,
            distribution_over_spread: 0.0,
            index_match: 0.25,
        };
        let mut adam = AdamConfig::new().init();
        for step in 0..steps {
            model.sem = model.sem.train();
            let (source, target) = self.clouds();
            let (x, y) =
                (model.sem.forward(source.clone()).unwrap(), model.sem.forward(target.clone()).unwrap());
            let loss = if step < warm {
                chamfer(x.points, source).unwrap() + chamfer(y.points, target).unwrap()
            } else {
                let pose = (self.rotation.clone(), self.translation.clone());
                skeleton_loss(&config, (source, &x), (target, &y), pose.0, pose.1).unwrap().total
            };
            let grads = GradientsParams::from_grads(loss.backward(), &model.sem);
            model.sem = adam.step(rate(3e-3, step, steps), model.sem, grads).valid();
        }
        model
    }

    /// Both branches, on skeletons that stay. The correspondences show the way; the second half is
    /// left to the paper's loss alone.
    fn with_branches(&self, mut model: Srrf, integration: &IntegrationRule, steps: usize) -> Srrf {
        let mut adam = AdamConfig::new().init();
        for step in 0..steps {
            let (dense, skeleton) = (model.dense.train(), model.skeleton.train());
            let network = Srrf { sem: model.sem, dense, skeleton };
            let (source, target) = self.clouds();
            let output = network.forward(integration, source, target, 0.5).unwrap();
            let pose = |r: &Tensor<3>, t: &Tensor<2>| {
                registration_loss(r.clone(), t.clone(), self.rotation.clone(), self.translation.clone())
            };
            let branch = |found: &BranchOutput| {
                let (points, matches) = (found.source_points.clone(), found.matches.clone());
                let (rotation, translation) = (self.rotation.clone(), self.translation.clone());
                let weight = if step < steps / 2 { 1.0 } else { 0.0 };
                pose(&found.rotation, &found.translation)
                    + correspondence_loss(points, matches, rotation, translation) * weight
            };
            let fused = pose(&output.fused.rotation, &output.fused.translation);
            let loss = branch(&output.dense) + branch(&output.skeleton) + fused;
            let grads = GradientsParams::from_grads(loss.backward(), &network);
            model = adam.step(rate(3e-3, step, steps), network, grads).valid();
        }
        model
    }

    /// The largest rotation error of the eight pairs in degrees: dense, skeleton, fused.
    fn worst_deg(&self, model: &Srrf, integration: &IntegrationRule) -> [f64; 3] {
        let (source, target) = self.clouds();
        let output = model.forward(integration, source, target, 0.5).unwrap();
        let worst = |rotation: &Tensor<3>, translation: &Tensor<2>| {
            let found = self.batch.poses(rotation, translation).unwrap();
            let errors = found.iter().zip(&self.truth).map(|(a, b)| a.unwrap().angle_to_deg(b));
            errors.fold(0.0, f64::max)
        };
        [
            worst(&output.dense.rotation, &output.dense.translation),
            worst(&output.skeleton.rotation, &output.skeleton.translation),
            worst(&output.fused.rotation, &output.fused.translation),
        ]
    }
}

#[test]
fn eight_pairs_are_learned_by_every_branch() {
    let device = Device::flex();
    let (config, lesson) = (config(), Lesson::new(&device));
    let model = init::seeded(config.init(&device), 1);
    let before = lesson.worst_deg(&model, &config.integration);
    let model = lesson.with_skeletons(model, 40, 160);
    let model = lesson.with_branches(model, &config.integration, 160);
    let after = lesson.worst_deg(&model, &config.integration);
    println!("dense, skeleton, fused in degrees: {before:.2?} before, {after:.2?} after");
    assert!(before.iter().all(|&worst| worst > 5.0), "{before:?}");
    assert!(after.iter().all(|&worst| worst < 1.0), "{after:?}");
}
