//! Scores rules to choose between the poses of the two branches, on validation pairs: thresholds of the inlier test,
//! the weight of the skeleton's ratio, and how many standard errors it must be ahead. The test split plays no part.
//! The tables of the book's experiments come from
//!
//! ```sh
//! cargo run -p srrf-lab --bin fusion_choices -- configs/modelnet-gpu-3-end.toml srrf DATA --seeds 6,7,8
//! ```

use std::path::PathBuf;

use clap::Parser;
use serde::Deserialize;
use srrf_cloud::{KnnIndex, Register, Rigid, SoftMatch};
use srrf_corrupt::{CorruptionKind, Pair, Severity};
use srrf_eval::{PoseError, Scores};
use srrf_lab::{Failure, held_out_pairs};
use srrf_model::{SrrfRegister, device, embedded, keep_freed_memory, network_frame};
use srrf_train::TrainConfig;
use srrf_train::workers::Workers;

/// Scores rules to choose between the branches on validation pairs.
#[derive(Parser)]
struct Arguments {
    /// The configuration that the weights were trained with.
    config: PathBuf,
    /// Name of a network in the program, or a file.
    weights: String,
    /// Where ModelNet40 is, if the configuration trains on it.
    data: Option<PathBuf>,
    /// Severities of the pairs.
    #[arg(long, value_delimiter = ',', default_value = "2,3,4,5")]
    severities: Vec<u8>,
    /// Seeds of the pairs: each draws other poses and corruptions of the same validation shapes.
    #[arg(long, value_delimiter = ',', default_value = "6,7,8")]
    seeds: Vec<u64>,
    /// The numbers that rules are made of.
    #[arg(long, default_value = "lab/sweeps/fusion.toml")]
    list: PathBuf,
}

/// The numbers that rules are made of.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RuleList {
    /// Thresholds of the inlier test, in network units.
    thresholds: Vec<f64>,
    /// Weights of the skeleton's ratio.
    weights: Vec<f64>,
    /// Standard errors that the skeleton's ratio must be ahead by.
    standard_errors: Vec<f64>,
}

/// What a rule may look at, and what it is scored by.
struct Judged {
    corruption: Option<(CorruptionKind, Severity)>,
    errors: [PoseError; 3],
    /// Of each threshold: points that only the dense pose brings near, only the skeleton's, and both.
    near: Vec<[f64; 3]>,
    /// Points of both clouds.
    points: f64,
    /// Of each threshold: matches of the dense branch that agree with the dense pose alone, with the skeleton's alone, and with both.
    matches: Vec<[f64; 3]>,
}

/// The branches and the fused pose.
#[derive(Clone, Copy, PartialEq)]
enum Chosen {
    Dense,
    Skeleton,
    Fused,
}

fn judge(method: &SrrfRegister, pair: &Pair, thresholds: &[f64]) -> Option<Judged> {
    let answer = method.register(&pair.source, &pair.target).ok()?;
    let branch = |b: usize| answer.branches.get(b).map(|branch| branch.target_from_source);
    let (dense, skeleton) = (branch(0)?, branch(1)?);
    let scale = network_frame(&pair.source, &pair.target).undo_length(1.0);
    let (by_dense, by_skeleton) = (distances(pair, &dense)?, distances(pair, &skeleton)?);
    let residuals = |pose: &Rigid| -> Vec<f64> {
        let off =
            |m: &SoftMatch| (0..3).map(|c| (pose.apply(&m.source)[c] - m.target[c]).powi(2)).sum::<f64>();
        answer.matches.iter().map(|m| off(m).sqrt()).collect()
    };
    let near = counts(thresholds, &by_dense, &by_skeleton, scale);
    let matches = counts(thresholds, &residuals(&dense), &residuals(&skeleton), scale);
    let error = |pose: &Rigid| PoseError::new(Some(pose), &pair.target_from_source);
    Some(Judged {
        corruption: pair.corruption,
        errors: [error(&dense), error(&skeleton), error(&answer.target_from_source)],
        near,
        points: (pair.source.len() + pair.target.len()) as f64,
        matches,
    })
}

/// For each threshold, how many distances are below it with the first pose alone, with the second alone, and with both.
fn counts(thresholds: &[f64], first: &[f64], second: &[f64], scale: f64) -> Vec<[f64; 3]> {
    let of_threshold = |&threshold: &f64| {
        let mut counts = [0.0; 3];
        for (a, b) in first.iter().zip(second) {
            match (*a < threshold * scale, *b < threshold * scale) {
                (true, false) => counts[0] += 1.0,
                (false, true) => counts[1] += 1.0,
                (true, true) => counts[2] += 1.0,
                (false, false) => {}
            }
        }
        counts
    };
    thresholds.iter().map(of_threshold).collect()
}

/// Of each point of the placed source how far the target is, and of each point of the target how far the source is.
fn distances(pair: &Pair, target_from_source: &Rigid) -> Option<Vec<f64>> {
    let placed: Vec<[f64; 3]> = pair.source.points().iter().map(|p| target_from_source.apply(p)).collect();
    let one_way = |from: &[[f64; 3]], to: &[[f64; 3]]| {
        let index = KnnIndex::new(to).ok()?;
        Some(from.iter().map(|p| index.nearest(p).1.sqrt()).collect::<Vec<f64>>())
    };
    Some([one_way(&placed, pair.target.points())?, one_way(pair.target.points(), &placed)?].concat())
}

/// Mean over the 12 corruptions and their severities of RMSE and MAE of R, in degrees.
fn scores(pairs: &[Judged], choose: impl Fn(&Judged) -> Chosen) -> Result<[f64; 2], Failure> {
    let mut rows: Vec<_> = pairs.iter().filter_map(|pair| pair.corruption).collect();
    rows.sort_by_key(|(kind, severity)| (kind.name(), u8::from(*severity)));
    rows.dedup();
    let mut sum = [0.0; 2];
    for row in &rows {
        let of_row = pairs.iter().filter(|pair| pair.corruption == Some(*row));
        let errors: Vec<PoseError> = of_row.map(|pair| pair.errors[choose(pair) as usize]).collect();
        let s = Scores::from_errors(&errors)?;
        sum[0] += s.rmse_r;
        sum[1] += s.mae_r;
    }
    Ok(sum.map(|sum| sum / rows.len() as f64))
}

#[allow(clippy::print_stdout, reason = "a program that prints a table")]
fn main() -> Result<(), Failure> {
    keep_freed_memory();
    let arguments = Arguments::parse();
    let config = <TrainConfig>::read(&arguments.config)?;
    let device = device("flex")?;
    let method = SrrfRegister::new(embedded::open(&arguments.weights, &device)?, device);
    let workers = Workers::new(std::thread::available_parallelism().map_or(1, usize::from))?;
    let RuleList { thresholds, weights, standard_errors } =
        toml::from_str(&std::fs::read_to_string(&arguments.list)?)?;
    let data = arguments.data.as_deref();
    let (_, pairs) = held_out_pairs(&config, data, &arguments.seeds, &arguments.severities)?;
    let answers = workers.map(pairs.len(), |i| judge(&method, &pairs[i], &thresholds));
    let judged: Option<Vec<Judged>> = answers.ok_or("a worker stopped")?.into_iter().collect();
    let judged = judged.ok_or("a pair has no answer of both branches")?;
    println!(
        "{} pairs; the skeleton branch is chosen in; RMSE / MAE of R in degrees, mean of the rows",
        judged.len()
    );
    println!("| rule | threshold | skeleton | RMSE / MAE |\n|---|---|---|---|");
    let print = |rule: &str, threshold: &str, choose: &dyn Fn(&Judged) -> Chosen| {
        let taken = judged.iter().filter(|&pair| choose(pair) == Chosen::Skeleton).count();
        let [rmse, mae] = scores(&judged, choose)?;
        println!("| {rule} | {threshold} | {taken} | {rmse:.4} / {mae:.4} |");
        Ok::<(), Failure>(())
    };
    print("dense", "", &|_| Chosen::Dense)?;
    print("skeleton", "", &|_| Chosen::Skeleton)?;
    print("fused, as the weights say", "", &|_| Chosen::Fused)?;
    print("the better branch", "", &|pair| {
        if pair.errors[1].rotation_deg < pair.errors[0].rotation_deg {
            Chosen::Skeleton
        } else {
            Chosen::Dense
        }
    })?;
    let choice = |skeleton: bool| if skeleton { Chosen::Skeleton } else { Chosen::Dense };
    for (t, threshold) in thresholds.iter().enumerate() {
        let threshold = &threshold.to_string();
        for &weight in &weights {
            let rule = |[dense, skeleton, both]: [f64; 3]| choice(weight * (skeleton + both) > dense + both);
            print(&format!("matches of the dense branch, skeleton times {weight}"), threshold, &|pair| {
                rule(pair.matches[t])
            })?;
            print(&format!("skeleton times {weight}"), threshold, &|pair| rule(pair.near[t]))?;
        }
        for &ahead in &standard_errors {
            let paired =
                |[dense, skeleton, _]: [f64; 3]| choice(skeleton - dense > ahead * (skeleton + dense).sqrt());
            print(
                &format!("matches of the dense branch, ahead by {ahead} standard errors"),
                threshold,
                &|pair| paired(pair.matches[t]),
            )?;
            print(&format!("ahead by {ahead} standard errors, points independent"), threshold, &|pair| {
                let [dense, skeleton, both] = pair.near[t].map(|count| count / pair.points);
                let variance = |share: f64| share * (1.0 - share) / pair.points;
                let error = (variance(dense + both) + variance(skeleton + both)).sqrt();
                choice(skeleton - dense > ahead * error)
            })?;
            print(&format!("ahead by {ahead} standard errors, points paired"), threshold, &|pair| {
                paired(pair.near[t])
            })?;
        }
    }
    Ok(())
}
