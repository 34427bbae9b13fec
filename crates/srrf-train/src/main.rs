//! `srrf-train --config configs/modelnet.toml`: trains the SRRF network, or a learned baseline.

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use srrf_args::{Failure, INTERRUPTED, run_program};
use srrf_baselines::{DcpConfig, EquiGsprConfig, PanetConfig, PointNetLkConfig, RgmConfig};
use srrf_cloud::profile;
use srrf_corrupt::datasets::default_data_path;
use srrf_model::{SrrfConfig, keep_freed_memory};
use srrf_train::baseline::Baseline;
use srrf_train::cli::{Arguments, Command, command};
use srrf_train::config::{TrainConfig, method_of};
use srrf_train::data::training_shapes;
use srrf_train::network::Trained;
use srrf_train::run::{Existing, RunError, RunOptions, run};

fn main() -> ExitCode {
    keep_freed_memory();
    run_program(|arguments: Arguments| match (&arguments.command, arguments.config.clone()) {
        (Some(Command::Scripts(scripts)), _) => scripts.run(command()),
        (None, Some(config)) => start(arguments, &config),
        (None, None) => Err(Failure::usage("name a configuration: --config FILE".into())),
    })
}

#[allow(clippy::print_stderr, reason = "the binary's one place to speak")]
fn tell(message: &str) {
    eprintln!("{message}");
}

/// Trains what the configuration names.
fn start(arguments: Arguments, path: &Path) -> Result<ExitCode, Failure> {
    let method = method_of(path).map_err(Failure::input)?;
    match method.as_str() {
        SrrfConfig::METHOD => train::<SrrfConfig>(arguments, path),
        Baseline::<DcpConfig>::METHOD => train::<Baseline<DcpConfig>>(arguments, path),
        Baseline::<PointNetLkConfig>::METHOD => train::<Baseline<PointNetLkConfig>>(arguments, path),
        Baseline::<PanetConfig>::METHOD => train::<Baseline<PanetConfig>>(arguments, path),
        Baseline::<RgmConfig>::METHOD => train::<Baseline<RgmConfig>>(arguments, path),
        Baseline::<EquiGsprConfig>::METHOD => train::<Baseline<EquiGsprConfig>>(arguments, path),
        _ => Err(Failure::usage(format!(
            "{}: `method` is \"{method}\"; choose from srrf, dcp, pointnetlk, panet, rgm, equi-gspr",
            path.display()
        ))),
    }
}

fn train<C: Trained>(arguments: Arguments, path: &Path) -> Result<ExitCode, Failure> {
    let mut config = TrainConfig::<C>::read(path).map_err(Failure::input)?;
    let name = arguments.device.or(config.device.take()).unwrap_or_else(|| "flex".into());
    let devices = srrf_model::devices(&name).map_err(Failure::input)?;
    config.device = Some(name.clone());
    let data = arguments.data.data.or_else(default_data_path);
    let shapes = training_shapes(&config, data.as_deref()).map_err(Failure::input)?;
    let options = RunOptions {
        folder: arguments.run.unwrap_or_else(|| Path::new("runs").join(&config.name)),
        threads: arguments.threads.count(),
        existing: match (arguments.resume, arguments.restart) {
            (true, _) => Existing::Resume,
            (_, true) => Existing::Restart,
            _ => Existing::Refuse,
        },
        until_step: arguments.until_step,
        time_limit: arguments.minutes.map(|m| Duration::from_secs_f64(m * 60.0)),
        say: tell,
    };
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))
        .map_err(|e| Failure::failed(format!("cannot listen for Ctrl-C: {e}")).because(e))?;

    if arguments.profile.profile {
        profile::start();
    }
    tell(&format!("config {}, data {}", path.display(), shapes.description()));
    tell(&format!("run {}, device {}, {} threads", options.folder.display(), name, options.threads));
    let ended = run(&config, &options, shapes, devices, &stop).map_err(|e| {
        let input = matches!(
            e,
            RunError::Exists { .. }
                | RunError::Devices { .. }
                | RunError::Collective(_)
                | RunError::Checkpoint(_)
                | RunError::Start { .. }
                | RunError::StartFile { .. }
        );
        if input { Failure::input(e) } else { Failure::other(e) }
    })?;
    if profile::is_on() {
        tell(&profile::report().to_string());
    }
    let best = ended.best.map_or("none yet".into(), |path| path.display().to_string());
    tell(&format!("step {}, {} left out as not finite, best weights: {best}", ended.step, ended.skipped));
    if stop.load(Ordering::Relaxed) {
        tell("stopped; the checkpoint is saved, --resume goes on");
        return Ok(ExitCode::from(INTERRUPTED));
    }
    if !ended.complete {
        tell("not complete; --resume goes on");
    }
    Ok(ExitCode::SUCCESS)
}
