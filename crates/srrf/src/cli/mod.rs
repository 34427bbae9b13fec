//! The command line: one module a verb.

use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};

mod batch;
mod batch_output;
mod batch_pairs;
mod completions;
mod corrupt;
mod failure;
mod files;
mod inspect;
mod interrupt;
mod method;
mod page;
mod register;
mod rrd;
mod say;
mod skeleton;
mod statistics;
mod summary;
mod transform;
mod view;
mod weights;

use failure::Failure;

/// The exit codes, for help texts.
const EXIT_CODES: &str = "Exit codes:
  0    done; with `register`: a pose was found and is probably right
  1    failure: no pose was found, or an output could not be written
  2    bad usage or input
  3    `register` found a pose and wrote it, but abstains: it may well be wrong
  130  interrupted; no half-written file remains";

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
    Corrupt(corrupt::CorruptArgs),
    Skeleton(skeleton::SkeletonArgs),
    Weights(weights::WeightsArgs),
    Completions(completions::CompletionsArgs),
}

/// What every verb that computes takes.
#[derive(Debug, Clone, Args)]
pub struct Common {
    /// Worker threads [default: all cores]. Results do not depend on it
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

impl Common {
    /// Starts the worker threads and answers how many they are.
    ///
    /// # Errors
    /// [`Failure::Usage`] for no threads, [`Failure::Other`] where they cannot be started.
    pub fn start_threads(&self) -> Result<usize, Failure> {
        if self.threads == Some(0) {
            return Err(Failure::Usage("--threads 0: at least one thread is needed".into()));
        }
        let mut builder = rayon::ThreadPoolBuilder::new();
        if let Some(count) = self.threads {
            builder = builder.num_threads(count);
        }
        builder
            .build_global()
            .map_err(|e| Failure::Other(format!("cannot start worker threads: {e}; try --threads 1")))?;
        Ok(rayon::current_num_threads())
    }
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
        Command::Corrupt(args) => corrupt::run(&args),
        Command::Skeleton(args) => skeleton::run(&args),
        Command::Weights(args) => weights::run(&args),
        Command::Completions(args) => completions::run(&args),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn options_do_not_clash() {
        Cli::command().debug_assert();
    }
}
