//! `srrf-train --config configs/modelnet.toml`: trains the SRRF network, or a learned baseline.

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use srrf_args::{Failure, INTERRUPTED, Output, files, run_program};
use srrf_cloud::profile;
use srrf_corrupt::datasets::default_data_path;
use srrf_model::keep_freed_memory;
use srrf_train::cli::{Arguments, Command, command};
use srrf_train::config::key_reference;
use srrf_train::{Ended, Existing, Overrides, TrainError, train};

fn main() -> ExitCode {
    keep_freed_memory();
    run_program(|arguments: Arguments| match (&arguments.command, arguments.config.clone()) {
        (Some(Command::Scripts(scripts)), _) => scripts.run(command()),
        (Some(Command::Keys), _) => keys(),
        (None, Some(config)) => start(arguments, &config),
        (None, None) => Err(Failure::usage("name a configuration: --config FILE".into())),
    })
}

fn tell(message: &str) {
    Output::Aside.say(message);
}

/// Writes the reference of all keys.
fn keys() -> Result<ExitCode, Failure> {
    files::write(Path::new("-"), key_reference().as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

/// Trains what the configuration names.
fn start(arguments: Arguments, config: &Path) -> Result<ExitCode, Failure> {
    let overrides = Overrides {
        data: arguments.data.data,
        environment_data: default_data_path(),
        folder: arguments.run,
        device: arguments.device,
        threads: arguments.threads.count(),
        existing: match (arguments.resume, arguments.restart) {
            (true, _) => Existing::Resume,
            (_, true) => Existing::Restart,
            _ => Existing::Refuse,
        },
        until_step: arguments.until_step,
        time_limit: arguments.minutes.map(|minutes| Duration::from_secs_f64(minutes * 60.0)),
        say: tell,
    };
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))
        .map_err(|e| Failure::failed(format!("cannot listen for Ctrl-C: {e}")).because(e))?;

    if arguments.profile.profile {
        profile::start();
    }
    let ended = train(config, &overrides, &stop).map_err(failure)?;
    if profile::is_on() {
        tell(&profile::report().to_string());
    }
    let Ended { step, done, complete, skipped, best } = ended;
    let best = best.map_or("none yet".into(), |path| path.display().to_string());
    tell(&format!("step {step}, {skipped} left out as not finite, best weights: {best}"));
    if stop.load(Ordering::Relaxed) {
        tell("stopped; the checkpoint is saved, --resume goes on");
        return Ok(ExitCode::from(INTERRUPTED));
    }
    if !complete && done == 0 && overrides.time_limit.is_some() {
        tell("no step was done in this time: one takes longer, so give more --minutes");
    }
    if !complete {
        tell("not complete; --resume goes on");
    }
    Ok(ExitCode::SUCCESS)
}

fn failure(error: TrainError) -> Failure {
    if error.is_bad_input() { Failure::input(error) } else { Failure::other(error) }
}
