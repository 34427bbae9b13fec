//! The weights that a run leaves: half precision, with what is known of them in the header.

use std::collections::BTreeMap;
use std::path::Path;

use srrf_model::weights::{WeightsError, to_safetensors, write_atomically};

use crate::checkpoint::RunProgress;
use crate::config::{DataSource, TrainConfig};
use crate::seam::Trained;
use crate::validate::Validation;

/// What is known of the weights beside their configuration.
pub(crate) struct Provenance<'a> {
    /// Where the run stands.
    pub progress: &'a RunProgress,
    /// Shapes to train on.
    pub training: usize,
    /// Pairs to validate on.
    pub validation: usize,
    /// The scores of the weights, if they were validated.
    pub scores: Option<&'a Validation>,
}

/// Writes `model` into `path`.
///
/// # Errors
/// [`WeightsError`], also where a number of the weights is not finite; what is there is then unharmed.
pub(crate) fn export<C: Trained>(
    path: &Path,
    model: &C::Network,
    config: &TrainConfig<C>,
    known: &Provenance<'_>,
) -> Result<(), WeightsError> {
    let progress = known.progress;
    let mut notes = BTreeMap::from([
        ("data".to_string(), data_note(config, known)),
        ("seed".to_string(), config.seed.to_string()),
        ("steps".to_string(), progress.step.to_string()),
        ("pairs".to_string(), (progress.step * config.optimizer.batch).to_string()),
        ("wall_seconds".to_string(), format!("{:.0}", progress.wall_seconds)),
        ("cpu_seconds".to_string(), format!("{:.0}", progress.cpu_seconds)),
        ("version".to_string(), env!("CARGO_PKG_VERSION").to_string()),
    ]);
    for (name, s) in known.scores.iter().flat_map(|v| &v.scores) {
        let text =
            format!("RMSE(R) {:.3}, MAE(R) {:.3}, median {:.3} deg", s.rmse_r, s.mae_r, s.median_rot_deg);
        notes.insert(format!("validation_{name}"), text);
    }
    let bytes = to_safetensors(model, &config.network, &config.name, &notes)?;
    write_atomically(path, &bytes)
}

/// What the weights were trained on; no path, for weights travel.
fn data_note<C: Trained>(config: &TrainConfig<C>, known: &Provenance<'_>) -> String {
    let what = match config.data.source {
        DataSource::Modelnet => "ModelNet40, training split".to_string(),
        DataSource::Shapes => format!("procedural shapes of seed {}", config.seed),
    };
    format!("{what}: {} shapes to train, {} to validate", known.training, known.validation)
}
