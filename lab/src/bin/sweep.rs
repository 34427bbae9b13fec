//! Trains the runs of a list, one after the other:
//!
//! ```sh
//! cargo run -p srrf-lab --bin sweep -- lab/sweeps/skeleton-points.toml --data PATH
//! cargo run -p srrf-train -- --config lab/sweeps/skeleton-points.toml#skeleton-points-32 --data PATH     # one of them
//! ```
//!
//! A run that is complete is left as it is, one that was stopped goes on.
#![allow(clippy::print_stderr, reason = "a program that says what it does")]

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use clap::Parser;
use srrf_lab::Failure;
use srrf_model::keep_freed_memory;
use srrf_train::config::read_sweep;
use srrf_train::{Existing, Overrides, train_layers};

/// Trains the runs of a list, one after the other.
#[derive(Parser)]
struct Arguments {
    /// The list: a TOML file with `[[runs]]`.
    list: PathBuf,
    /// Where ModelNet40 is.
    #[arg(long, env = "SRRF_DATA")]
    data: Option<PathBuf>,
    /// Folder of the runs, each in one of its name.
    #[arg(long, default_value = "runs")]
    folder: PathBuf,
    /// Device [default: that of the configuration, or flex].
    #[arg(long)]
    device: Option<String>,
    /// Stop each run at this step.
    #[arg(long)]
    until_step: Option<usize>,
    /// Worker threads [default: all cores].
    #[arg(long)]
    threads: Option<std::num::NonZeroU16>,
}

fn main() -> Result<(), Failure> {
    keep_freed_memory();
    let arguments = Arguments::parse();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    for run in read_sweep(&arguments.list)? {
        eprintln!("{}", run.name);
        let overrides = Overrides {
            data: None,
            environment_data: arguments.data.clone(),
            folder: Some(Path::new(&arguments.folder).join(&run.name)),
            device: arguments.device.clone(),
            threads: arguments.threads.map_or(cores, |threads| usize::from(threads.get())),
            existing: Existing::Resume,
            until_step: arguments.until_step,
            time_limit: None,
            say: |line| eprintln!("{line}"),
        };
        let ended = train_layers(&run.layers, &overrides, &AtomicBool::new(false))?;
        eprintln!("{}: step {}, {} left out as not finite", run.name, ended.step, ended.skipped);
    }
    Ok(())
}
