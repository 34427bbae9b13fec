//! Prints how often the compatibility graph and random samples find the pose, in the same time, over shares of right matches.
//!
//! `cargo run --release -p srrf-classical --example consensus`
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example")]

use std::time::Instant;

use srrf_classical::{GraphConsensus, RansacConsensus, SupportedPose, synthetic};
use srrf_cloud::Rigid;

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
                let (matches, truth) = synthetic(count, ratio, NOISE, seed).unwrap();
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
