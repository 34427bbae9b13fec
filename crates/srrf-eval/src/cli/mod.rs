//! Command line options, and the run that they ask for.

mod asked;
pub(crate) mod shared;

use std::path::PathBuf;

use clap::{CommandFactory, Parser, Subcommand};
use srrf_args::Scripts;
use srrf_args::flags::{MOST_POINTS, MOST_SHAPES, MOST_THREADS, help, value};
use srrf_args::numbers::{bytes, entry, real, whole};
use srrf_corrupt::Severity;
use srrf_corrupt::cli::ReadingArgs;

use self::shared::{OF_BASELINES, TEST_SPLIT};
use crate::TablesOptions;

/// Shapes scored when `--shapes` is not given: a first look, in minutes, since the product is among the rows.
const DEFAULT_SHAPES: usize = 4;

/// Scores registration methods on clean and corrupted pairs, and writes tables and curves.
///
/// Without --data (and without $SRRF_DATA) it uses shapes that it makes itself.
#[derive(Debug, Clone, Parser)]
#[command(name = "srrf-eval", version, after_help = EXAMPLES, args_conflicts_with_subcommands = true)]
pub struct EvalOptions {
    /// Something else than the plain tables.
    #[command(subcommand)]
    pub command: Option<EvalCommand>,

    /// Path of the data, where one was given.
    #[arg(long, value_name = value::PATH, help = help::DATA, long_help = format!("{}\n\n{TEST_SPLIT}", help::DATA))]
    pub data: Option<PathBuf>,

    /// Number of shapes.
    #[arg(
        long,
        value_name = value::NUMBER,
        default_value_t = DEFAULT_SHAPES,
        value_parser = whole(1, MOST_SHAPES),
        allow_negative_numbers = true,
        help = help::SHAPES
    )]
    pub shapes: usize,

    /// Corruptions, and `clean` [default: clean and all twelve]
    #[arg(long, value_name = value::NAMES, value_delimiter = ',', value_parser = entry::<String>)]
    pub corruptions: Vec<String>,

    /// Only clean pairs
    #[arg(long, conflicts_with_all = ["corruptions", "severities"])]
    pub clean_only: bool,

    /// Severities, 1 to 5 [default: all]
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', value_parser = entry::<Severity>)]
    pub severities: Vec<Severity>,

    /// Whether each shape is shown at one severity only.
    #[arg(long, help = help::SPREAD, long_help = format!("{}: many shapes in a fraction of the time", help::SPREAD))]
    pub spread: bool,

    /// Rows of the tables.
    #[arg(
        long,
        value_name = value::NAMES,
        value_delimiter = ',',
        value_parser = entry::<String>,
        help = help::METHODS,
        long_help = format!("{}\n\n[default: identity, icp, oracle, the network with its branches, srrf-register and srrf-register-45]", help::METHODS)
    )]
    pub methods: Vec<String>,

    /// The seed.
    #[arg(
        long,
        value_name = value::NUMBER,
        default_value_t = 1,
        value_parser = whole(0, u64::MAX),
        allow_negative_numbers = true,
        help = help::SEED
    )]
    pub seed: u64,

    /// Name of the device.
    #[arg(long, value_name = value::DEVICE, default_value = "flex", help = help::DEVICE)]
    pub device: String,

    /// Whether times are wanted.
    #[arg(long, help = help::PROFILE)]
    pub profile: bool,

    /// Name or file of the weights, where one was given.
    #[arg(
        long,
        value_name = value::WEIGHTS,
        help = help::WEIGHTS,
        long_help = format!("{}\n\n{OF_BASELINES}", help::WEIGHTS)
    )]
    pub weights: Vec<String>,

    /// Worker threads, where they were given.
    #[arg(
        long,
        value_name = value::NUMBER,
        value_parser = whole(1, MOST_THREADS),
        allow_negative_numbers = true,
        help = help::THREADS
    )]
    pub threads: Option<usize>,

    /// Folder for the report
    #[arg(short, long = "output", alias = "out", value_name = value::FOLDER, default_value = "report")]
    pub out: PathBuf,

    /// Score the pairs of this file instead of making pairs
    #[arg(long, value_name = "FILE.npz", conflicts_with_all = PAIR_OPTIONS)]
    pub pairs: Option<PathBuf>,

    /// Write the pairs of this run to a file
    #[arg(long, value_name = "FILE.npz")]
    pub export_pairs: Option<PathBuf>,

    /// Score transforms that another tool made on the same pairs (.npz, .npy or .json); may be
    /// given more than once
    #[arg(long, value_name = "FILE")]
    pub transforms: Vec<PathBuf>,

    /// Most memory that reading --pairs or --transforms may take, such as `4G` [default: half of the machine's]
    #[arg(long, value_name = "SIZE", value_parser = bytes)]
    pub max_memory: Option<u64>,

    /// Points of each cloud.
    #[arg(
        long,
        value_name = value::NUMBER,
        default_value_t = 1024,
        value_parser = whole(3, MOST_POINTS),
        allow_negative_numbers = true,
        help = help::POINTS
    )]
    pub points: usize,

    /// Whether source and target start from the same points of the shape
    #[arg(long, value_name = "HOW", value_parser = ["shared", "independent"], default_value = "shared")]
    pub sampling: String,

    /// The same as --sampling independent
    #[arg(long, conflicts_with = "sampling")]
    pub independent: bool,

    /// Which cloud is corrupted
    #[arg(long, value_name = "WHICH", value_parser = ["both", "source", "target"], default_value = "both")]
    pub corrupt: String,

    /// Keep this share of each cloud, after the corruption: the points farthest along a random direction, another one for each
    /// cloud; 0.7 is RPMNet's partial overlap [default: all of both]
    #[arg(long, value_name = "SHARE", value_parser = real(0.01, 1.0), allow_negative_numbers = true)]
    pub crop: Option<f64>,

    /// Box normalisation after a corruption
    #[arg(long, value_name = "WHEN", value_parser = ["none", "canonical", "after_pose"], default_value = "none")]
    pub normalize: String,

    /// Range of the rotation.
    #[arg(
        long,
        value_name = value::ROTATION,
        default_value = "45",
        help = help::ROTATION,
        long_help = format!("{}\n\n{OF_POSES}", help::ROTATION)
    )]
    pub rotation: String,

    /// Largest translation along each axis
    #[arg(
        long,
        value_name = "LENGTH",
        default_value_t = 0.5,
        value_parser = real(0.0, 1e6),
        allow_negative_numbers = true
    )]
    pub translation: f64,

    /// Reading of the corruptions.
    #[command(flatten)]
    pub reading: ReadingArgs,
}

/// What the program does beside scoring one protocol.
#[derive(Debug, Clone, Subcommand)]
pub enum EvalCommand {
    /// All tables and figures of the paper and of our ablations, and one page to look at them
    Tables(Box<TablesOptions>),
    /// Completions and manual pages
    #[command(flatten)]
    Scripts(Scripts),
}

/// The program's arguments, for tests that compare the programs.
pub fn command() -> clap::Command {
    EvalOptions::command()
}

/// More about `--rotation`.
const OF_POSES: &str = "Here degrees are the largest of each Euler angle; `dcp` takes the test poses of DCP, which fix \
     the translation too";

const PAIR_OPTIONS: [&str; 14] = [
    "data",
    "spread",
    "shapes",
    "corruptions",
    "clean_only",
    "severities",
    "points",
    "sampling",
    "independent",
    "corrupt",
    "crop",
    "normalize",
    "rotation",
    "translation",
];

const EXAMPLES: &str = "\
Examples:
  srrf-eval                                     built-in shapes, all corruptions
  srrf-eval --data modelnet40_ply_hdf5_2048     the test split of ModelNet40
  srrf-eval --corruptions clean,cutout --severities 3,5 --methods icp,oracle
  srrf-eval tables --data PATH --shapes 100     the paper's tables and figures, and a page of them
  srrf-eval --export-pairs pairs.npz            then run another tool on them, and
  srrf-eval --pairs pairs.npz --transforms tool.npz

Exit codes:
  0    done
  1    failure, such as a report that could not be written
  2    bad usage or input
  130  interrupted; `tables` goes on where it stopped";
