//! Flags that several programs have. Those with one type are groups to flatten; of the others the name of the
//! value and the first line of the help are here, and a test compares what the programs say.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::failure::Failure;
use crate::numbers::whole;
use crate::progress::{Progress, ProgressArgs};

/// Most worker threads that can be asked for.
pub const MOST_THREADS: usize = 4096;
/// Most points of a cloud that can be asked for.
pub const MOST_POINTS: usize = 10_000_000;
/// Most shapes of a data set that can be asked for.
pub const MOST_SHAPES: usize = 10_000_000;

/// First lines of the help.
pub mod help {
    /// `--threads`
    pub const THREADS: &str = "Worker threads [default: all cores]. Results do not depend on it";
    /// `--seed`
    pub const SEED: &str = "Seed of all random draws. The same seed gives the same result";
    /// `--data`
    pub const DATA: &str = "ModelNet40, or a folder of shapes [default: $SRRF_DATA]";
    /// `--weights`
    pub const WEIGHTS: &str =
        "Weights of the network: a file, or a name that `srrf weights` lists [default: srrf]";
    /// `--device`
    pub const DEVICE: &str = "Where the network runs: `flex` (CPU), and `ndarray`, `wgpu`, `vulkan`, `cuda`, `libtorch` where built in";
    /// `--rotation`
    pub const ROTATION: &str =
        "How far one cloud is turned against the other: a number of degrees, or `so3` for any rotation";
    /// `--points`
    pub const POINTS: &str = "Points of each cloud";
    /// `--shapes`
    pub const SHAPES: &str = "Number of shapes, spread evenly over the data";
    /// `--methods`
    pub const METHODS: &str = "Rows of the tables, apart by commas";
    /// `--spread`
    pub const SPREAD: &str = "Each shape at one severity only, the severities in turn";
    /// `--reading`
    pub const READING: &str =
        "Reading of the corruptions where the paper's text and the code of ModelNet40-C differ";
    /// `--profile`
    pub const PROFILE: &str = "Print at the end what time each stage took, over all threads";
    /// `--up`
    pub const UP: &str = "The axis that points up in the picture";
}

/// Names of values.
pub mod value {
    /// `--weights`
    pub const WEIGHTS: &str = "NAME|FILE";
    /// `--device`
    pub const DEVICE: &str = "NAME";
    /// `--rotation`
    pub const ROTATION: &str = "RANGE";
    /// `--methods`, `--corruptions` and other lists
    pub const NAMES: &str = "NAMES";
    /// `--up`
    pub const UP: &str = "AXIS";
    /// `--reading`
    pub const READING: &str = "WHICH";
    /// Whole numbers.
    pub const NUMBER: &str = "N";
    /// Folders.
    pub const FOLDER: &str = "DIR";
    /// Files.
    pub const FILE: &str = "FILE";
    /// Files or folders.
    pub const PATH: &str = "PATH";
}

/// `--threads`
#[derive(Debug, Clone, Copy, Args)]
pub struct Threads {
    /// Worker threads, where they were given.
    #[arg(
        long,
        value_name = value::NUMBER,
        value_parser = whole(1, MOST_THREADS),
        allow_negative_numbers = true,
        help = help::THREADS
    )]
    pub threads: Option<usize>,
}

impl Threads {
    /// As many as were asked for, or as there are cores.
    pub fn count(self) -> usize {
        self.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from))
    }

    /// Starts the worker threads of the process and answers how many they are.
    ///
    /// # Errors
    /// [`Failure`] where they cannot be started.
    pub fn start(self) -> Result<usize, Failure> {
        let mut builder = rayon::ThreadPoolBuilder::new();
        if let Some(count) = self.threads {
            builder = builder.num_threads(count);
        }
        builder.build_global().map_err(|e| {
            Failure::failed(format!("cannot start worker threads: {e}; try --threads 1")).because(e)
        })?;
        Ok(rayon::current_num_threads())
    }
}

/// What every verb takes that computes and then speaks.
#[derive(Debug, Clone, Copy, Args)]
pub struct Common {
    /// Worker threads, where they were given.
    #[command(flatten)]
    pub threads: Threads,

    /// Whether to say nothing but errors.
    #[command(flatten)]
    pub quiet: Quiet,

    /// How to show what is being done.
    #[command(flatten)]
    pub progress: ProgressArgs,
}

impl Common {
    /// Signs of life, as asked for.
    pub fn progress(&self) -> Progress {
        self.progress.start(self.quiet.quiet)
    }
}

/// `--quiet`
#[derive(Debug, Clone, Copy, Args)]
pub struct Quiet {
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// `--seed`
#[derive(Debug, Clone, Copy, Args)]
pub struct Seed<const DEFAULT: u64 = 0> {
    /// The seed.
    #[arg(
        long,
        value_name = value::NUMBER,
        default_value_t = DEFAULT,
        value_parser = whole(0, u64::MAX),
        allow_negative_numbers = true,
        help = help::SEED
    )]
    pub seed: u64,
}

/// `--device`
#[derive(Debug, Clone, Args)]
pub struct Device {
    /// Name of the device.
    #[arg(long, value_name = value::DEVICE, default_value = "flex", help = help::DEVICE)]
    pub device: String,
}

/// `--weights`
#[derive(Debug, Clone, Args)]
pub struct Weights {
    /// Name or file of the weights, where one was given.
    #[arg(long, value_name = value::WEIGHTS, help = help::WEIGHTS)]
    pub weights: Option<String>,
}

/// `--data`
#[derive(Debug, Clone, Args)]
pub struct Data {
    /// Path of the data, where one was given.
    #[arg(long, value_name = value::PATH, help = help::DATA)]
    pub data: Option<PathBuf>,
}

/// An axis that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Axis {
    /// As in the built-in shapes and most scans.
    Z,
    /// As in ModelNet40's HDF5 files.
    Y,
}

/// `--up`
#[derive(Debug, Clone, Copy, Args)]
pub struct UpAxis {
    /// The axis.
    #[arg(long, value_enum, value_name = value::UP, default_value_t = Axis::Z, help = help::UP)]
    pub up: Axis,
}

/// `--profile`
#[derive(Debug, Clone, Copy, Args)]
pub struct Profile {
    /// Whether times are wanted.
    #[arg(long, help = help::PROFILE)]
    pub profile: bool,
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory, Parser};

    use super::*;

    #[derive(Debug, Parser)]
    struct Program {
        #[command(flatten)]
        common: Common,
        #[command(flatten)]
        seed: Seed<7>,
        #[command(flatten)]
        device: Device,
    }

    fn parse(arguments: &str) -> Result<Program, String> {
        Program::try_parse_from(["p"].into_iter().chain(arguments.split_whitespace()))
            .map_err(|e| e.to_string())
    }

    #[test]
    fn numbers_out_of_range_name_their_flag() {
        Program::command().debug_assert();
        for (arguments, flag, way_out) in [
            ("--threads 0", "--threads <N>", "from 1 to 4,096"),
            ("--threads 1000000", "--threads <N>", "from 1 to 4,096"),
            ("--threads -1", "--threads <N>", "from 1 to 4,096"),
            ("--seed -1", "--seed <N>", "a whole number from 0 to 18,446,744,073,709,551,615"),
        ] {
            let message = parse(arguments).unwrap_err();
            assert!(message.contains(flag) && message.contains(way_out), "{message}");
        }
        let parsed = parse("-q").unwrap();
        assert_eq!((parsed.seed.seed, parsed.device.device.as_str()), (7, "flex"));
        assert!(parsed.common.quiet.quiet && parsed.common.threads.count() > 0);
    }
}
