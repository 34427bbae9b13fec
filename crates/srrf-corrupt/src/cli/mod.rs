//! The command line of `srrf-corrupt`, and the verb `corrupt` that `srrf` has too.

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use srrf_args::{EXIT_CODES, Failure, Scripts, interrupt};

mod canvas;
mod corrupt;
mod draw;
mod list;
mod reading;
mod sheet;

pub use corrupt::{CorruptArgs, corrupt};
pub use reading::{Reading, ReadingArgs};

/// Corrupts point clouds in the twelve ways of the SRRF paper.
///
/// The cloud is brought to the unit sphere, corrupted there, and mapped back.
#[derive(Debug, Parser)]
#[command(
    name = "srrf-corrupt",
    version,
    after_help = EXIT_CODES,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true
)]
pub struct CorruptCli {
    #[command(subcommand)]
    command: Option<Verb>,
    #[command(flatten)]
    corrupt: CorruptArgs,
}

/// What can be done besides corrupting a file.
#[derive(Debug, Subcommand)]
enum Verb {
    Sheet(Box<sheet::SheetArgs>),
    #[command(flatten)]
    Scripts(Scripts),
}

/// The program's arguments, for tests that compare the programs.
pub fn command() -> clap::Command {
    CorruptCli::command()
}

/// Does what was asked.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn run(cli: CorruptCli) -> Result<ExitCode, Failure> {
    interrupt::install()?;
    match cli.command {
        Some(Verb::Sheet(args)) => sheet::sheet(&args),
        Some(Verb::Scripts(scripts)) => scripts.run(command()),
        None => corrupt(&cli.corrupt),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn options_do_not_clash() {
        super::command().debug_assert();
    }
}
