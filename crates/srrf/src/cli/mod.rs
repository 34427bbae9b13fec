//! The command line: one module a verb.

use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use srrf_args::{Failure, Scripts, interrupt};
use srrf_corrupt::cli::{CorruptArgs, corrupt};

mod align;
mod align_edges;
mod align_gather;
mod align_initial;
mod align_merge;
mod align_moved;
mod align_page;
mod align_places;
mod align_poses;
mod align_scans;
mod align_summary;
mod batch;
mod common;
mod inspect;
mod method;
mod outputs;
mod page;
mod poses;
mod register;
mod rrd;
mod scale;
mod scans;
mod skeleton;
mod statistics;
mod strays;
mod summary;
mod surface;
mod values;
mod view;
mod watch;
mod weights;

use common::EXIT_CODES;

pub use common::to_json as answer_json;

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
    Batch(Box<batch::BatchArgs>),
    Summary(batch::SummaryArgs),
    Align(Box<align::AlignArgs>),
    View(Box<view::ViewArgs>),
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

/// The arguments as the program takes them: two files without a verb are registered, as `srrf a.ply b.ply`.
pub fn arguments(given: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = given.into_iter().collect();
    let verb =
        |first: &OsString| first.to_str().is_some_and(|name| command().find_subcommand(name).is_some());
    if arguments.get(1).is_some_and(|first| Path::new(first).is_file() && !verb(first)) {
        arguments.insert(1, "register".into());
    }
    arguments
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
        Command::Summary(args) => batch::summary(&args),
        Command::Align(args) => align::run(&args),
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
    fn two_files_alone_are_registered() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let given = ["srrf".into(), file.path().as_os_str().to_owned(), "b.ply".into()];
        let taken = super::arguments(given.clone());
        assert_eq!((&taken[0], &taken[1], &taken[2..]), (&given[0], &"register".into(), &given[1..]));
        for verb in ["inspect", "--version", "no-file.ply"] {
            let given: Vec<std::ffi::OsString> = vec!["srrf".into(), verb.into(), "b.ply".into()];
            assert_eq!(super::arguments(given.clone()), given);
        }
    }

    #[test]
    fn options_do_not_clash() {
        super::command().debug_assert();
    }
}
