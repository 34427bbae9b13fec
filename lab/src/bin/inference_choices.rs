//! Scores the ways to use trained weights on the validation part of the training set: passes,
//! tokens, inlier test. The test split plays no part. The tables of the book's experiments come from
//!
//! ```sh
//! cargo run -p srrf-lab --bin inference_choices -- lab/sweeps/srrf.toml#modelnet-gpu-2 srrf DATA --rows prior
//! ```

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use serde::Deserialize;
use srrf_cloud::{Register, Registration, Rigid};
use srrf_corrupt::crop::{crop, random_direction};
use srrf_corrupt::{CorruptionKind, Pair};
use srrf_eval::{MetricError, PoseError, Scores};
use srrf_lab::{Failure, held_out_pairs, keep};
use srrf_model::{NetworkBranch, SrrfConfig, SrrfRegister, device, embedded, keep_freed_memory};
use srrf_train::TrainConfig;
use srrf_train::workers::Workers;
use toml::{Table, Value};

/// Scores the ways to use trained weights on validation pairs.
#[derive(Parser)]
struct Arguments {
    /// The configuration that the weights were trained with.
    config: PathBuf,
    /// Name of a network in the program, or a file.
    weights: String,
    /// Where ModelNet40 is, if the configuration trains on it.
    data: Option<PathBuf>,
    /// Severities of the pairs.
    #[arg(long, value_delimiter = ',', default_value = "3")]
    severities: Vec<u8>,
    /// Share of each cloud that is kept: the farthest points along a direction of its own.
    #[arg(long, default_value_t = 1.0)]
    keep: f64,
    /// The list of rows.
    #[arg(long, default_value = "lab/sweeps/inference.toml")]
    list: PathBuf,
    /// Which rows to score.
    #[arg(long, value_enum, default_value = "all")]
    rows: TablePart,
    /// Score each branch alone in all passes, instead of the branches of the whole network, whose passes start
    /// from the fused pose.
    #[arg(long)]
    alone: bool,
    /// Print the figures of each corruption under each row.
    #[arg(long)]
    by_corruption: bool,
}

/// Parts of the table.
#[derive(Clone, Copy, PartialEq, ValueEnum, Deserialize)]
#[serde(rename_all = "snake_case")]
enum TablePart {
    /// All of the below; an hour and more.
    All,
    /// As the weights' own header says.
    Header,
    /// Soft matches in all passes.
    Mean,
    /// Most probable matches in the last pass.
    Best,
    /// The same, with a prior on where matches lie.
    Prior,
}

/// One row: how the network is used.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct InferenceRow {
    /// Which part of the table it belongs to.
    part: TablePart,
    /// Tokens of the dense branch.
    tokens: usize,
    /// The `inference` of the header.
    inference: Table,
    /// The `integration` of the header.
    integration: Table,
}

/// The list of rows.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InferenceList {
    rows: Vec<InferenceRow>,
}

impl InferenceRow {
    /// The row of the weights' own header.
    fn of_header(header: &SrrfConfig) -> Result<Self, Failure> {
        let table = |key: &str| Ok::<_, Failure>(Table::try_from(header)?.get(key).cloned());
        let part =
            |key: &str| Ok::<_, Failure>(table(key)?.and_then(|v| v.try_into().ok()).unwrap_or_default());
        let (inference, integration) = (part("inference")?, part("integration")?);
        Ok(Self { part: TablePart::Header, tokens: header.dense.tokens, inference, integration })
    }

    /// The header with what the row changes.
    fn applied(&self, header: &SrrfConfig) -> Result<SrrfConfig, Failure> {
        let mut changed = Table::try_from(header)?;
        changed.insert("inference".into(), Value::Table(self.inference.clone()));
        changed.insert("integration".into(), Value::Table(self.integration.clone()));
        let mut changed: SrrfConfig = Value::Table(changed).try_into()?;
        changed.dense.tokens = self.tokens;
        Ok(changed)
    }

    fn describe(&self) -> String {
        let words = |table: &Table| {
            table.iter().map(|(key, value)| format!("{key} {value}")).collect::<Vec<_>>().join(", ")
        };
        format!("{} | {} | {}", self.tokens, words(&self.inference), words(&self.integration))
    }
}

#[allow(clippy::print_stdout, reason = "a program that prints a table")]
fn main() -> Result<(), Failure> {
    keep_freed_memory();
    let arguments = Arguments::parse();
    let config = <TrainConfig>::read(&arguments.config)?;
    let data = arguments.data.as_deref();
    let (description, mut held_out) = held_out_pairs(&config, data, &[config.seed], &arguments.severities)?;
    if arguments.keep < 1.0 {
        held_out.iter_mut().enumerate().try_for_each(|(i, pair)| cut(pair, arguments.keep, i as u64))?;
    }
    let workers = Workers::new(std::thread::available_parallelism().map_or(1, usize::from))?;
    println!(
        "{}; {} pairs at severities {:?}, {} of each cloud kept; RMSE / MAE / median of R in degrees",
        description,
        held_out.len(),
        arguments.severities,
        arguments.keep
    );
    let columns: &[&str] = match arguments.alone {
        true => &["dense alone", "skeleton alone"],
        false => &["dense", "skeleton", "fused", "the better branch"],
    };
    println!(
        "| tokens | inference | integration | {} |\n|{}",
        columns.join(" | "),
        "---|".repeat(3 + columns.len())
    );
    let device = device("flex")?;
    let opened = embedded::open(&arguments.weights, &device)?;
    let list: InferenceList = toml::from_str(&std::fs::read_to_string(&arguments.list)?)?;
    let rows = std::iter::once(InferenceRow::of_header(&opened.config)?).chain(list.rows);
    for row in rows.filter(|row| arguments.rows == TablePart::All || arguments.rows == row.part) {
        let mut loaded = opened.clone();
        loaded.model.dense = loaded.model.dense.with_tokens(row.tokens);
        loaded.config = row.applied(&opened.config)?;
        let network = || SrrfRegister::new(loaded.clone(), device.clone());
        let errors = match arguments.alone {
            true => {
                let alone = |branch| errors_of(&network().alone(branch), &held_out, &workers, own);
                [alone(NetworkBranch::Dense)?, alone(NetworkBranch::Skeleton)?].concat()
            }
            false => errors_of(&network(), &held_out, &workers, of_both)?,
        };
        println!("| {} | {} |", row.describe(), scores(&errors, |_| true)?);
        if arguments.by_corruption {
            for kind in std::iter::once(None).chain(CorruptionKind::ALL.map(Some)) {
                let name = kind.map_or("clean", |kind: CorruptionKind| kind.name());
                let of_kind = |i: usize| held_out[i].corruption.map(|(kind, _)| kind) == kind;
                if (0..held_out.len()).any(of_kind) {
                    println!("| {name} | | | {} |", scores(&errors, of_kind)?);
                }
            }
        }
    }
    Ok(())
}

/// Keeps a share of both clouds, each on one side of a plane of its own.
fn cut(pair: &mut Pair, share: f64, seed: u64) -> Result<(), srrf_cloud::CloudError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for cloud in [&mut pair.source, &mut pair.target] {
        let kept = crop(cloud.points(), &random_direction(&mut rng), share);
        keep(cloud, &kept)?;
    }
    Ok(())
}

/// The poses of an answer that are scored, one a column; the truth is there to choose by.
type AnswerColumns<const N: usize> = fn(&Registration, &Rigid) -> [Option<Rigid>; N];

/// The pose itself.
fn own(answer: &Registration, _: &Rigid) -> [Option<Rigid>; 1] {
    [Some(answer.target_from_source)]
}

/// The dense, the skeleton and the fused pose, and of the two branches the one that the truth prefers.
fn of_both(answer: &Registration, truth: &Rigid) -> [Option<Rigid>; 4] {
    let branch = |b: usize| answer.branches.get(b).map(|branch| branch.target_from_source);
    let off = |b: usize| branch(b).map(|pose| pose.angle_to_deg(truth));
    let better = usize::from(off(1) < off(0));
    [branch(0), branch(1), Some(answer.target_from_source), branch(better)]
}

/// The errors of all pairs, for each column.
fn errors_of<const N: usize>(
    method: &SrrfRegister,
    pairs: &[Pair],
    workers: &Workers,
    columns: AnswerColumns<N>,
) -> Result<Vec<Vec<PoseError>>, Failure> {
    let answers = workers
        .map(pairs.len(), |i| {
            let answer = method.register(&pairs[i].source, &pairs[i].target).ok()?;
            Some(columns(&answer, &pairs[i].target_from_source))
        })
        .ok_or("a worker stopped")?;
    let of_column = |column: usize| {
        let both = pairs.iter().zip(&answers);
        both.map(|(pair, poses)| {
            PoseError::new(poses.and_then(|p| p[column]).as_ref(), &pair.target_from_source)
        })
        .collect()
    };
    Ok((0..N).map(of_column).collect())
}

/// `RMSE / MAE / median` of each column, over the pairs that are wanted.
fn scores(errors: &[Vec<PoseError>], wanted: impl Fn(usize) -> bool) -> Result<String, MetricError> {
    let of_column = |errors: &Vec<PoseError>| {
        let chosen: Vec<PoseError> = (0..errors.len()).filter(|&i| wanted(i)).map(|i| errors[i]).collect();
        let s = Scores::from_errors(&chosen)?;
        Ok(format!("{:.2} / {:.2} / {:.2}", s.rmse_r, s.mae_r, s.median_rot_deg))
    };
    Ok(errors.iter().map(of_column).collect::<Result<Vec<_>, _>>()?.join(" | "))
}
