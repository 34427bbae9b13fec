//! Prints how often the compatibility graph and random samples find the pose, in the same time, over shares of right matches.
//!
//! `cargo run --release -p srrf-classical --example consensus`
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example")]

use std::time::Instant;

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use srrf_classical::{Correspondences, GraphConsensus, RansacConsensus, SupportedPose};
use srrf_cloud::{EulerXyz, Rigid};

/// Deviation of the noise; the points lie in a box of side 2.
const NOISE: f64 = 0.01;
const DISTANCE: f64 = 0.03;
const TRIALS: u64 = 20;

fn main() {
    println!(
        "| matches | right | graph found | RANSAC found | ms each | RANSAC draws |\n|---|---|---|---|---|---|"
    );
    for count in [500, 1000, 3000] {
        for ratio in [0.01, 0.02, 0.05, 0.1, 0.2, 0.5] {
            let (mut graph, mut ransac, mut seconds, mut draws) = (0, 0, 0.0, 0);
            for seed in 0..TRIALS {
                let (matches, truth) = matches(count, ratio, seed);
                let search = GraphConsensus { distance: DISTANCE, ..GraphConsensus::default() };
                let begun = Instant::now();
                let found = search.poses(&matches);
                let taken = begun.elapsed().as_secs_f64();
                graph += usize::from(is_right(&found, &truth));

                // As many draws as take that long, and no early end.
                let draw = |max_iterations| {
                    let search = RansacConsensus {
                        distance: DISTANCE,
                        confidence: 1.0,
                        seed,
                        max_iterations,
                        ..Default::default()
                    };
                    search.poses(&matches).0
                };
                let begun = Instant::now();
                draw(8192);
                let allowed = (8192.0 * taken / begun.elapsed().as_secs_f64()) as usize;
                ransac += usize::from(is_right(&draw(allowed), &truth));
                seconds += taken;
                draws += allowed;
            }
            let trials = TRIALS as f64;
            println!(
                "| {count} | {:.0} % | {graph} of {TRIALS} | {ransac} of {TRIALS} | {:.0} | {:.0} |",
                100.0 * ratio,
                1e3 * seconds / trials,
                draws as f64 / trials
            );
        }
    }
}

fn is_right(found: &[SupportedPose], truth: &Rigid) -> bool {
    found.first().is_some_and(|best| {
        let pose = &best.target_from_source;
        pose.angle_to_deg(truth) < 2.0 && (pose.translation - truth.translation).norm() < 2.0 * DISTANCE
    })
}

/// `count` matches of which `ratio` are right but for noise.
fn matches(count: usize, ratio: f64, seed: u64) -> (Correspondences, Rigid) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let degrees: [f64; 3] = std::array::from_fn(|_| rng.random_range(-180.0..180.0));
    let translation: [f64; 3] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
    let truth = Rigid { rotation: EulerXyz::from_deg(degrees).to_matrix(), translation: translation.into() };
    let right = (ratio * count as f64).round() as usize;
    let (mut source, mut target) = (Vec::new(), Vec::new());
    for i in 0..count {
        let mut point = || -> [f64; 3] { std::array::from_fn(|_| rng.random_range(-1.0..1.0)) };
        let (x, chance) = (point(), point());
        let y = truth.apply(&if i < right { x } else { chance });
        source.push(x);
        target.push(y.map(|c| c + NOISE * (0..12).map(|_| rng.random::<f64>() - 0.5).sum::<f64>()));
    }
    (Correspondences::new(source, target).unwrap(), truth)
}
