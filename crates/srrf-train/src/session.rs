//! A training from its configuration file: what a program calls.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use srrf_args::Places;
use srrf_baselines::{BASELINES, BaselineVisitor, LearnedConfig, visit};
use srrf_model::SrrfConfig;

use crate::checkpoint;
use crate::config::{ConfigError, Layers, StartConfig, TrainConfig, read_layers};
use crate::data::training_shapes;
use crate::error::TrainError;
use crate::folder::{BEST, CONFIG, LAST};
use crate::log;
use crate::nets::baseline::Baseline;
use crate::options::{Ended, Existing, RunOptions};
use crate::run::run;
use crate::seam::Trained;

/// What a caller says beside the configuration.
pub struct Overrides {
    /// Where the shapes are; before `data.path` of the configuration.
    pub data: Option<PathBuf>,
    /// Where the shapes are by the environment; before `data.path` of the configuration too, and of no concern to one that
    /// trains on built-in shapes.
    pub environment_data: Option<PathBuf>,
    /// Folder of the run; `runs/NAME` if not given.
    pub folder: Option<PathBuf>,
    /// Device; before `device` of the configuration, and `flex` if neither is given.
    pub device: Option<String>,
    /// Worker threads.
    pub threads: usize,
    /// What to do with a checkpoint that is there.
    pub existing: Existing,
    /// Stop after this many steps, counted from the start of the run.
    pub until_step: Option<usize>,
    /// Stop after this time.
    pub time_limit: Option<Duration>,
    /// Where lines about the run go.
    pub say: fn(&str),
}

/// Trains what the configuration at `path` names (a file, or a run of a list, `list.toml#name`), until done, out of time, or told to `stop`.
///
/// # Errors
/// [`TrainError`]; the last checkpoint stays usable.
pub fn train(path: &Path, overrides: &Overrides, stop: &AtomicBool) -> Result<Ended, TrainError> {
    train_layers(&read_layers(path)?, overrides, stop)
}

/// Trains what configuration files say together; see [`train`].
///
/// # Errors
/// [`TrainError`]; the last checkpoint stays usable.
pub fn train_layers(layers: &Layers, overrides: &Overrides, stop: &AtomicBool) -> Result<Ended, TrainError> {
    let method = layers.method()?;
    let session = Session { layers, overrides, stop };
    if method == SrrfConfig::METHOD {
        return session.train::<SrrfConfig>();
    }
    visit(&method, session).unwrap_or_else(|| {
        let baselines = BASELINES.iter().map(|entry| entry.name);
        let known: Vec<&str> = [SrrfConfig::METHOD].into_iter().chain(baselines).collect();
        Err(TrainError::Method { path: layers.path().into(), method, known: known.join(", ") })
    })
}

struct Session<'a> {
    layers: &'a Layers,
    overrides: &'a Overrides,
    stop: &'a AtomicBool,
}

impl BaselineVisitor for Session<'_> {
    type Output = Result<Ended, TrainError>;

    fn visit<C: LearnedConfig + 'static>(self) -> Self::Output {
        self.train::<Baseline<C>>()
    }
}

impl Session<'_> {
    fn train<C: Trained>(self) -> Result<Ended, TrainError> {
        let Self { layers, overrides, stop } = self;
        let mut config = TrainConfig::<C>::resolve(layers)?;
        let folder = overrides.folder.clone().unwrap_or_else(|| Path::new("runs").join(&config.name));
        check_places(layers, &config, &folder)?;
        let device = overrides.device.clone().or(config.device.take()).unwrap_or_else(|| "flex".into());
        let devices = srrf_model::devices(&device)?;
        config.device = Some(device.clone());
        let shapes =
            training_shapes(&config, overrides.data.as_deref(), overrides.environment_data.as_deref())?;
        let options = RunOptions {
            folder,
            threads: overrides.threads,
            existing: overrides.existing,
            until_step: overrides.until_step,
            time_limit: overrides.time_limit,
            say: overrides.say,
        };
        (options.say)(&format!("config {}, data {}", layers.path().display(), shapes.description()));
        let folder = options.folder.display();
        (options.say)(&format!("run {folder}, device {device}, {} threads", options.threads));
        run(&config, &options, shapes, devices, stop)
    }
}

/// Checks that the run writes none of the files that it reads. Its own resolved configuration loses nothing by being
/// written again.
fn check_places<C: Trained>(
    layers: &Layers,
    config: &TrainConfig<C>,
    folder: &Path,
) -> Result<(), TrainError> {
    let resolved = toml::to_string(config).ok();
    let mut places = Places::new();
    if layers.alone().is_none() || layers.alone() != resolved.as_deref() {
        for path in layers.files() {
            places = places.reads("the configuration", path);
        }
    }
    let starts: Vec<&String> = match &config.start {
        None => Vec::new(),
        Some(StartConfig::Whole(start)) => vec![start],
        Some(StartConfig::Parts(parts)) => parts.values().collect(),
    };
    for start in starts.into_iter().map(Path::new).filter(|start| start.is_file()) {
        places = places.reads("`start` of the configuration", start);
    }
    for name in [CONFIG, BEST, LAST, checkpoint::FILE, log::FILE, log::PICTURE] {
        places = places.writes_into("the run's folder", folder, name);
    }
    places.check().map_err(|failure| TrainError::Places(Box::new(failure)))
}

impl Layers {
    /// The `method` of a configuration, `srrf` if it names none.
    ///
    /// # Errors
    /// [`ConfigError`] where it is no text.
    pub fn method(&self) -> Result<String, ConfigError> {
        match self.merged().get("method") {
            None => Ok(SrrfConfig::METHOD.to_string()),
            Some(toml::Value::String(method)) => Ok(method.clone()),
            Some(_) => Err(ConfigError::Value {
                path: self.path().into(),
                key: "method".into(),
                why: "must be text".into(),
            }),
        }
    }
}
