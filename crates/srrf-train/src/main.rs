//! `srrf-train --config configs/modelnet.toml`: trains the SRRF network, or a learned baseline.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Parser;
use srrf_baselines::{DcpConfig, EquiGsprConfig, PanetConfig, PointNetLkConfig, RgmConfig};
use srrf_cloud::profile;
use srrf_model::{SrrfConfig, keep_freed_memory};
use srrf_train::baseline::Baseline;
use srrf_train::config::{TrainConfig, method_of};
use srrf_train::data::training_shapes;
use srrf_train::network::Trained;
use srrf_train::run::{Existing, RunError, RunOptions, run};

/// Trains the SRRF network, or the learned baseline that the configuration names as its `method`.
///
/// Writes into the run's folder: the resolved config.toml, metrics.jsonl, curve.svg, a checkpoint,
/// and the weights `best.safetensors` (by validation) and `last.safetensors`.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// The configuration; see configs/.
    #[arg(long)]
    config: PathBuf,
    /// Where ModelNet40 is; before `data.path` of the configuration.
    #[arg(long, env = "SRRF_DATA")]
    data: Option<PathBuf>,
    /// Folder of the run [default: runs/NAME].
    #[arg(long)]
    run: Option<PathBuf>,
    /// Go on from the checkpoint in the run's folder, if there is one.
    #[arg(long, conflicts_with = "restart")]
    resume: bool,
    /// Start over, whatever the run's folder holds.
    #[arg(long)]
    restart: bool,
    /// Stop when the run stands at this step.
    #[arg(long)]
    until_step: Option<usize>,
    /// Stop after this many minutes; --resume goes on.
    #[arg(long)]
    minutes: Option<f64>,
    /// Worker threads; changes the time, not the result [default: all cores].
    #[arg(long)]
    threads: Option<usize>,
    /// Device: `flex` (CPU), and `ndarray`, `wgpu`, `vulkan`, `cuda`, `libtorch` where built in; `cuda:0,cuda:1` trains on
    /// two [default: `device` of the configuration, or flex].
    #[arg(long)]
    device: Option<String>,
    /// Print at the end what time each stage of the steps took, over all threads.
    #[arg(long)]
    profile: bool,
}

/// A message and an exit code: 2 for bad usage or input, 1 for a failure.
struct Failure(u8, String);

fn main() -> ExitCode {
    keep_freed_memory();
    match start(Arguments::parse()) {
        Ok(code) => code,
        Err(Failure(code, message)) => {
            tell(&format!("error: {message}"));
            ExitCode::from(code)
        }
    }
}

#[allow(clippy::print_stderr, reason = "the binary's one place to speak")]
fn tell(message: &str) {
    eprintln!("{message}");
}

/// Trains what the configuration names.
fn start(arguments: Arguments) -> Result<ExitCode, Failure> {
    let method = method_of(&arguments.config).map_err(|e| Failure(2, e.to_string()))?;
    match method.as_str() {
        SrrfConfig::METHOD => train::<SrrfConfig>(arguments),
        Baseline::<DcpConfig>::METHOD => train::<Baseline<DcpConfig>>(arguments),
        Baseline::<PointNetLkConfig>::METHOD => train::<Baseline<PointNetLkConfig>>(arguments),
        Baseline::<PanetConfig>::METHOD => train::<Baseline<PanetConfig>>(arguments),
        Baseline::<RgmConfig>::METHOD => train::<Baseline<RgmConfig>>(arguments),
        Baseline::<EquiGsprConfig>::METHOD => train::<Baseline<EquiGsprConfig>>(arguments),
        _ => Err(Failure(
            2,
            format!(
                "{}: `method` is \"{method}\"; choose from srrf, dcp, pointnetlk, panet, rgm, equi-gspr",
                arguments.config.display()
            ),
        )),
    }
}

fn train<C: Trained>(arguments: Arguments) -> Result<ExitCode, Failure> {
    let usage = |e: &dyn std::fmt::Display| Failure(2, e.to_string());
    let mut config = TrainConfig::<C>::read(&arguments.config).map_err(|e| usage(&e))?;
    let name = arguments.device.or(config.device.take()).unwrap_or_else(|| "flex".into());
    let devices = srrf_model::devices(&name).map_err(|e| usage(&e))?;
    config.device = Some(name.clone());
    let shapes =
        training_shapes(&config, arguments.data.as_deref()).map_err(|e| Failure(2, e.to_string()))?;
    let options = RunOptions {
        folder: arguments.run.unwrap_or_else(|| Path::new("runs").join(&config.name)),
        threads: arguments.threads.unwrap_or_else(cores),
        existing: match (arguments.resume, arguments.restart) {
            (true, _) => Existing::Resume,
            (_, true) => Existing::Restart,
            _ => Existing::Refuse,
        },
        until_step: arguments.until_step,
        time_limit: arguments.minutes.map(|m| Duration::from_secs_f64(m.max(0.0) * 60.0)),
        say: tell,
    };
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))
        .map_err(|e| Failure(1, format!("no handler for Ctrl-C: {e}")))?;

    if arguments.profile {
        profile::start();
    }
    tell(&format!("config {}, data {}", arguments.config.display(), shapes.description()));
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
        let code = if input { 2 } else { 1 };
        Failure(code, e.to_string())
    })?;
    if profile::is_on() {
        tell(&profile::report().to_string());
    }
    let best = ended.best.map_or("none yet".into(), |path| path.display().to_string());
    tell(&format!("step {}, {} left out as not finite, best weights: {best}", ended.step, ended.skipped));
    if stop.load(Ordering::Relaxed) {
        tell("stopped; the checkpoint is saved, --resume goes on");
        return Ok(ExitCode::from(130));
    }
    if !ended.complete {
        tell("not complete; --resume goes on");
    }
    Ok(ExitCode::SUCCESS)
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
