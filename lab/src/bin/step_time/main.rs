//! Times a training step and the forward pass on generated clouds, and prints one JSON object.
//! `scripts/compare-speed.sh` runs it against the same network in PyTorch.
//!
//! ```sh
//! cargo run -p srrf-lab --bin step_time -- --figure registration_step --threads 2
//! ```
//!
//! One figure a process, so that the peak memory belongs to it.
#![allow(clippy::unwrap_used, reason = "a benchmark")]

mod clock;
mod clouds;

use std::path::PathBuf;

use burn::module::Module;
use burn::tensor::Device;
use clap::{Parser, ValueEnum};
use serde_json::{Map, Value, json};
use srrf_corrupt::Pair;
use srrf_lab::Failure;
use srrf_model::{PairBatch, Srrf, init, keep_freed_memory};
use srrf_train::TrainConfig;
use srrf_train::data::TrainingPairs;
use srrf_train::nets::srrf::SrrfParts;
use srrf_train::optimizer::optimizer;
use srrf_train::rows::Updater;
use srrf_train::stage::StageConfig;
use srrf_train::step::{StepContext, gradient};
use srrf_train::workers::Workers;

use crate::clock::{median, memory_mib, summary, timed};
use crate::clouds::Stored;

/// Which points carry tokens.
const PHASE: f32 = 0.5;

/// Times a training step and the forward pass on generated clouds.
#[derive(Parser)]
struct Arguments {
    /// The configuration whose network, losses and optimiser are timed.
    #[arg(long, default_value = "configs/modelnet-small.toml")]
    config: PathBuf,
    /// What is timed.
    #[arg(long, value_enum, default_value = "registration_step")]
    figure: TimedFigure,
    /// Where the network runs.
    #[arg(long, default_value = "flex")]
    device: String,
    /// Worker threads.
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// Repetitions before the clock counts.
    #[arg(long, default_value_t = 3)]
    warmup: usize,
    /// Timed repetitions.
    #[arg(long, default_value_t = 10)]
    repeats: usize,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
enum TimedFigure {
    /// A step of the registration stage: pairs, forward, losses, backward, clipping, AdamW.
    RegistrationStep,
    /// A step of the skeleton stage.
    SkeletonStep,
    /// The network on one pair.
    #[value(name = "forward_1")]
    Forward1,
    /// The network on eight pairs.
    #[value(name = "forward_8")]
    Forward8,
}

#[allow(clippy::print_stdout, reason = "a program that prints its result")]
fn main() -> Result<(), Failure> {
    keep_freed_memory();
    let arguments = Arguments::parse();
    let mut config = <TrainConfig>::read(&arguments.config)?;
    config.draw.independent = 0.0; // every pair has pairs.points points a cloud
    let bench = Bench::new(config, &arguments.device)?;
    let start_mib = memory_mib("VmHWM:");
    let mut found = match arguments.figure {
        TimedFigure::RegistrationStep => bench.steps(bench.stage(true)?, &arguments)?,
        TimedFigure::SkeletonStep => bench.steps(bench.stage(false)?, &arguments)?,
        TimedFigure::Forward1 => bench.forward(1, &arguments)?,
        TimedFigure::Forward8 => bench.forward(8, &arguments)?,
    };
    found.insert("start_mib".into(), json!(start_mib));
    found.insert("peak_mib".into(), json!(memory_mib("VmHWM:")));
    let figure = arguments.figure.to_possible_value().map(|v| v.get_name().to_string());
    found.insert("figure".into(), json!(figure));
    found.insert("device".into(), json!(arguments.device));
    found.insert("threads".into(), json!(arguments.threads));
    println!("{}", Value::Object(found));
    Ok(())
}

/// What every figure needs.
struct Bench {
    config: TrainConfig,
    pairs: TrainingPairs,
    device: Device,
    model: Srrf,
}

impl Bench {
    fn new(config: TrainConfig, device: &str) -> Result<Self, Failure> {
        let device = srrf_model::device(device)?;
        let pairs = TrainingPairs::new(&config, Box::new(Stored::new(config.seed, config.pairs.points)?))?;
        let model = init::seeded(config.network.init(&device), config.seed).valid();
        Ok(Self { config, pairs, device, model })
    }

    /// The first stage that trains the registration branches, or the last that trains SEM alone.
    fn stage(&self, registration: bool) -> Result<&StageConfig<SrrfParts>, Failure> {
        let stages = || self.config.stages.iter().filter(|stage| stage.trains.registration == registration);
        let stage = if registration { stages().next() } else { stages().next_back() };
        stage.ok_or_else(|| "the configuration has no such stage".into())
    }

    /// Whole training steps, as `srrf-train` makes them.
    fn steps(
        &self,
        stage: &StageConfig<SrrfParts>,
        arguments: &Arguments,
    ) -> Result<Map<String, Value>, Failure> {
        let optimizer_config = &self.config.optimizer;
        let context = StepContext {
            config: &self.config,
            stage,
            pairs: &self.pairs,
            devices: std::slice::from_ref(&self.device),
            prefetch: None,
            stopped: &|| false,
        };
        let workers = Workers::new(arguments.threads)?;
        let mut model = self.model.clone();
        let mut updater = Updater::new(optimizer(optimizer_config), &model);
        let mut loss = 0.0;
        let mut step = 0;
        let times = timed(arguments, || {
            let mut outcome = gradient(&context, &model, step, &workers)?.ok_or("a step was left out")?;
            let clip = optimizer_config.clip_norm;
            if clip > 0.0 && outcome.norm > clip {
                outcome.gradients.scale(clip / outcome.norm);
            }
            // A hundredth of the rate: the steps are as long, and the weights stay near their start.
            let rate = stage.learning_rate * 0.01;
            model = updater.step(rate, model.clone(), outcome.gradients);
            loss = outcome.losses.get("total").copied().unwrap_or(f64::NAN);
            step += 1;
            Ok(())
        })?;
        let (batch, shard) = (optimizer_config.batch, optimizer_config.shard);
        let mut first = 0;
        let making = timed(arguments, || {
            let made = workers
                .map(batch / shard, |i| self.pairs.shard(first + i * shard, shard).map(|pairs| pairs.len()));
            first += batch;
            made.ok_or("a worker stopped")?.into_iter().collect::<Result<Vec<_>, _>>()?;
            Ok(())
        })?;
        let mut found = summary(&times);
        found.insert("of_which_pairs_s".into(), json!(median(&making)));
        found.insert("loss".into(), json!(loss));
        Ok(found)
    }

    /// The forward pass: one pair on all threads, several pairs one to a thread.
    fn forward(&self, count: usize, arguments: &Arguments) -> Result<Map<String, Value>, Failure> {
        let pairs = self.pairs.shard(0, count)?;
        let integration = &self.config.network.integration;
        let one = |pair: &Pair| -> Option<()> {
            let batch = PairBatch::new(&[(&pair.source, &pair.target)], &self.device)?;
            self.model.forward(integration, batch.source, batch.target, PHASE).unwrap();
            Some(())
        };
        let workers = Workers::new(arguments.threads)?;
        let wide = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build()?;
        let times = timed(arguments, || {
            let done = match pairs.as_slice() {
                [pair] => wide.install(|| one(pair).is_some()),
                pairs => {
                    workers.map(count, |i| one(&pairs[i]).is_some()).is_some_and(|d| d.iter().all(|d| *d))
                }
            };
            if done { Ok(()) } else { Err("a forward pass failed".into()) }
        })?;
        Ok(summary(&times))
    }
}
