//! The command line: one module a verb.

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use srrf_args::{Failure, Scripts, interrupt};
use srrf_corrupt::cli::{CorruptArgs, corrupt};

mod batch;
mod batch_output;
mod batch_pairs;
mod common;
mod inspect;
mod method;
mod page;
mod register;
mod rrd;
mod skeleton;
mod statistics;
mod summary;
mod transform;
mod view;
mod weights;

use common::EXIT_CODES;

/// Registers two point clouds, says whether it worked, and shows it.
#[derive(Debug, Parser)]
#[command(name = "srrf", version, after_help = EXIT_CODES)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Register(Box<register::RegisterArgs>),
    Inspect(inspect::InspectArgs),
    Batch(batch::BatchArgs),
    View(view::ViewArgs),
    Corrupt(CorruptArgs),
    Skeleton(skeleton::SkeletonArgs),
    Weights(weights::WeightsArgs),
    #[command(flatten)]
    Scripts(Scripts),
}

/// The program's arguments, for tests that compare the programs.
pub fn command() -> clap::Command {
    Cli::command()
}

/// Does what was asked.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn run(cli: Cli) -> Result<ExitCode, Failure> {
    interrupt::install()?;
    match cli.command {
        Command::Register(args) => register::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Batch(args) => batch::run(&args),
        Command::View(args) => view::run(&args),
        Command::Corrupt(args) => corrupt(&args),
        Command::Skeleton(args) => skeleton::run(&args),
        Command::Weights(args) => weights::run(&args),
        Command::Scripts(scripts) => scripts.run(command()),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn options_do_not_clash() {
        super::command().debug_assert();
    }
}
