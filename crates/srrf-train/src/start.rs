//! What a session starts from: the checkpoint of the run, weights of another one, or random values.

use burn::module::Module;
use burn::optim::ModuleOptimizer;
use burn::tensor::Device;
use srrf_model::init;
use srrf_model::weights::WeightsError;
use srrf_model::weights::{parameters, with_parameters, write_atomically};

use crate::checkpoint::{self, RunProgress};
use crate::config::{StartConfig, TrainConfig};
use crate::error::TrainError;
use crate::folder::{CONFIG, RunFolder};
use crate::optimizer::optimizer;
use crate::options::{Existing, RunOptions};
use crate::seam::Trained;

/// Where a session starts.
pub(crate) struct StartingPoint<C: Trained> {
    /// The folder of the run, which this process has to itself.
    pub folder: RunFolder,
    /// The network.
    pub model: C::Network,
    /// The optimiser.
    pub optimizer: ModuleOptimizer,
    /// Where the run stands.
    pub progress: RunProgress,
}

/// Takes the folder and finds where the run stands. Changes nothing of a run that is there.
pub(crate) fn start<C: Trained>(
    config: &TrainConfig<C>,
    options: &RunOptions,
    device: &Device,
) -> Result<StartingPoint<C>, TrainError> {
    let folder = RunFolder::open(&options.folder)?;
    let found = match options.existing {
        Existing::Restart => None,
        _ => checkpoint::load(&options.folder, config, optimizer(&config.optimizer), device)?,
    };
    let (model, optimizer, progress) = match found {
        Some((_, _, progress)) if options.existing == Existing::Refuse => {
            return Err(TrainError::Exists { path: options.folder.clone(), step: progress.step });
        }
        Some(found) => found,
        None => {
            let model = match &config.start {
                Some(start) => starting_model(start, config, device)?,
                None => init::seeded(config.network.init(device), config.seed),
            };
            (model.valid(), optimizer(&config.optimizer), RunProgress::default())
        }
    };
    Ok(StartingPoint { folder, model, optimizer, progress })
}

/// Once everything that the run needs is there: moves a run that it replaces aside, and leaves the resolved configuration.
pub(crate) fn begin<C: Trained>(
    folder: &RunFolder,
    config: &TrainConfig<C>,
    options: &RunOptions,
) -> Result<(), TrainError> {
    let path = options.folder.join(CONFIG);
    let text = toml::to_string(config)
        .map_err(|e| TrainError::Io { path: path.clone(), source: std::io::Error::other(e) })?;
    if options.existing == Existing::Restart {
        folder.set_aside()?;
    }
    Ok(write_atomically(&path, text.as_bytes())?)
}

/// The weights that `start` of the configuration names. Parameters that only this network has keep their
/// initial values.
fn starting_model<C: Trained>(
    start: &StartConfig,
    config: &TrainConfig<C>,
    device: &Device,
) -> Result<C::Network, TrainError> {
    let fresh = init::seeded(config.network.init(device), config.seed);
    let mut values = parameters(&fresh)?;
    let parts: Vec<(&str, &String)> = match start {
        StartConfig::Whole(start) => vec![("", start)],
        StartConfig::Parts(parts) => parts.iter().map(|(part, start)| (part.as_str(), start)).collect(),
    };
    for (part, start) in parts {
        let wrong = |name: String| TrainError::Start { start: start.clone(), name };
        let within = |name: &String| part.is_empty() || name.split('.').next() == Some(part);
        let unread =
            |source: WeightsError| TrainError::StartFile { start: start.clone(), source: Box::new(source) };
        let loaded = C::start(start, device).map_err(unread)?;
        let theirs: Vec<_> = parameters(&loaded)?.into_iter().filter(|(name, _)| within(name)).collect();
        if theirs.is_empty() {
            return Err(wrong(part.to_string()));
        }
        for (name, theirs) in theirs {
            match values.get_mut(&name) {
                Some(ours) if ours.0 == theirs.0 => *ours = theirs,
                _ => return Err(wrong(name)),
            }
        }
    }
    with_parameters(fresh, values)
        .map_err(|(name, _)| TrainError::Start { start: format!("{start:?}"), name })
}
