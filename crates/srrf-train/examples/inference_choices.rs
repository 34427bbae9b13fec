//! Scores the ways to use trained weights on the validation part of the training set: passes,
//! tokens, inlier test. The test split plays no part. The tables of docs/experiments.md come from
//!
//! ```sh
//! cargo run -p srrf-train --example inference_choices -- configs/modelnet-small.toml WEIGHTS DATA [SEVERITIES [KEEP]]
//! ```
//!
//! `KEEP`, such as 0.8, is the share of each cloud that is kept: the farthest points along a direction of its own.

use std::path::Path;

use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use srrf_cloud::source::{Split, open};
use srrf_cloud::{PointCloud, Register};
use srrf_corrupt::crop::{crop, random_direction};
use srrf_corrupt::{Pair, Severity};
use srrf_eval::{PairError, Scores};
use srrf_model::{
    InferenceConfig, InlierTest, IntegrationConfig, Matches, SrrfRegister, device, keep_freed_memory, weights,
};
use srrf_train::config::TrainConfig;
use srrf_train::data::TrainingPairs;
use srrf_train::step::Workers;

#[allow(clippy::print_stdout, reason = "an example that prints a table")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    keep_freed_memory();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [config, weights_path, data, rest @ ..] = arguments.as_slice() else {
        return Err("usage: inference_choices CONFIG WEIGHTS DATA [SEVERITIES [KEEP]]".into());
    };
    let severities = rest.first().map_or("3", String::as_str);
    let keep: f64 = rest.get(1).map_or(Ok(1.0), |keep| keep.parse())?;
    let config = <TrainConfig>::read(Path::new(config))?;
    let pairs = TrainingPairs::new(&config, open(Path::new(data), Split::Train)?)?;
    let mut held_out: Vec<Pair> = Vec::new();
    for severity in severities.split(',') {
        held_out.extend(pairs.validation(Severity::try_from(severity.parse::<u8>()?)?)?);
    }
    if keep < 1.0 {
        held_out.iter_mut().enumerate().try_for_each(|(i, pair)| cut(pair, keep, i as u64))?;
    }
    let workers = Workers::new(std::thread::available_parallelism().map_or(1, usize::from))?;
    println!(
        "{}; {} pairs at severity {severities}, {keep} of each cloud kept; RMSE / MAE / median of R in degrees",
        pairs.description(),
        held_out.len()
    );
    println!(
        "| passes | tokens | last pass | inlier test | sharpness | dense | skeleton | fused | the better branch |\n\
         |---|---|---|---|---|---|---|---|---|"
    );
    let (nearest, both, soft) =
        ((InlierTest::Nearest, 1.0), (InlierTest::BothWays, 1.0), (InlierTest::SoftMatch, 1.0));
    // The same test for both, where the skeleton's ratio counts less.
    let fair = (InlierTest::BothWays, 0.8);
    // Number of passes, tokens in them; tokens and matches in the last one, and the prior of all but the first; inlier
    // test.
    let mean = |tokens| (tokens, Matches::Mean, None);
    let best = |tokens| (tokens, Matches::Best, None);
    let near = |tokens, deviation| (tokens, Matches::Best, Some(deviation));
    for (
        passes,
        tokens,
        (last_tokens, matches, prior),
        (test, skeleton_weight),
        dense_threshold,
        skeleton_threshold,
        sharpness,
    ) in [
        (1, 256, mean(256), nearest, 0.05, 0.05, 1.0),
        (1, 256, mean(256), nearest, 0.05, 0.05, 16.0),
        (1, 256, mean(256), both, 0.05, 0.04, 16.0),
        (2, 256, mean(256), nearest, 0.05, 0.05, 1.0),
        (2, 256, mean(256), nearest, 0.05, 0.05, 16.0),
        (2, 256, mean(256), nearest, 0.05, 0.05, 64.0),
        (2, 256, mean(256), nearest, 0.03, 0.03, 16.0),
        (2, 256, mean(256), nearest, 0.02, 0.02, 16.0),
        (2, 256, mean(256), nearest, 0.08, 0.08, 16.0),
        (2, 256, mean(256), soft, 0.05, 0.1, 1.0),
        (3, 256, mean(256), nearest, 0.05, 0.05, 16.0),
        (2, 256, mean(256), both, 0.05, 0.05, 4.0),
        (2, 256, mean(256), both, 0.05, 0.05, 16.0),
        (2, 256, mean(256), both, 0.05, 0.05, 64.0),
        (2, 256, mean(256), both, 0.05, 0.04, 16.0),
        (2, 512, mean(512), nearest, 0.05, 0.05, 16.0),
        (2, 512, mean(512), nearest, 0.05, 0.04, 16.0),
        (2, 512, mean(512), soft, 0.05, 0.05, 4.0),
        (2, 512, mean(512), both, 0.05, 0.05, 4.0),
        (2, 512, mean(512), both, 0.05, 0.05, 16.0),
        (2, 512, mean(512), both, 0.05, 0.047, 16.0),
        (2, 512, mean(512), both, 0.05, 0.045, 16.0),
        (2, 512, mean(512), both, 0.05, 0.04, 16.0),
        (2, 512, mean(512), both, 0.05, 0.03, 16.0),
        (2, 512, mean(512), both, 0.05, 0.04, 64.0),
        (2, 512, mean(512), both, 0.05, 0.03, 64.0),
        (3, 512, mean(512), both, 0.05, 0.04, 16.0),
        (2, 768, mean(768), both, 0.05, 0.04, 16.0),
        (1, 256, best(256), both, 0.05, 0.03, 64.0),
        (1, 512, best(512), both, 0.05, 0.03, 64.0),
        (2, 256, best(512), both, 0.05, 0.03, 64.0),
        (2, 256, best(1024), both, 0.05, 0.03, 64.0),
        (2, 512, best(512), both, 0.05, 0.03, 64.0),
        (2, 512, mean(1024), both, 0.05, 0.03, 64.0),
        (2, 512, best(1024), both, 0.05, 0.03, 64.0),
        (2, 512, best(1024), both, 0.05, 0.05, 16.0),
        (2, 512, best(1024), both, 0.03, 0.03, 16.0),
        (2, 512, best(1024), both, 0.03, 0.03, 64.0),
        (2, 512, best(1024), both, 0.03, 0.02, 64.0),
        (2, 512, best(1024), both, 0.03, 0.01, 256.0),
        (2, 512, best(768), both, 0.05, 0.03, 64.0),
        (3, 256, best(512), both, 0.05, 0.03, 64.0),
        (3, 256, best(1024), both, 0.05, 0.03, 64.0),
        (3, 256, best(1024), both, 0.03, 0.03, 16.0),
        (3, 256, best(1024), both, 0.02, 0.015, 256.0),
        (3, 128, best(1024), both, 0.05, 0.03, 64.0),
        (4, 256, best(1024), both, 0.05, 0.03, 64.0),
        (5, 256, best(1024), both, 0.05, 0.03, 64.0),
        (3, 256, best(1024), both, 0.03, 0.01, 256.0),
        (2, 512, near(1024, 0.1), both, 0.03, 0.01, 256.0),
        (2, 512, near(1024, 0.15), both, 0.03, 0.01, 256.0),
        (2, 512, near(1024, 0.15), fair, 0.03, 0.03, 64.0),
        (3, 512, near(1024, 0.15), fair, 0.03, 0.03, 64.0),
        (3, 256, near(1024, 0.1), both, 0.03, 0.01, 256.0),
        (4, 256, near(1024, 0.1), both, 0.03, 0.01, 256.0),
        (4, 256, near(1024, 0.1), fair, 0.03, 0.03, 64.0),
        (4, 256, near(1024, 0.15), fair, 0.03, 0.03, 64.0),
    ] {
        let device = device("flex")?;
        let mut loaded = weights::load(Path::new(weights_path), &device)?;
        loaded.model.dense = loaded.model.dense.with_tokens(tokens);
        loaded.config.integration =
            IntegrationConfig { test, dense_threshold, skeleton_threshold, sharpness, skeleton_weight };
        loaded.config.inference =
            InferenceConfig { passes, last_tokens: Some(last_tokens), last_matches: matches, prior };
        let method = SrrfRegister::new(loaded, device);
        let less = if skeleton_weight < 1.0 { format!(", times {skeleton_weight}") } else { String::new() };
        let near = prior.map(|deviation| format!(", prior {deviation}")).unwrap_or_default();
        let rows = score(&method, &held_out, &workers)?;
        println!(
            "| {passes} | {tokens} | {last_tokens} {matches:?}{near} | {test:?} {dense_threshold} {skeleton_threshold}{less} | {sharpness} | {} |",
            rows.join(" | ")
        );
    }
    Ok(())
}

/// Keeps a share of both clouds, each on one side of a plane of its own.
fn cut(pair: &mut Pair, keep: f64, seed: u64) -> Result<(), srrf_cloud::CloudError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for cloud in [&mut pair.source, &mut pair.target] {
        let kept = crop(cloud.points(), &random_direction(&mut rng), keep);
        *cloud = PointCloud::new(kept.into_iter().map(|i| cloud.points()[i]).collect())?;
    }
    Ok(())
}

/// Dense, skeleton and fused poses of a method, and of the two branches the one that the truth prefers, as `RMSE / MAE /
/// median`.
fn score(
    method: &SrrfRegister,
    pairs: &[Pair],
    workers: &Workers,
) -> Result<Vec<String>, Box<dyn std::error::Error>> {
    let clouds = |pair: &Pair| -> (PointCloud, PointCloud) { (pair.source.clone(), pair.target.clone()) };
    let answers = workers
        .map(pairs.len(), |i| {
            let (source, target) = clouds(&pairs[i]);
            let answer = method.register(&source, &target).ok()?;
            let branch = |b: usize| answer.branches.get(b).map(|branch| branch.target_from_source);
            let off = |b: usize| branch(b).map(|pose| pose.angle_to_deg(&pairs[i].target_from_source));
            let better = usize::from(off(1) < off(0));
            Some([branch(0), branch(1), Some(answer.target_from_source), branch(better)])
        })
        .ok_or("a worker stopped")?;
    (0..4)
        .map(|row| {
            let errors: Vec<PairError> = pairs
                .iter()
                .zip(&answers)
                .map(|(pair, poses)| {
                    PairError::new(poses.and_then(|p| p[row]).as_ref(), &pair.target_from_source)
                })
                .collect();
            let s = Scores::from_errors(&errors)?;
            Ok(format!("{:.2} / {:.2} / {:.2}", s.rmse_r, s.mae_r, s.median_rot_deg))
        })
        .collect()
}
