//! The options of `srrf-eval tables`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use srrf_args::flags::{MOST_POINTS, MOST_SHAPES, MOST_THREADS, help, value};
use srrf_args::numbers::{entry, whole};
use srrf_args::{Failure, Places};
use srrf_model::embedded;

use crate::cli::shared::{OF_BASELINES, TEST_SPLIT, weights_by_method};

/// Makes all tables and figures of the report: the paper's tables 1 to 5 with its own numbers beside
/// ours, the ablations that need no training, severity curves, and one page to look at it all.
///
/// Answers are kept as they come: the same command goes on where a kill stopped it, and a second run
/// computes nothing.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub struct TablesOptions {
    /// Path of the data, where one was given.
    #[arg(long, value_name = value::PATH, help = help::DATA, long_help = format!("{}\n\n{TEST_SPLIT}", help::DATA))]
    pub data: Option<PathBuf>,

    /// Number of shapes.
    #[arg(
        long,
        value_name = value::NUMBER,
        value_parser = whole(1, MOST_SHAPES),
        allow_negative_numbers = true,
        help = help::SHAPES,
        long_help = format!("{}\n\n{ALL_SHAPES}", help::SHAPES)
    )]
    pub shapes: Option<usize>,

    /// Whether each shape is shown at one severity only.
    #[arg(long, help = help::SPREAD, long_help = format!("{}\n\n{SPREAD_TABLES}", help::SPREAD))]
    pub spread: bool,

    /// Rows of the tables.
    #[arg(
        long,
        value_name = value::NAMES,
        value_delimiter = ',',
        value_parser = entry::<String>,
        help = help::METHODS,
        long_help = format!("{}\n\n{ROWS_LEFT_OUT}", help::METHODS)
    )]
    pub methods: Vec<String>,

    /// Parts to make [default: all]
    #[arg(long, value_name = value::NAMES, value_delimiter = ',', value_parser = PARTS)]
    pub parts: Vec<String>,

    /// Name or file of the weights, where one was given.
    #[arg(
        long,
        value_name = value::WEIGHTS,
        help = help::WEIGHTS,
        long_help = format!("{}\n\n{OF_BASELINES}", help::WEIGHTS)
    )]
    pub weights: Vec<String>,

    /// Weights that were trained on clean pairs only, in the same form, for the tables of models trained
    /// clean [default: srrf-clean, if the program has it]
    #[arg(long, value_name = "PATH")]
    pub clean_weights: Vec<String>,

    /// Weights that were trained with the distribution distance loss, for table 5, where they are not those of
    /// `--weights` [default: srrf-ddl, which the program has]
    #[arg(long, value_name = "PATH")]
    pub ddl_weights: Option<PathBuf>,

    /// Weights that were trained without the distribution distance loss and otherwise in the same way, for table 5
    /// [default: srrf-no-ddl, which the program has]
    #[arg(long, value_name = "PATH")]
    pub no_ddl_weights: Option<PathBuf>,

    /// Networks that were trained otherwise, such as `64 points=FILE`: each is compared with the default
    /// weights at severity 3. May be given more than once
    #[arg(long, value_name = "NAME=PATH", value_parser = named_weights)]
    pub variant: Vec<(String, PathBuf)>,

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

    /// Name of the device.
    #[arg(long, value_name = value::DEVICE, default_value = "flex", help = help::DEVICE)]
    pub device: String,

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

    /// Write the tables as pages of a book into this folder too, their pictures beside them, and `numbers.json`, every printed
    /// number by its key
    #[arg(long, value_name = value::FOLDER)]
    pub book: Option<PathBuf>,

    /// Folder for the answers that are kept [default: `cache` in the report's folder]
    #[arg(long, value_name = value::FOLDER)]
    pub cache: Option<PathBuf>,
}

/// More about `--shapes`.
const ALL_SHAPES: &str = "[default: all, or 20 built-in shapes]. All of ModelNet40's test split takes half a day on \
     two idle cores";

/// More about `--spread`.
const SPREAD_TABLES: &str = "This is for the tables of models: five times the shapes in the same time. Curves, \
     ablations and tables 4 and 5, which compare the same shapes, take a fifth of them";

/// More about `--methods`.
const ROWS_LEFT_OUT: &str = "[default: the paper's methods, and ours]. Those without weights are left out, and the \
     report says so";

/// Names of the parts of the report.
pub(crate) const PARTS: [&str; 11] = [
    "main",
    "severity",
    "partial",
    "clean-trained",
    "table4",
    "table5",
    "one-sided",
    "independent",
    "beyond",
    "mixtures",
    "thresholds",
];

const EXAMPLES: &str = "\
Examples:
  srrf-eval tables                                    built-in shapes, a first look
  srrf-eval tables --data PATH --shapes 20            20 shapes of the test split, each at all severities
  srrf-eval tables --data PATH --shapes 100 --spread  100 shapes, each at one severity in turn
  srrf-eval tables --data PATH --methods icp,oracle,srrf --parts main,beyond";

/// `NAME=PATH`.
fn named_weights(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((name, path)) if !name.is_empty() && !path.is_empty() => Ok((name.to_owned(), path.into())),
        _ => Err("expected a name, `=` and a file of weights or the name of a model".into()),
    }
}

impl TablesOptions {
    /// Checks that no file or folder is written twice, or read as well.
    ///
    /// # Errors
    /// [`Failure::usage`], which names both.
    pub fn check_places(&self) -> Result<(), Failure> {
        let weights = [&self.ddl_weights, &self.no_ddl_weights].into_iter().flatten();
        let variants = self.variant.iter().map(|(_, path)| path);
        let mut places = Places::new();
        for path in weights.chain(variants).filter(|path| path.is_file()) {
            places = places.reads("the weights", &**path);
        }
        for name in ["report.html", "tables.md", "results.json"] {
            places = places.writes_into("--output", &self.out, name);
        }
        places = places.fills("--output", &*self.out).fills("--book", self.book.as_deref());
        places.fills("--cache", self.cache.as_deref()).check()
    }

    /// The models trained clean, by method; empty where there are none.
    pub(crate) fn clean_models(&self) -> BTreeMap<String, PathBuf> {
        let mut models = weights_by_method(&self.clean_weights);
        if let (true, Some(name)) = (models.is_empty(), model_or(None, "srrf-clean")) {
            models.insert("srrf".to_owned(), name);
        }
        models
    }

    /// The network of table 5 that was trained with the loss; `None` for the one of `--weights`.
    pub(crate) fn with_loss(&self) -> Option<PathBuf> {
        model_or(self.ddl_weights.as_deref(), "srrf-ddl")
    }

    /// The network of table 5 that was trained without the loss, if there is one.
    pub(crate) fn without_loss(&self) -> Option<PathBuf> {
        model_or(self.no_ddl_weights.as_deref(), "srrf-no-ddl")
    }

    /// Whether a part is to be made.
    pub(crate) fn wants(&self, part: &str) -> bool {
        self.parts.is_empty() || self.parts.iter().any(|p| p == part)
    }

    /// The folder of the answers.
    pub(crate) fn cache_folder(&self) -> PathBuf {
        self.cache.clone().unwrap_or_else(|| self.out.join("cache"))
    }
}

/// The weights that an option gives, or a model of the program of this name, if there is one.
fn model_or(option: Option<&Path>, name: &str) -> Option<PathBuf> {
    let built_in = || embedded::contains(name).then(|| PathBuf::from(name));
    option.map(Path::to_owned).or_else(built_in)
}
