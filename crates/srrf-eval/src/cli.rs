//! Command line options, and the run that they ask for.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::{CommandFactory, Parser, Subcommand};
use serde::de::DeserializeOwned;
use srrf_args::Scripts;
use srrf_args::flags::{MOST_POINTS, MOST_SHAPES, MOST_THREADS, Threads, help, value};
use srrf_args::numbers::{entry, real, whole};
use srrf_corrupt::cli::ReadingArgs;
use srrf_corrupt::{CorruptionKind, PairConfig, RotationRange, Severity};

use crate::EvalError;
use crate::TablesOptions;
use crate::methods::registry;
use crate::protocol::{CLEAN, Protocol};

/// Shapes scored when `--shapes` is not given.
const DEFAULT_SHAPES: usize = 20;

/// Scores registration methods on clean and corrupted pairs, and writes tables and curves.
///
/// Without --data (and without $SRRF_DATA) it uses shapes that it makes itself.
#[derive(Debug, Clone, Parser)]
#[command(name = "srrf-eval", version, after_help = EXAMPLES, args_conflicts_with_subcommands = true)]
pub struct Options {
    /// Something else than the plain tables.
    #[command(subcommand)]
    pub command: Option<Command>,

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
        long_help = format!("{}\n\n[default: identity, icp, oracle and the network with its branches]", help::METHODS)
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
pub enum Command {
    /// All tables and figures of the paper and of our ablations, and one page to look at them
    Tables(Box<TablesOptions>),
    /// Completions and manual pages
    #[command(flatten)]
    Scripts(Scripts),
}

/// The program's arguments, for tests that compare the programs.
pub fn command() -> clap::Command {
    Options::command()
}

/// More about `--data`.
pub(crate) const TEST_SPLIT: &str = "The test split is used. Without data, built-in shapes are made";

/// More about `--weights`.
pub(crate) const OF_BASELINES: &str =
    "METHOD=FILE for those of a learned baseline. May be given more than once";

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

impl Options {
    /// The pairs that the options ask for.
    ///
    /// # Errors
    /// [`EvalError`] names the option that cannot be used.
    pub fn protocol(&self) -> Result<Protocol, EvalError> {
        let named = |name: &String| (name != CLEAN).then(|| name.parse::<CorruptionKind>());
        let mut corruptions: Vec<CorruptionKind> =
            self.corruptions.iter().filter_map(named).collect::<Result<_, _>>()?;
        if self.corruptions.is_empty() && !self.clean_only {
            corruptions = CorruptionKind::ALL.to_vec();
        }
        corruptions.sort_unstable();
        corruptions.dedup();
        let mut severities = self.severities.clone();
        if severities.is_empty() {
            severities = Severity::ALL.to_vec();
        }
        severities.sort_unstable();
        severities.dedup();
        Ok(Protocol {
            clean: self.corruptions.is_empty() || self.corruptions.iter().any(|c| c == CLEAN),
            corruptions,
            mixtures: Vec::new(),
            severities,
            shapes: self.shapes,
            seed: self.seed,
            pair: self.pair_config()?,
            crop: self.crop,
            dcp_poses: self.rotation == "dcp",
            spread: self.spread,
        })
    }

    fn pair_config(&self) -> Result<PairConfig, EvalError> {
        let default = PairConfig::default();
        let rotation = match self.rotation.as_str() {
            "dcp" => default.rotation,
            "so3" => RotationRange::So3,
            degrees => {
                let max_deg = degrees.parse::<f64>().map_err(|_| {
                    EvalError::Usage(format!(
                        "--rotation {degrees}: give the largest Euler angle in degrees, `so3` or `dcp`"
                    ))
                })?;
                RotationRange::EulerAxes { max_deg }
            }
        };
        let sampling = if self.independent { "independent" } else { &self.sampling };
        Ok(PairConfig {
            corrupt: switch("--corrupt", &self.corrupt)?,
            sampling: switch("--sampling", sampling)?,
            normalize: switch("--normalize", &self.normalize)?,
            rotation,
            translation: self.translation,
            points: self.points,
            keep_correspondence: true,
            variants: self.reading.variants(),
        })
    }

    /// `--weights` by method: `METHOD=PATH`, or a path alone for srrf.
    pub fn weights_by_method(&self) -> BTreeMap<String, PathBuf> {
        weights_by_method(&self.weights)
    }

    /// Number of worker threads.
    pub fn thread_count(&self) -> usize {
        Threads { threads: self.threads }.count()
    }
}

/// Weights by method: `METHOD=PATH`, or a path alone for srrf.
pub(crate) fn weights_by_method(weights: &[String]) -> BTreeMap<String, PathBuf> {
    let split = |text: &String| match text.split_once('=') {
        Some((method, path)) if registry().iter().any(|m| m.name == method) => {
            (method.to_owned(), path.into())
        }
        _ => ("srrf".to_owned(), text.into()),
    };
    weights.iter().map(split).collect()
}

/// A switch of [`PairConfig`] by its name in configs.
fn switch<T: DeserializeOwned>(option: &str, name: &str) -> Result<T, EvalError> {
    serde_json::from_value(name.into()).map_err(|e| EvalError::Usage(format!("{option} {name}: {e}")))
}

#[cfg(test)]
mod tests {
    use srrf_corrupt::{Corrupt, Normalize, Sampling, Variants};

    use super::*;

    fn parse(arguments: &str) -> Options {
        Options::try_parse_from(["srrf-eval"].into_iter().chain(arguments.split_whitespace())).unwrap()
    }

    #[test]
    fn the_options_are_consistent() {
        Options::command().debug_assert();
    }

    #[test]
    fn by_default_everything_is_scored() {
        let protocol = parse("").protocol().unwrap();
        assert!(protocol.clean && !protocol.dcp_poses);
        assert_eq!(protocol.corruptions, CorruptionKind::ALL);
        assert_eq!(protocol.severities, Severity::ALL);
        assert_eq!(protocol.pair, PairConfig::default());
    }

    #[test]
    fn every_switch_reaches_the_protocol() {
        let protocol = parse(
            "--corruptions cutout,gaussian,cutout --severities 5,1 --shapes 9 --seed 4 --points 200 \
             --independent --corrupt target --crop 0.7 --normalize after_pose --rotation so3 --translation 0.25 \
             --reading modelnet40_c",
        )
        .protocol()
        .unwrap();
        assert_eq!(protocol.corruptions, [CorruptionKind::Cutout, CorruptionKind::Gaussian]);
        assert_eq!(protocol.severities, [Severity::ALL[0], Severity::ALL[4]]);
        assert!(!protocol.clean);
        assert_eq!((protocol.shapes, protocol.seed, protocol.pair.points), (9, 4, 200));
        assert_eq!(protocol.pair.sampling, Sampling::Independent);
        assert_eq!(protocol.pair.corrupt, Corrupt::Target);
        assert_eq!(protocol.crop, Some(0.7));
        assert_eq!(protocol.pair.normalize, Normalize::AfterPose);
        assert_eq!(protocol.pair.rotation, RotationRange::So3);
        assert_eq!(protocol.pair.translation, 0.25);
        assert_eq!(protocol.pair.variants, Variants::modelnet40_c());
        assert!(parse("--rotation dcp").protocol().unwrap().dcp_poses);
        let clean = parse("--clean-only").protocol().unwrap();
        assert!(clean.clean && clean.corruptions.is_empty());
        let clean = parse("--corruptions clean").protocol().unwrap();
        assert!(clean.clean && clean.corruptions.is_empty());
    }

    #[test]
    fn weights_belong_to_methods() {
        let found = parse("--weights a=b.safetensors --weights dcp=c=d").weights_by_method();
        assert_eq!(found["srrf"], PathBuf::from("a=b.safetensors"), "no method is called a");
        assert_eq!(found["dcp"], PathBuf::from("c=d"));
        assert!(parse("").weights_by_method().is_empty());
    }

    #[test]
    fn bad_values_are_named() {
        let message = |arguments: &str| parse(arguments).protocol().unwrap_err().to_string();
        assert!(message("--corruptions rain").contains("`rain`"));
        assert!(message("--corruptions rain").contains("or `clean`"));
        assert!(message("--rotation far").contains("--rotation far"));
        let refused = |arguments: &str| {
            let words = ["srrf-eval"].into_iter().chain(arguments.split_whitespace());
            Options::try_parse_from(words).unwrap_err().to_string()
        };
        for (arguments, parts) in [
            ("--severities 9", ["--severities", "severity 9"]),
            ("--severities 3;5", ["--severities", "apart by commas: 3,5"]),
            ("--corruptions cutout;shear", ["--corruptions", "apart by commas: cutout,shear"]),
            ("--shapes 0", ["--shapes <N>", "from 1 to"]),
            ("--threads 0", ["--threads <N>", "from 1 to 4,096"]),
            ("--points 2", ["--points <N>", "from 3 to"]),
            ("--seed -1", ["--seed <N>", "from 0 to"]),
            ("--translation nan", ["--translation <LENGTH>", "from 0 to"]),
        ] {
            let message = refused(arguments);
            assert!(parts.iter().all(|part| message.contains(part)), "{message}");
        }
    }
}
