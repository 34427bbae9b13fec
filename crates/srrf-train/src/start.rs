//! What a run starts from: weights of another one, whole or in parts.

use burn::tensor::Device;
use srrf_model::init;
use srrf_model::weights::{parameters, with_parameters};

use crate::config::{StartConfig, TrainConfig};
use crate::network::Trained;
use crate::run::RunError;

/// The weights that `start` of the configuration names. Parameters that only this network has keep their
/// initial values.
pub(crate) fn starting_model<C: Trained>(
    start: &StartConfig,
    config: &TrainConfig<C>,
    device: &Device,
) -> Result<C::Network, RunError> {
    let fresh = init::seeded(config.network.init(device), config.seed);
    let mut values = parameters(&fresh)?;
    let parts: Vec<(&str, &String)> = match start {
        StartConfig::Whole(start) => vec![("", start)],
        StartConfig::Parts(parts) => parts.iter().map(|(part, start)| (part.as_str(), start)).collect(),
    };
    for (part, start) in parts {
        let wrong = |name: String| RunError::Start { start: start.clone(), name };
        let within = |name: &String| part.is_empty() || name.split('.').next() == Some(part);
        let unread = |source| RunError::StartFile { start: start.clone(), source };
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
    with_parameters(fresh, values).map_err(|(name, _)| RunError::Start { start: format!("{start:?}"), name })
}
