//! Scores the ways to use trained weights on the validation part of the training set: passes,
//! tokens, inlier test. The test split plays no part. The tables of book/src/experiments come from
//!
//! ```sh
//! cargo run -p srrf-lab --bin inference_choices -- configs/modelnet-gpu-2.toml srrf DATA --rows prior
//! ```

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use srrf_cloud::{PointCloud, Register, Registration, Rigid};
use srrf_corrupt::crop::{crop, random_direction};
use srrf_corrupt::{CorruptionKind, Pair, Severity};
use srrf_eval::{MetricError, PoseError, Scores};
use srrf_model::{
    BranchKind, InferenceConfig, InlierTest, IntegrationConfig, Matches, SrrfConfig, SrrfRegister, device,
    embedded, keep_freed_memory,
};
use srrf_train::TrainConfig;
use srrf_train::data::{TrainingPairs, training_shapes};
use srrf_train::workers::Workers;

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
    /// Which rows to score.
    #[arg(long, value_enum, default_value = "all")]
    rows: Rows,
    /// Score each branch alone in all passes, instead of the branches of the whole network, whose passes start
    /// from the fused pose.
    #[arg(long)]
    alone: bool,
    /// Print the figures of each corruption under each row.
    #[arg(long)]
    by_corruption: bool,
}

/// Parts of the table.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Rows {
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

/// An inlier test, and the factor of the skeleton branch's ratio.
type Test = (InlierTest, f64);
const NEAREST: Test = (InlierTest::Nearest, 1.0);
const BOTH: Test = (InlierTest::BothWays, 1.0);
const SOFT: Test = (InlierTest::SoftMatch, 1.0);
/// The same test for both, where the skeleton's ratio counts less.
const FAIR: Test = (InlierTest::BothWays, 0.8);

/// Passes, tokens in them, tokens in the last one, inlier test with the thresholds of the dense and of the skeleton
/// branch, sharpness.
type Choice = (usize, usize, usize, Test, f64, f64, f64);

const MEAN: &[Choice] = &[
    (1, 256, 256, NEAREST, 0.05, 0.05, 1.0),
    (1, 256, 256, NEAREST, 0.05, 0.05, 16.0),
    (1, 256, 256, BOTH, 0.05, 0.04, 16.0),
    (2, 256, 256, NEAREST, 0.05, 0.05, 1.0),
    (2, 256, 256, NEAREST, 0.05, 0.05, 16.0),
    (2, 256, 256, NEAREST, 0.05, 0.05, 64.0),
    (2, 256, 256, NEAREST, 0.03, 0.03, 16.0),
    (2, 256, 256, NEAREST, 0.02, 0.02, 16.0),
    (2, 256, 256, NEAREST, 0.08, 0.08, 16.0),
    (2, 256, 256, SOFT, 0.05, 0.1, 1.0),
    (3, 256, 256, NEAREST, 0.05, 0.05, 16.0),
    (2, 256, 256, BOTH, 0.05, 0.05, 4.0),
    (2, 256, 256, BOTH, 0.05, 0.05, 16.0),
    (2, 256, 256, BOTH, 0.05, 0.05, 64.0),
    (2, 256, 256, BOTH, 0.05, 0.04, 16.0),
    (2, 512, 512, NEAREST, 0.05, 0.05, 16.0),
    (2, 512, 512, NEAREST, 0.05, 0.04, 16.0),
    (2, 512, 512, SOFT, 0.05, 0.05, 4.0),
    (2, 512, 512, BOTH, 0.05, 0.05, 4.0),
    (2, 512, 512, BOTH, 0.05, 0.05, 16.0),
    (2, 512, 512, BOTH, 0.05, 0.047, 16.0),
    (2, 512, 512, BOTH, 0.05, 0.045, 16.0),
    (2, 512, 512, BOTH, 0.05, 0.04, 16.0),
    (2, 512, 512, BOTH, 0.05, 0.03, 16.0),
    (2, 512, 512, BOTH, 0.05, 0.04, 64.0),
    (2, 512, 512, BOTH, 0.05, 0.03, 64.0),
    (3, 512, 512, BOTH, 0.05, 0.04, 16.0),
    (2, 768, 768, BOTH, 0.05, 0.04, 16.0),
    (2, 512, 1024, BOTH, 0.05, 0.03, 64.0),
];

const BEST: &[Choice] = &[
    (1, 256, 256, BOTH, 0.05, 0.03, 64.0),
    (1, 512, 512, BOTH, 0.05, 0.03, 64.0),
    (2, 256, 512, BOTH, 0.05, 0.03, 64.0),
    (2, 256, 1024, BOTH, 0.05, 0.03, 64.0),
    (2, 512, 512, BOTH, 0.05, 0.03, 64.0),
    (2, 512, 1024, BOTH, 0.05, 0.03, 64.0),
    (2, 512, 1024, BOTH, 0.05, 0.05, 16.0),
    (2, 512, 1024, BOTH, 0.03, 0.03, 16.0),
    (2, 512, 1024, BOTH, 0.03, 0.03, 64.0),
    (2, 512, 1024, BOTH, 0.03, 0.02, 64.0),
    (2, 512, 1024, BOTH, 0.03, 0.01, 256.0),
    (2, 512, 768, BOTH, 0.05, 0.03, 64.0),
    (3, 256, 512, BOTH, 0.05, 0.03, 64.0),
    (3, 256, 1024, BOTH, 0.05, 0.03, 64.0),
    (3, 256, 1024, BOTH, 0.03, 0.03, 16.0),
    (3, 256, 1024, BOTH, 0.02, 0.015, 256.0),
    (3, 128, 1024, BOTH, 0.05, 0.03, 64.0),
    (4, 256, 1024, BOTH, 0.05, 0.03, 64.0),
    (5, 256, 1024, BOTH, 0.05, 0.03, 64.0),
    (3, 256, 1024, BOTH, 0.03, 0.01, 256.0),
];

/// With the deviation of the prior.
const PRIOR: &[(f64, Choice)] = &[
    (0.1, (2, 512, 1024, BOTH, 0.03, 0.01, 256.0)),
    (0.15, (2, 512, 1024, BOTH, 0.03, 0.01, 256.0)),
    (0.15, (2, 512, 1024, FAIR, 0.03, 0.03, 64.0)),
    (0.15, (3, 512, 1024, FAIR, 0.03, 0.03, 64.0)),
    (0.1, (3, 256, 1024, BOTH, 0.03, 0.01, 256.0)),
    (0.1, (4, 256, 1024, BOTH, 0.03, 0.01, 256.0)),
    (0.1, (4, 256, 1024, FAIR, 0.03, 0.03, 64.0)),
    (0.15, (4, 256, 1024, FAIR, 0.03, 0.03, 64.0)),
];

/// One row: how the network is used.
struct Row {
    tokens: usize,
    inference: InferenceConfig,
    integration: IntegrationConfig,
}

impl Row {
    fn new(
        (
            passes,
            tokens,
            last_tokens,
            (test, skeleton_weight),
            dense_threshold,
            skeleton_threshold,
            sharpness,
        ): Choice,
        last_matches: Matches,
        prior: Option<f64>,
    ) -> Self {
        let inference = InferenceConfig { passes, last_tokens: Some(last_tokens), last_matches, prior };
        let integration = IntegrationConfig {
            test,
            dense_threshold,
            skeleton_threshold,
            sharpness,
            skeleton_weight,
            standard_errors: None,
        };
        Self { tokens, inference, integration }
    }

    fn of_header(header: &SrrfConfig) -> Self {
        Self {
            tokens: header.dense.tokens,
            inference: header.inference.clone(),
            integration: header.integration.clone(),
        }
    }

    fn all(wanted: Rows, header: &SrrfConfig) -> Vec<Self> {
        let of = |part: Rows| wanted == part || wanted == Rows::All;
        let mean = MEAN.iter().map(|&choice| Self::new(choice, Matches::Mean, None));
        let best = BEST.iter().map(|&choice| Self::new(choice, Matches::Best, None));
        let prior =
            PRIOR.iter().map(|&(deviation, choice)| Self::new(choice, Matches::Best, Some(deviation)));
        let mean = mean.filter(|_| of(Rows::Mean));
        let header = of(Rows::Header).then(|| Self::of_header(header));
        header
            .into_iter()
            .chain(mean)
            .chain(best.filter(|_| of(Rows::Best)))
            .chain(prior.filter(|_| of(Rows::Prior)))
            .collect()
    }

    fn describe(&self) -> String {
        let InferenceConfig { passes, last_tokens, last_matches, prior } = &self.inference;
        let IntegrationConfig {
            test,
            dense_threshold,
            skeleton_threshold,
            sharpness,
            skeleton_weight,
            standard_errors,
        } = &self.integration;
        let ahead = standard_errors.map(|z| format!(", ahead by {z} standard errors")).unwrap_or_default();
        let less = if *skeleton_weight < 1.0 { format!(", times {skeleton_weight}") } else { String::new() };
        let near = prior.map(|deviation| format!(", prior {deviation}")).unwrap_or_default();
        let (tokens, last_tokens) = (self.tokens, last_tokens.unwrap_or(self.tokens));
        format!(
            "{passes} | {tokens} | {last_tokens} {last_matches:?}{near} | {test:?} {dense_threshold} \
             {skeleton_threshold}{less}{ahead} | {sharpness}"
        )
    }
}

#[allow(clippy::print_stdout, reason = "an example that prints a table")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    keep_freed_memory();
    let arguments = Arguments::parse();
    let config = <TrainConfig>::read(&arguments.config)?;
    let pairs = TrainingPairs::new(&config, training_shapes(&config, arguments.data.as_deref(), None)?)?;
    let mut held_out: Vec<Pair> = Vec::new();
    for &severity in &arguments.severities {
        held_out.extend(pairs.validation(Severity::try_from(severity)?)?);
    }
    if arguments.keep < 1.0 {
        held_out.iter_mut().enumerate().try_for_each(|(i, pair)| cut(pair, arguments.keep, i as u64))?;
    }
    let workers = Workers::new(std::thread::available_parallelism().map_or(1, usize::from))?;
    println!(
        "{}; {} pairs at severities {:?}, {} of each cloud kept; RMSE / MAE / median of R in degrees",
        pairs.description(),
        held_out.len(),
        arguments.severities,
        arguments.keep
    );
    let columns: &[&str] = match arguments.alone {
        true => &["dense alone", "skeleton alone"],
        false => &["dense", "skeleton", "fused", "the better branch"],
    };
    println!(
        "| passes | tokens | last pass | inlier test | sharpness | {} |\n|{}",
        columns.join(" | "),
        "---|".repeat(5 + columns.len())
    );
    let device = device("flex")?;
    let opened = embedded::open(&arguments.weights, &device)?;
    for row in Row::all(arguments.rows, &opened.config) {
        let mut loaded = opened.clone();
        loaded.model.dense = loaded.model.dense.with_tokens(row.tokens);
        loaded.config.integration = row.integration.clone();
        loaded.config.inference = row.inference.clone();
        let network = || SrrfRegister::new(loaded.clone(), device.clone());
        let errors = match arguments.alone {
            true => {
                let alone = |branch| errors_of(&network().alone(branch), &held_out, &workers, own);
                [alone(BranchKind::Dense)?, alone(BranchKind::Skeleton)?].concat()
            }
            false => errors_of(&network(), &held_out, &workers, of_both)?,
        };
        println!("| {} | {} |", row.describe(), scores(&errors, |_| true)?);
        if arguments.by_corruption {
            for kind in std::iter::once(None).chain(CorruptionKind::ALL.map(Some)) {
                let name = kind.map_or("clean", |kind: CorruptionKind| kind.name());
                let of_kind = |i: usize| held_out[i].corruption.map(|(kind, _)| kind) == kind;
                if (0..held_out.len()).any(of_kind) {
                    println!("| {name} | | | | | {} |", scores(&errors, of_kind)?);
                }
            }
        }
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

/// The poses of an answer that are scored, one a column; the truth is there to choose by.
type Columns<const N: usize> = fn(&Registration, &Rigid) -> [Option<Rigid>; N];

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
    columns: Columns<N>,
) -> Result<Vec<Vec<PoseError>>, Box<dyn std::error::Error>> {
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
