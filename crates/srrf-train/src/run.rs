//! The training loop.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use burn::module::Module;
use burn::tensor::Device;
use srrf_cloud::profile;
use srrf_corrupt::datasets::ShapeSource;
use srrf_corrupt::{Pair, Severity};
use srrf_model::is_accelerator;

use crate::checkpoint::{self, RunProgress};
use crate::config::TrainConfig;
use crate::data::TrainingPairs;
use crate::error::TrainError;
use crate::export::{Provenance, export};
use crate::folder::{BEST, LAST, RunFolder};
use crate::log::{Log, LossWindow, progress_bar, summary, train_line};
use crate::options::{Ended, RunOptions};
use crate::prefetch::{Closing, Prefetch};
use crate::resources::cpu_seconds;
use crate::rows::Updater;
use crate::schedule::Plan;
use crate::seam::{Losses, Trained};
use crate::start::{StartingPoint, begin, start};
use crate::step::{PrefetchOf, StepContext, StepError, device_of, gradient, prepare};
use crate::validate::{CHUNK, Validation, validate};
use crate::workers::Workers;

/// Steps between two lines of the log.
const LOG_EVERY: usize = 10;
/// Steps between two lines where there is no terminal.
const SAY_EVERY: usize = 500;
/// The run stops when this many steps in a row are not finite.
const MOST_SKIPPED_IN_A_ROW: usize = 20;

/// Everything a run holds while it goes.
struct Training<'a, C: Trained> {
    config: &'a TrainConfig<C>,
    options: &'a RunOptions,
    devices: Vec<Device>,
    pairs: Arc<TrainingPairs>,
    held_out: Vec<Pair>,
    workers: Workers,
    plan: Plan,
    folder: RunFolder,
    model: C::Network,
    updater: Updater,
    progress: RunProgress,
    log: Log,
    window: LossWindow,
    clock: SessionClock,
}

/// When the session began, and the seconds of the sessions before it.
#[derive(Clone, Copy)]
struct SessionClock {
    started: Instant,
    wall_before: f64,
    cpu_started: f64,
    cpu_before: f64,
}

impl SessionClock {
    fn new(progress: &RunProgress) -> Self {
        Self {
            started: Instant::now(),
            wall_before: progress.wall_seconds,
            cpu_started: cpu_seconds(),
            cpu_before: progress.cpu_seconds,
        }
    }
}

/// Trains, from the start or from the checkpoint, until done, told to stop, or out of time. Where there are several
/// devices, the shards of a batch go to them in turn.
///
/// # Errors
/// [`TrainError`]; the last checkpoint stays usable.
pub fn run<C: Trained>(
    config: &TrainConfig<C>,
    options: &RunOptions,
    shapes: Box<dyn ShapeSource>,
    devices: Vec<Device>,
    stop: &AtomicBool,
) -> Result<Ended, TrainError> {
    let run = Training::open(config, options, shapes, devices)?;
    if !on_accelerator(config) {
        return run.go(stop, None);
    }
    // The device computes elsewhere: all threads make pairs ahead of it.
    let shards = config.optimizer.shards();
    let prefetch = Prefetch::new(run.progress.step * shards, shards + 2 * options.threads);
    let (pairs, plan, devices) = (run.pairs.clone(), run.plan.clone(), run.devices.clone());
    let networks: Vec<C::Network> =
        devices.iter().map(|device| run.model.clone().to_device(device)).collect();
    std::thread::scope(|scope| {
        let _closing = Closing(&prefetch);
        for _ in 0..options.threads {
            scope.spawn(|| {
                prefetch.work(|number| {
                    let stage = &config.stages[plan.stage(number / shards)];
                    let d = device_of(number % shards, &devices);
                    let prepared = prepare(config, stage, &pairs, number, &devices[d])?;
                    prepared.prefetched(config, &networks[d])
                });
            });
        }
        run.go(stop, Some(&prefetch))
    })
}

/// Whether the network runs on another processor than the one that makes the pairs.
fn on_accelerator<C: Trained>(config: &TrainConfig<C>) -> bool {
    config.device.as_deref().is_some_and(is_accelerator)
}

impl<'a, C: Trained> Training<'a, C> {
    fn open(
        config: &'a TrainConfig<C>,
        options: &'a RunOptions,
        shapes: Box<dyn ShapeSource>,
        devices: Vec<Device>,
    ) -> Result<Self, TrainError> {
        let device = devices.first().ok_or(StepError::NoDevice)?;
        let shards = config.optimizer.shards();
        if devices.len() > shards {
            return Err(TrainError::Devices { devices: devices.len(), shards });
        }
        let StartingPoint { folder, model, optimizer, progress } = start(config, options, device)?;
        let pairs = Arc::new(TrainingPairs::new(config, shapes).map_err(StepError::from)?);
        let severity = Severity::try_from(config.keep.validate_severity).unwrap_or(Severity::ALL[2]);
        let held_out = pairs.validation(severity).map_err(StepError::from)?;
        let plan = Plan::new(config, pairs.epoch_length());
        let workers = match on_accelerator(config) {
            true => Workers::wide(shards.min(options.threads), options.threads)?,
            false => Workers::new(options.threads)?,
        };
        begin(&folder, config, options)?;
        let updater = Updater::new(optimizer, &model);
        let log = Log::open(&options.folder, progress.step)
            .map_err(|source| TrainError::Io { path: options.folder.clone(), source })?;
        let window = LossWindow::of_saved(&progress.window);
        let clock = SessionClock::new(&progress);
        Ok(Self {
            config,
            options,
            devices,
            pairs,
            held_out,
            workers,
            plan,
            folder,
            model,
            updater,
            progress,
            log,
            window,
            clock,
        })
    }

    fn go(mut self, stop: &AtomicBool, prefetch: Option<&PrefetchOf<C>>) -> Result<Ended, TrainError> {
        let run = &mut self;
        let (config, options, clock) = (run.config, run.options, run.clock);
        let out_of_time = || options.time_limit.is_some_and(|limit| clock.started.elapsed() >= limit);
        let stopped = || stop.load(Ordering::Relaxed) || out_of_time();
        let (first, steps) = (run.progress.step, run.plan.steps());
        let end = options.until_step.unwrap_or(usize::MAX).min(steps);
        let bar = progress_bar(steps, first);
        let mut saved = Instant::now();
        while run.progress.step < end && !stopped() {
            let step = run.progress.step;
            let stage = &config.stages[run.plan.stage(step)];
            let rate = run.plan.learning_rate(stage, step);
            let Some(losses) = run.step(step, rate, prefetch, &stopped)? else { break };
            run.progress.step = step + 1;

            let epoch = run.plan.epochs(step + 1);
            run.window.add(losses);
            if (step + 1).is_multiple_of(LOG_EVERY) {
                let losses = run.window.mean();
                let line = train_line(&stage.name, epoch, rate, &losses, config.optimizer.batch, &bar);
                if bar.is_hidden() && (step + 1).is_multiple_of(SAY_EVERY) {
                    (options.say)(&format!("step {} of {steps}  {line}", step + 1));
                }
                bar.set_message(line);
                run.log.train(step + 1, epoch, &stage.name, rate, &losses).map_err(|e| run.io(e))?;
            }
            let last = step + 1 == steps;
            let due = (step + 1).is_multiple_of(run.plan.steps_in(config.keep.validate_epochs));
            if C::trains_poses(&stage.trains) && (due || last) {
                let result = run.validate()?;
                let line = summary(step + 1, epoch, &result, C::ROWS);
                if bar.is_hidden() { (options.say)(&line) } else { bar.println(line) }
            }
            bar.set_position(run.progress.step as u64);
            let epochs = config.keep.checkpoint_epochs;
            let due = epochs > 0.0 && (step + 1).is_multiple_of(run.plan.steps_in(epochs));
            if due || last || saved.elapsed().as_secs_f64() > config.keep.checkpoint_minutes * 60.0 {
                run.save()?;
                saved = Instant::now();
            }
        }
        if run.progress.step == 0 && run.folder.replaces_a_run() {
            run.folder.bring_back()?;
            (options.say)("no step was done: the run that was to be started over is as it was");
        } else {
            run.save()?;
        }
        bar.abandon();
        let best = options.folder.join(BEST);
        let RunProgress { step, skipped, .. } = run.progress;
        let best = best.exists().then_some(best);
        Ok(Ended { step, done: step - first, complete: step == steps, skipped, best })
    }

    /// One step: gradient, check, clip, update. `None` where the run is to stop before it is done.
    fn step(
        &mut self,
        step: usize,
        rate: f64,
        prefetch: Option<&PrefetchOf<C>>,
        stopped: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Losses>, TrainError> {
        let config = self.config;
        let stage = &config.stages[self.plan.stage(step)];
        let context =
            StepContext { config, stage, pairs: &self.pairs, devices: &self.devices, prefetch, stopped };
        let Some(mut outcome) = gradient(&context, &self.model, step, &self.workers)? else {
            return Ok(None);
        };
        if !outcome.norm.is_finite() {
            self.progress.skipped += 1;
            self.progress.skipped_in_a_row += 1;
            if self.progress.skipped_in_a_row >= MOST_SKIPPED_IN_A_ROW {
                return Err(TrainError::NotFinite(self.progress.skipped_in_a_row));
            }
            return Ok(Some(Losses::new()));
        }
        self.progress.skipped_in_a_row = 0;
        let clip = config.optimizer.clip_norm;
        if clip > 0.0 && outcome.norm > clip {
            outcome.gradients.scale(clip / outcome.norm);
        }
        let model = self.model.clone();
        self.model = profile::stage("optimizer", || self.updater.step(rate, model, outcome.gradients));
        outcome.losses.insert("gradient_norm", outcome.norm);
        Ok(Some(outcome.losses))
    }

    fn validate(&mut self) -> Result<Validation, TrainError> {
        let network = &self.config.network;
        // A GPU takes a whole shard at a time, in the shapes of training.
        let chunk = if on_accelerator(self.config) { self.config.optimizer.shard } else { CHUNK };
        let result = validate(network, &self.model, &self.held_out, chunk, &self.devices[0], &self.workers)?;
        let step = self.progress.step;
        self.log.validation(step, self.plan.epochs(step), &result).map_err(|e| self.io(e))?;
        let value = C::ROWS.last().map_or(f64::NAN, |row| result.scores[row].rmse_r);
        if self.progress.best.is_none_or(|best| value < best) {
            self.progress.best = Some(value);
            self.export(BEST, Some(&result))?;
        }
        Ok(result)
    }

    /// Checkpoint, last weights, picture. Once they are there, a run that this one replaced is removed.
    fn save(&mut self) -> Result<(), TrainError> {
        self.take_time();
        self.progress.window = self.window.saved();
        let folder: &Path = &self.options.folder;
        checkpoint::save(folder, self.config, &self.model, self.updater.optimizer(), &self.progress)?;
        self.folder.forget()?;
        self.export(LAST, None)?;
        let picture = self.log.draw(C::ROWS, C::CURVES);
        picture.map_err(|why| TrainError::Picture { path: folder.into(), why })
    }

    fn take_time(&mut self) {
        let SessionClock { started, wall_before, cpu_started, cpu_before } = self.clock;
        self.progress.wall_seconds = wall_before + started.elapsed().as_secs_f64();
        self.progress.cpu_seconds = cpu_before + cpu_seconds() - cpu_started;
    }

    fn export(&mut self, file: &str, scores: Option<&Validation>) -> Result<(), TrainError> {
        self.take_time();
        let (training, validation) = (self.pairs.epoch_length(), self.held_out.len());
        let known = Provenance { progress: &self.progress, training, validation, scores };
        Ok(export(&self.options.folder.join(file), &self.model, self.config, &known)?)
    }

    fn io(&self, source: std::io::Error) -> TrainError {
        TrainError::Io { path: self.options.folder.clone(), source }
    }
}
