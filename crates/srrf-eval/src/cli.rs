//! Command line options, and the run that they ask for.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::{Parser, Subcommand};
use serde::de::DeserializeOwned;
use srrf_corrupt::{CorruptionKind, PairConfig, RotationRange, Severity, Variants};

use crate::EvalError;
use crate::TablesOptions;
use crate::methods::METHODS;
use crate::synthesized::{CLEAN, Protocol};

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

    /// ModelNet40, or a folder of shapes; its test split is used [default: $SRRF_DATA, or built-in
    /// shapes]
    #[arg(long, value_name = "PATH")]
    pub data: Option<PathBuf>,

    /// Number of shapes, spread evenly over the data; each is scored in every group
    #[arg(long, value_name = "N", default_value_t = DEFAULT_SHAPES)]
    pub shapes: usize,

    /// Corruptions, and `clean` [default: clean and all twelve]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub corruptions: Vec<String>,

    /// Only clean pairs
    #[arg(long, conflicts_with_all = ["corruptions", "severities"])]
    pub clean_only: bool,

    /// Severities, 1 to 5 [default: all]
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',')]
    pub severities: Vec<u8>,

    /// Each shape at one severity only, the severities in turn: many shapes in a fraction of the time
    #[arg(long)]
    pub spread: bool,

    /// Rows of the tables [default: identity, icp, oracle and the network with its branches]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub methods: Vec<String>,

    /// Seed of the pairs: corruptions, poses and order of the points
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,

    /// Where the network runs: `flex` (CPU), and `ndarray`, `wgpu`, `vulkan`, `cuda`, `libtorch` where built in
    #[arg(long, value_name = "NAME", default_value = "flex")]
    pub device: String,

    /// Print at the end what time each method, and each stage of the network in it, took, over all threads
    #[arg(long)]
    pub profile: bool,

    /// Trained weights of srrf: a file, or `srrf`, `srrf-small` or `srrf-shapes` in the program [default:
    /// srrf]; or METHOD=PATH for those of a learned baseline. May be given more than once
    #[arg(long, value_name = "PATH")]
    pub weights: Vec<String>,

    /// Worker threads [default: all cores]. Results do not depend on it
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// Folder for the report
    #[arg(long, value_name = "DIR", default_value = "report")]
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

    /// Points of each cloud
    #[arg(long, value_name = "N", default_value_t = 1024)]
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

    /// Box normalisation after a corruption
    #[arg(long, value_name = "WHEN", value_parser = ["none", "canonical", "after_pose"], default_value = "none")]
    pub normalize: String,

    /// Range of the rotation: largest Euler angle in degrees, `so3` for all rotations, or `dcp` for
    /// the test poses of DCP (which fix the translation too)
    #[arg(long, value_name = "RANGE", default_value = "45")]
    pub rotation: String,

    /// Largest translation along each axis
    #[arg(long, value_name = "LENGTH", default_value_t = 0.5)]
    pub translation: f64,

    /// Reading of the corruptions where the paper's text and the reference code differ
    #[arg(long, value_name = "WHICH", value_parser = ["paper", "modelnet40_c"], default_value = "paper")]
    pub variants: String,
}

/// What the program does beside scoring one protocol.
#[derive(Debug, Clone, Subcommand)]
pub enum Command {
    /// All tables and figures of the paper and of our ablations, and one page to look at them
    Tables(Box<TablesOptions>),
}

const PAIR_OPTIONS: [&str; 13] = [
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

Exit code: 0 done, 1 failure, 2 bad usage or input.";

impl Options {
    /// The pairs that the options ask for.
    ///
    /// # Errors
    /// [`EvalError`] names the option that cannot be used.
    pub fn protocol(&self) -> Result<Protocol, EvalError> {
        if self.shapes == 0 {
            return Err(EvalError::Usage("--shapes 0: at least one shape is needed".into()));
        }
        let named = |name: &String| (name != CLEAN).then(|| name.parse::<CorruptionKind>());
        let mut corruptions: Vec<CorruptionKind> =
            self.corruptions.iter().filter_map(named).collect::<Result<_, _>>()?;
        if self.corruptions.is_empty() && !self.clean_only {
            corruptions = CorruptionKind::ALL.to_vec();
        }
        corruptions.sort_unstable();
        corruptions.dedup();
        let mut severities: Vec<Severity> =
            self.severities.iter().map(|&s| Severity::try_from(s)).collect::<Result<_, _>>()?;
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
            variants: if self.variants == "paper" { Variants::paper() } else { Variants::modelnet40_c() },
        })
    }

    /// `--weights` by method: `METHOD=PATH`, or a path alone for srrf.
    pub fn weights_by_method(&self) -> BTreeMap<String, PathBuf> {
        weights_by_method(&self.weights)
    }

    /// Number of worker threads.
    ///
    /// # Errors
    /// [`EvalError::Usage`] for 0.
    pub fn thread_count(&self) -> Result<usize, EvalError> {
        match self.threads {
            Some(0) => Err(EvalError::Usage("--threads 0: at least one thread is needed".into())),
            Some(threads) => Ok(threads),
            None => Ok(std::thread::available_parallelism().map_or(1, usize::from)),
        }
    }
}

/// Weights by method: `METHOD=PATH`, or a path alone for srrf.
pub(crate) fn weights_by_method(weights: &[String]) -> BTreeMap<String, PathBuf> {
    let split = |text: &String| match text.split_once('=') {
        Some((method, path)) if METHODS.iter().any(|m| m.name == method) => (method.to_owned(), path.into()),
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
    use clap::CommandFactory;
    use srrf_corrupt::{Corrupt, Normalize, Sampling};

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
             --independent --corrupt target --normalize after_pose --rotation so3 --translation 0.25 \
             --variants modelnet40_c",
        )
        .protocol()
        .unwrap();
        assert_eq!(protocol.corruptions, [CorruptionKind::Cutout, CorruptionKind::Gaussian]);
        assert_eq!(protocol.severities, [Severity::ALL[0], Severity::ALL[4]]);
        assert!(!protocol.clean);
        assert_eq!((protocol.shapes, protocol.seed, protocol.pair.points), (9, 4, 200));
        assert_eq!(protocol.pair.sampling, Sampling::Independent);
        assert_eq!(protocol.pair.corrupt, Corrupt::Target);
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
        assert!(message("--severities 9").contains("severity 9"));
        assert!(message("--shapes 0").contains("at least one shape"));
        assert!(message("--rotation far").contains("--rotation far"));
        assert!(parse("--threads 0").thread_count().is_err());
    }
}
