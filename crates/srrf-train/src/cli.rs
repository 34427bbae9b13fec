//! The command line.

use std::path::PathBuf;

use clap::{CommandFactory, Parser, Subcommand};
use srrf_args::flags::{Data, Profile, Threads, help, value};
use srrf_args::numbers::{real, whole};
use srrf_args::{EXIT_CODES, Scripts};

/// Most minutes that a run may be given: a year.
const MOST_MINUTES: f64 = 525_600.0;

/// More about `--device`.
const SEVERAL_DEVICES: &str =
    "`cuda:0,cuda:1` trains on two [default: `device` of the configuration, or flex]";

/// Trains the SRRF network, or the learned baseline that the configuration names as its `method`.
///
/// Writes into the run's folder: the resolved config.toml, metrics.jsonl, curve.svg, a checkpoint,
/// and the weights `best.safetensors` (by validation) and `last.safetensors`. The data of `--data`
/// come before `data.path` of the configuration.
#[derive(Debug, Parser)]
#[command(
    name = "srrf-train",
    version,
    after_help = EXIT_CODES,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true
)]
pub struct Arguments {
    /// Something else than a training
    #[command(subcommand)]
    pub command: Option<Command>,

    /// The configuration, or a run of a list, LIST.toml#NAME; see configs/, lab/sweeps/, and `srrf-train keys`
    #[arg(long, value_name = value::FILE, required = true)]
    pub config: Option<PathBuf>,

    /// Path of the data, where one was given.
    #[command(flatten)]
    pub data: Data,

    /// Folder of the run [default: runs/NAME]
    #[arg(long, value_name = value::FOLDER)]
    pub run: Option<PathBuf>,

    /// Go on from the checkpoint in the run's folder, if there is one
    #[arg(long, conflicts_with = "restart")]
    pub resume: bool,

    /// Start over; the old run goes when the new one has its first checkpoint
    #[arg(long)]
    pub restart: bool,

    /// Stop when the run stands at this step
    #[arg(long, value_name = value::NUMBER, value_parser = whole(0, usize::MAX), allow_negative_numbers = true)]
    pub until_step: Option<usize>,

    /// Stop after this many minutes; --resume goes on
    #[arg(long, value_name = value::NUMBER, value_parser = real(0.0, MOST_MINUTES), allow_negative_numbers = true)]
    pub minutes: Option<f64>,

    /// Worker threads, where they were given.
    #[command(flatten)]
    pub threads: Threads,

    /// Name of the device.
    #[arg(
        long,
        value_name = value::DEVICE,
        help = help::DEVICE,
        long_help = format!("{}; {SEVERAL_DEVICES}", help::DEVICE)
    )]
    pub device: Option<String>,

    /// Whether times are wanted.
    #[command(flatten)]
    pub profile: Profile,
}

/// What the program does beside training.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// The reference of all keys of a configuration, as Markdown
    Keys,
    /// Completions and manual pages
    #[command(flatten)]
    Scripts(Scripts),
}

/// The program's arguments, for tests that compare the programs.
pub fn command() -> clap::Command {
    Arguments::command()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_out_of_range_name_their_flag() {
        command().debug_assert();
        let parse = |arguments: &str| {
            Arguments::try_parse_from(["srrf-train"].into_iter().chain(arguments.split_whitespace()))
                .map_err(|e| e.to_string())
        };
        for arguments in
            ["--minutes nan", "--minutes 1e300", "--minutes -1", "--threads 0", "--until-step -1"]
        {
            let flag = arguments.split(' ').next().unwrap();
            let message = parse(&format!("--config a.toml {arguments}")).unwrap_err();
            assert!(message.contains(flag) && message.contains("expected a"), "{message}");
        }
        assert!(parse("--threads 2").unwrap_err().contains("--config"));
        assert!(parse("completions bash").unwrap().command.is_some());
    }
}
