//! The training loop.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use burn::module::Module;
use burn::tensor::Device;
use srrf_cloud::profile;
use srrf_corrupt::datasets::ShapeSource;
use srrf_corrupt::{Pair, Severity};
use srrf_model::weights::{to_safetensors, write_atomically};
use srrf_model::{init, is_accelerator};

use crate::ahead::{Ahead, Closing};
use crate::checkpoint::{self, CheckpointError, Progress};
use crate::config::{DataSource, Reduce, TrainConfig};
use crate::data::TrainingPairs;
use crate::log::{Log, progress_bar, summary};
use crate::network::Trained;
use crate::optimizer::optimizer;
use crate::resources::cpu_seconds;
use crate::rows::{RowGradients, Updater};
use crate::schedule::Plan;
use crate::start::starting_model;
use crate::step::{AheadOf, Losses, StepContext, StepError, Workers, device_of, gradient, prepare};
use crate::validate::{CHUNK, ValidateError, Validation, validate};

/// Steps between two lines of the log.
const LOG_EVERY: usize = 10;
/// Steps between two lines where there is no terminal.
const SAY_EVERY: usize = 500;
/// The run stops when this many steps in a row are not finite.
const MOST_SKIPPED_IN_A_ROW: usize = 20;

/// Why a run stopped.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A file of the run cannot be written.
    #[error("{path}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// The checkpoint cannot be written or read.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The weights cannot be written.
    #[error(transparent)]
    Weights(#[from] srrf_model::weights::WeightsError),
    /// The device did not give its numbers.
    #[error(transparent)]
    Copy(#[from] srrf_model::CopyError),
    /// A step could not be made.
    #[error(transparent)]
    Step(#[from] StepError),
    /// A validation failed.
    #[error(transparent)]
    Validate(#[from] ValidateError),
    /// No thread could be started.
    #[error("no worker thread could be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The weights to start from cannot be read.
    #[error("start = {start:?}: {source}")]
    StartFile {
        /// The weights, as the configuration names them.
        start: String,
        /// What is wrong with them.
        #[source]
        source: srrf_model::weights::WeightsError,
    },
    /// The weights to start from are of another network.
    #[error(
        "start = \"{start}\": its `{name}` does not fit this network; make [network] as that of the weights, or \
         leave `start` out"
    )]
    Start {
        /// The first parameter that does not fit.
        name: String,
        /// The weights, as the configuration names them.
        start: String,
    },
    /// There are more devices than shards.
    #[error(
        "{devices} devices, and a batch has {shards} shards: the rest would stand still. Lower `optimizer.shard`, or \
         name fewer devices"
    )]
    Devices {
        /// Number of devices.
        devices: usize,
        /// Shards of a batch.
        shards: usize,
    },
    /// The devices cannot add up gradients among themselves.
    #[error("reduce = \"collective\": {0}. reduce = \"ordered\" works on every device")]
    Collective(String),
    /// Losses or gradients stay non-finite.
    #[error(
        "the loss or its gradient was not finite in {0} steps in a row; the last checkpoint is from before. \
         Lower `learning_rate` or `optimizer.clip_norm`"
    )]
    NotFinite(usize),
    /// There is a checkpoint, and no word on what to do with it.
    #[error(
        "{path} holds a run that stands at step {step}; add --resume to go on, or --restart to start over"
    )]
    Exists {
        /// The folder.
        path: PathBuf,
        /// Where the run stands.
        step: usize,
    },
}

/// What to do with a checkpoint that is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Go on from it.
    Resume,
    /// Start over.
    Restart,
    /// Stop with [`RunError::Exists`].
    Refuse,
}

/// Options that change how far and how fast a run goes, not what it computes.
pub struct RunOptions {
    /// Folder of the run.
    pub folder: PathBuf,
    /// Worker threads.
    pub threads: usize,
    /// What to do with a checkpoint that is there.
    pub existing: Existing,
    /// Stop after this many steps, counted from the start of the run.
    pub until_step: Option<usize>,
    /// Stop after this time.
    pub time_limit: Option<Duration>,
    /// Where lines about the run go when there is no terminal for the progress bar.
    pub say: fn(&str),
}

/// How a call ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Ended {
    /// Steps done since the start of the run.
    pub step: usize,
    /// Whether the run is complete.
    pub complete: bool,
    /// Steps left out.
    pub skipped: usize,
    /// Where the best weights are, if there were any yet.
    pub best: Option<PathBuf>,
}

/// Everything a run holds while it goes.
struct Run<'a, C: Trained> {
    config: &'a TrainConfig<C>,
    options: &'a RunOptions,
    devices: Vec<Device>,
    pairs: Arc<TrainingPairs>,
    held_out: Vec<Pair>,
    workers: Workers,
    plan: Plan,
    model: C::Network,
    updater: Updater,
    progress: Progress,
    log: Log,
    started: (Instant, f64, f64, f64),
}

/// Trains, from the start or from the checkpoint, until done, told to stop, or out of time. Where there are several
/// devices, the shards of a batch go to them in turn.
///
/// # Errors
/// [`RunError`]; the last checkpoint stays usable.
pub fn run<C: Trained>(
    config: &TrainConfig<C>,
    options: &RunOptions,
    shapes: Box<dyn ShapeSource>,
    devices: Vec<Device>,
    stop: &AtomicBool,
) -> Result<Ended, RunError> {
    let run = Run::open(config, options, shapes, devices)?;
    if !on_accelerator(config) {
        return run.go(stop, None);
    }
    // The device computes elsewhere: all threads make pairs ahead of it.
    let shards = config.optimizer.shards();
    let ahead = Ahead::new(run.progress.step * shards, shards + 2 * options.threads);
    let (pairs, plan, devices) = (run.pairs.clone(), run.plan.clone(), run.devices.clone());
    let networks: Vec<C::Network> =
        devices.iter().map(|device| run.model.clone().to_device(device)).collect();
    std::thread::scope(|scope| {
        let _closing = Closing(&ahead);
        for _ in 0..options.threads {
            scope.spawn(|| {
                ahead.work(|number| {
                    let stage = &config.stages[plan.stage(number / shards)];
                    let d = device_of(number % shards, &devices);
                    let prepared = prepare(config, stage, &pairs, number, &devices[d])?;
                    prepared.ahead(config, &networks[d])
                });
            });
        }
        run.go(stop, Some(&ahead))
    })
}

/// Whether the network runs on another processor than the one that makes the pairs.
fn on_accelerator<C: Trained>(config: &TrainConfig<C>) -> bool {
    config.device.as_deref().is_some_and(is_accelerator)
}

impl<C: Trained> Run<'_, C> {
    fn go(mut self, stop: &AtomicBool, ahead: Option<&AheadOf<C>>) -> Result<Ended, RunError> {
        let run = &mut self;
        let (config, options) = (run.config, run.options);
        let end = options.until_step.unwrap_or(usize::MAX).min(run.plan.steps());
        let bar = progress_bar(run.plan.steps(), run.progress.step);
        let mut window = (Losses::new(), 0);
        let mut saved = Instant::now();
        while run.progress.step < end && !stop.load(Ordering::Relaxed) && !run.out_of_time() {
            let step = run.progress.step;
            let stage = &config.stages[run.plan.stage(step)];
            let rate = run.plan.learning_rate(stage, step);
            let losses = run.step(step, rate, ahead)?;
            run.progress.step = step + 1;

            let epoch = run.plan.epochs(step + 1);
            merge(&mut window, losses);
            if (step + 1).is_multiple_of(LOG_EVERY) {
                let losses = mean(&mut window);
                let line = message(&stage.name, epoch, rate, &losses, config.optimizer.batch, &bar);
                if bar.is_hidden() && (step + 1).is_multiple_of(SAY_EVERY) {
                    (options.say)(&format!("step {} of {}  {line}", step + 1, run.plan.steps()));
                }
                bar.set_message(line);
                run.log.train(step + 1, epoch, &stage.name, rate, &losses).map_err(|e| run.io(e))?;
            }
            let last = step + 1 == run.plan.steps();
            if stage.registration
                && ((step + 1).is_multiple_of(run.plan.steps_in(config.keep.validate_epochs)) || last)
            {
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
        run.save()?;
        bar.abandon();
        let best = options.folder.join("best.safetensors");
        let complete = run.progress.step == run.plan.steps();
        let best = best.exists().then_some(best);
        Ok(Ended { step: run.progress.step, complete, skipped: run.progress.skipped, best })
    }
}

impl<'a, C: Trained> Run<'a, C> {
    fn open(
        config: &'a TrainConfig<C>,
        options: &'a RunOptions,
        shapes: Box<dyn ShapeSource>,
        devices: Vec<Device>,
    ) -> Result<Self, RunError> {
        let device = devices.first().ok_or(StepError::NoDevice)?;
        let shards = config.optimizer.shards();
        if devices.len() > shards {
            return Err(RunError::Devices { devices: devices.len(), shards });
        }
        if config.reduce == Reduce::Collective {
            let name = config.device.as_deref().unwrap_or("flex");
            RowGradients::can_all_reduce(name, &devices).map_err(RunError::Collective)?;
        }
        let folder = &options.folder;
        let io = |path: &Path, source| RunError::Io { path: path.to_path_buf(), source };
        std::fs::create_dir_all(folder).map_err(|e| io(folder, e))?;
        if options.existing == Existing::Restart {
            for name in [checkpoint::FILE, crate::log::FILE, "best.safetensors", "last.safetensors"] {
                let _ = std::fs::remove_file(folder.join(name));
            }
        }
        let found = checkpoint::load(folder, config, optimizer(&config.optimizer), device)?;
        let (model, optimizer, progress) = match found {
            Some((_, _, progress)) if options.existing == Existing::Refuse => {
                return Err(RunError::Exists { path: folder.clone(), step: progress.step });
            }
            Some(found) => found,
            None => {
                let model = match &config.start {
                    Some(start) => starting_model(start, config, device)?,
                    None => init::seeded(config.network.init(device), config.seed),
                };
                (model.valid(), optimizer(&config.optimizer), Progress::default())
            }
        };
        let updater = Updater::new(optimizer, &model);
        let path = folder.join("config.toml");
        let text = toml::to_string(config).map_err(|e| io(&path, std::io::Error::other(e)))?;
        write_atomically(&path, text.as_bytes())?;

        let pairs = Arc::new(TrainingPairs::new(config, shapes).map_err(StepError::from)?);
        let severity = Severity::try_from(config.keep.validate_severity).unwrap_or(Severity::ALL[2]);
        let held_out = pairs.validation(severity).map_err(StepError::from)?;
        let plan = Plan::new(config, pairs.epoch_length());
        let log = Log::open(folder, progress.step).map_err(|e| io(folder, e))?;
        let workers = match on_accelerator(config) {
            true => Workers::wide(shards.min(options.threads), options.threads)?,
            false => Workers::new(options.threads)?,
        };
        let started = (Instant::now(), progress.wall_seconds, cpu_seconds(), progress.cpu_seconds);
        Ok(Self {
            config,
            options,
            devices,
            pairs,
            held_out,
            workers,
            plan,
            model,
            updater,
            progress,
            log,
            started,
        })
    }

    fn out_of_time(&self) -> bool {
        self.options.time_limit.is_some_and(|limit| self.started.0.elapsed() >= limit)
    }

    /// One step: gradient, check, clip, update.
    fn step(&mut self, step: usize, rate: f64, ahead: Option<&AheadOf<C>>) -> Result<Losses, RunError> {
        let config = self.config;
        let stage = &config.stages[self.plan.stage(step)];
        let context = StepContext { config, stage, pairs: &self.pairs, devices: &self.devices, ahead };
        let mut outcome = gradient(&context, &self.model, step, &self.workers)?;
        if !outcome.norm.is_finite() {
            self.progress.skipped += 1;
            self.progress.skipped_in_a_row += 1;
            if self.progress.skipped_in_a_row >= MOST_SKIPPED_IN_A_ROW {
                return Err(RunError::NotFinite(self.progress.skipped_in_a_row));
            }
            return Ok(Losses::new());
        }
        self.progress.skipped_in_a_row = 0;
        let clip = config.optimizer.clip_norm;
        if clip > 0.0 && outcome.norm > clip {
            outcome.gradients.scale(clip / outcome.norm);
        }
        let model = self.model.clone();
        self.model = profile::stage("optimizer", || self.updater.step(rate, model, outcome.gradients));
        outcome.losses.insert("gradient_norm", outcome.norm);
        Ok(outcome.losses)
    }

    fn validate(&mut self) -> Result<Validation, RunError> {
        let network = &self.config.network;
        // A GPU takes a whole shard at a time, in the shapes of training.
        let chunk = if on_accelerator(self.config) { self.config.optimizer.shard } else { CHUNK };
        let result = validate(network, &self.model, &self.held_out, chunk, &self.devices[0], &self.workers)?;
        let step = self.progress.step;
        self.log.validation(step, self.plan.epochs(step), &result).map_err(|e| self.io(e))?;
        let value = C::ROWS.last().map_or(f64::NAN, |row| result.scores[row].rmse_r);
        if self.progress.best.is_none_or(|best| value < best) {
            self.progress.best = Some(value);
            self.export("best.safetensors", Some(&result))?;
        }
        Ok(result)
    }

    /// Checkpoint, last weights, picture.
    fn save(&mut self) -> Result<(), RunError> {
        let (start, wall, cpu_start, cpu) = self.started;
        self.progress.wall_seconds = wall + start.elapsed().as_secs_f64();
        self.progress.cpu_seconds = cpu + cpu_seconds() - cpu_start;
        checkpoint::save(
            &self.options.folder,
            self.config,
            &self.model,
            self.updater.optimizer(),
            &self.progress,
        )?;
        self.export("last.safetensors", None)?;
        self.log.draw(C::ROWS, C::CURVES).map_err(|e| self.io(std::io::Error::other(e)))
    }

    /// Weights in half precision, with what is known of them in the header.
    fn export(&self, file: &str, validation: Option<&Validation>) -> Result<(), RunError> {
        let (start, wall, cpu_start, cpu) = self.started;
        let mut notes = BTreeMap::from([
            ("data".to_string(), self.data_note()),
            ("seed".to_string(), self.config.seed.to_string()),
            ("steps".to_string(), self.progress.step.to_string()),
            ("pairs".to_string(), (self.progress.step * self.config.optimizer.batch).to_string()),
            ("wall_seconds".to_string(), format!("{:.0}", wall + start.elapsed().as_secs_f64())),
            ("cpu_seconds".to_string(), format!("{:.0}", cpu + cpu_seconds() - cpu_start)),
            ("version".to_string(), env!("CARGO_PKG_VERSION").to_string()),
        ]);
        for (name, s) in validation.iter().flat_map(|v| &v.scores) {
            let text =
                format!("RMSE(R) {:.3}, MAE(R) {:.3}, median {:.3} deg", s.rmse_r, s.mae_r, s.median_rot_deg);
            notes.insert(format!("validation_{name}"), text);
        }
        let bytes = to_safetensors(&self.model, &self.config.network, &self.config.name, &notes)?;
        write_atomically(&self.options.folder.join(file), &bytes)?;
        Ok(())
    }

    /// What the weights were trained on; no path, for weights travel.
    fn data_note(&self) -> String {
        let (train, held_out) = (self.pairs.epoch_length(), self.held_out.len());
        let what = match self.config.data.source {
            DataSource::Modelnet => "ModelNet40, training split".to_string(),
            DataSource::Shapes => format!("procedural shapes of seed {}", self.config.seed),
        };
        format!("{what}: {train} shapes to train, {held_out} to validate")
    }

    fn io(&self, source: std::io::Error) -> RunError {
        RunError::Io { path: self.options.folder.clone(), source }
    }
}

fn merge((sums, count): &mut (Losses, usize), losses: Losses) {
    *count += usize::from(!losses.is_empty());
    for (name, value) in losses {
        *sums.entry(name).or_insert(0.0) += value;
    }
}

fn mean(window: &mut (Losses, usize)) -> Losses {
    let (sums, count) = std::mem::take(window);
    sums.into_iter().map(|(name, sum)| (name, sum / count.max(1) as f64)).collect()
}

fn message(
    stage: &str,
    epoch: f64,
    rate: f64,
    losses: &Losses,
    batch: usize,
    bar: &indicatif::ProgressBar,
) -> String {
    let total = losses.get("total").copied().unwrap_or(f64::NAN);
    let pairs = bar.per_sec() * batch as f64;
    format!("{stage}  epoch {epoch:.2}  loss {total:.4}  lr {rate:.1e}  {pairs:.1} pairs/s")
}
