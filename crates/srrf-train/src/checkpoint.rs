//! Checkpoints: parameters, optimiser and position in one file, written aside and renamed, so that
//! a run that is killed at any moment goes on from the last one with the same result.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use burn::module::Module;
use burn::optim::ModuleOptimizer;
use burn::tensor::{Bytes, Device};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use srrf_model::init;
use srrf_model::weights::{WeightsError, parameters, serialize, with_parameters, write_atomically};

use crate::config::TrainConfig;
use crate::seam::Trained;

/// How the optimiser's state is laid out: by rows of parts (`crate::rows`).
const FORMAT: &str = "rows-1";
/// Header entry of the checksum.
const SUM: &str = "sha256";
/// Name of the checkpoint in the run's folder.
pub const FILE: &str = "checkpoint.safetensors";

/// Why a checkpoint could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] WeightsError),
    /// The file cannot be read.
    #[error("{path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// The file is no checkpoint, or a broken one.
    #[error("{path}: not a usable checkpoint: {why}; remove it to start over")]
    Broken {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        why: String,
    },
    /// A parameter is no number any more.
    #[error(
        "`{name}` is not finite any more: the run diverged, and its last checkpoint is from before. Lower \
         `learning_rate` or `optimizer.clip_norm`"
    )]
    NotFinite {
        /// The parameter.
        name: String,
    },
    /// The checkpoint belongs to another configuration.
    #[error(
        "{path}: made by another configuration ({why}); use another --run folder, or remove it to start over"
    )]
    OtherConfig {
        /// The file.
        path: PathBuf,
        /// What differs.
        why: String,
    },
}

/// Where a run stands, beside its parameters.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RunProgress {
    /// Steps done.
    pub step: usize,
    /// Steps left out because a loss or gradient was not finite.
    pub skipped: usize,
    /// How many of the last steps in a row were left out.
    pub skipped_in_a_row: usize,
    /// Best validation value so far.
    pub best: Option<f64>,
    /// Seconds of wall time in all sessions.
    pub wall_seconds: f64,
    /// Seconds of processor time in all sessions.
    pub cpu_seconds: f64,
    /// The losses since the last line of the log, so that the next line is that of a run without a break.
    #[serde(default)]
    pub window: SavedWindow,
}

/// Sums of losses over some steps.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SavedWindow {
    /// By the names of the losses, as the bits of their sums: JSON may round numbers.
    pub sums: BTreeMap<String, u64>,
    /// Steps that had any.
    pub steps: usize,
}

/// Writes the checkpoint of `folder`.
///
/// # Errors
/// [`CheckpointError::Write`] or [`CheckpointError::NotFinite`]; the old checkpoint is then unharmed.
pub fn save<C: Trained>(
    folder: &Path,
    config: &TrainConfig<C>,
    model: &C::Network,
    optimizer: &ModuleOptimizer,
    progress: &RunProgress,
) -> Result<(), CheckpointError> {
    let path = folder.join(FILE);
    let broken = |why: String| CheckpointError::Broken { path: path.clone(), why };
    let parameters =
        parameters(model).map_err(|source| WeightsError::Copy { origin: "the network".into(), source })?;
    if let Some((name, _)) =
        parameters.iter().find(|(_, (_, values))| values.iter().any(|value| !value.is_finite()))
    {
        return Err(CheckpointError::NotFinite { name: name.clone() });
    }
    let mut tensors: Vec<(String, Dtype, Vec<usize>, Vec<u8>)> = parameters
        .into_iter()
        .map(|(name, (shape, values))| {
            let bytes = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            (format!("model.{name}"), Dtype::F32, shape, bytes)
        })
        .collect();
    let state = optimizer.into_bytes().map_err(|e| broken(e.to_string()))?;
    tensors.push(("optimizer".into(), Dtype::U8, vec![state.len()], state.to_vec()));
    let views = tensors
        .iter()
        .map(|(name, dtype, shape, bytes)| Ok((name.clone(), TensorView::new(*dtype, shape.clone(), bytes)?)))
        .collect::<Result<Vec<_>, safetensors::SafeTensorError>>()
        .map_err(|e| broken(e.to_string()))?;
    let json = |value: Result<String, serde_json::Error>| value.map_err(|e| broken(e.to_string()));
    let mut header = BTreeMap::from([
        ("progress".to_string(), json(serde_json::to_string(progress))?),
        ("config".to_string(), json(serde_json::to_string(config))?),
        ("format".to_string(), FORMAT.to_string()),
    ]);
    let sum = checksum(
        tensors.iter().map(|(name, _, _, bytes)| (name.as_str(), bytes.as_slice())),
        header.iter().map(|(key, text)| (key.as_str(), text.as_str())),
    );
    header.insert(SUM.to_string(), sum);
    let bytes = serialize(views, &header).map_err(|e| broken(e.to_string()))?;
    write_atomically(&path, &bytes)?;
    Ok(())
}

/// SHA-256 over the names and bytes of tensors and of header entries, but for the checksum itself, in the order of the names.
fn checksum<'a>(
    tensors: impl Iterator<Item = (&'a str, &'a [u8])>,
    entries: impl Iterator<Item = (&'a str, &'a str)>,
) -> String {
    let tensors: BTreeMap<&str, &[u8]> = tensors.collect();
    let entries: BTreeMap<&str, &[u8]> =
        entries.filter(|(key, _)| *key != SUM).map(|(key, text)| (key, text.as_bytes())).collect();
    let mut hash = Sha256::new();
    for (name, bytes) in tensors.into_iter().chain(entries) {
        hash.update((name.len() as u64).to_le_bytes());
        hash.update(name.as_bytes());
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(bytes);
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Reads the checkpoint of `folder`, if there is one.
///
/// # Errors
/// [`CheckpointError`] for broken files and for checkpoints of another configuration.
pub fn load<C: Trained>(
    folder: &Path,
    config: &TrainConfig<C>,
    optimizer: ModuleOptimizer,
    device: &Device,
) -> Result<Option<(C::Network, ModuleOptimizer, RunProgress)>, CheckpointError> {
    let path = folder.join(FILE);
    let bytes = match std::fs::read(&path) {
        Ok(bytes) => bytes,
        Err(source) if source.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(CheckpointError::Read { path, source }),
    };
    let broken = |why: String| CheckpointError::Broken { path: path.clone(), why };
    let (_, header) = SafeTensors::read_metadata(&bytes).map_err(|e| broken(e.to_string()))?;
    let header = header.metadata().clone().unwrap_or_default();
    let entry = |key: &str| header.get(key).ok_or_else(|| broken(format!("no `{key}` in its header")));
    if header.get("format").is_none_or(|format| format != FORMAT) {
        return Err(broken("written by another version of this program".into()));
    }
    let progress: RunProgress =
        serde_json::from_str(entry("progress")?).map_err(|e| broken(e.to_string()))?;
    let (saved, wanted) =
        comparable(entry("config")?, config).map_err(|e: serde_json::Error| broken(e.to_string()))?;
    if let Some(key) = first_difference(&saved, &wanted, String::new()) {
        return Err(CheckpointError::OtherConfig { path, why: format!("`{key}` differs") });
    }

    let tensors = SafeTensors::deserialize(&bytes).map_err(|e| broken(e.to_string()))?.tensors();
    // Checkpoints of version 0.1.0 have none.
    if let Some(sum) = header.get(SUM)
        && *sum
            != checksum(
                tensors.iter().map(|(name, view)| (name.as_str(), view.data())),
                header.iter().map(|(key, text)| (key.as_str(), text.as_str())),
            )
    {
        return Err(broken("its checksum is another one, so that it is damaged".into()));
    }
    let mut values = BTreeMap::new();
    let mut state = None;
    for (name, view) in tensors {
        if let Some(name) = name.strip_prefix("model.") {
            let data =
                view.data().chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
            values.insert(name.to_string(), (view.shape().to_vec(), data));
        } else if name == "optimizer" {
            state = Some(Bytes::from_bytes_vec(view.data().to_vec()));
        }
    }
    let state = state.ok_or_else(|| broken("no optimiser state in it".into()))?;
    let model = init::seeded(config.network.init(device), config.seed);
    let model = with_parameters(model, values).map_err(|(name, why)| broken(format!("`{name}`: {why}")))?;
    let optimizer = optimizer.from_bytes(state).map_err(|e| broken(e.to_string()))?;
    Ok(Some((model.valid(), optimizer, progress)))
}

/// The configuration of a checkpoint and that of the run in one spelling, without the devices, for a run may go on on
/// others.
fn comparable<C: Trained>(
    saved: &str,
    config: &TrainConfig<C>,
) -> Result<(serde_json::Value, serde_json::Value), serde_json::Error> {
    let mut saved: serde_json::Value = serde_json::from_str(saved)?;
    if let Some(saved) = saved.as_object_mut() {
        saved.remove("reduce"); // of version 0.1.0, which changed nothing in what was computed
    }
    // Older spellings of a key are read as the newer ones; what is no configuration any more stays as it is.
    if let Ok(read) = serde_json::from_value::<TrainConfig<C>>(saved.clone()) {
        saved = serde_json::to_value(read)?;
    }
    let mut wanted = serde_json::to_value(config)?;
    for config in [&mut saved, &mut wanted].into_iter().filter_map(|config| config.as_object_mut()) {
        config.remove("device");
    }
    Ok((saved, wanted))
}

/// Path of the first entry in which two JSON values differ.
fn first_difference(a: &serde_json::Value, b: &serde_json::Value, at: String) -> Option<String> {
    use serde_json::Value::{Array, Object};
    match (a, b) {
        (Object(a), Object(b)) => a
            .keys()
            .chain(b.keys())
            .find_map(|k| {
                let null = serde_json::Value::Null;
                first_difference(a.get(k).unwrap_or(&null), b.get(k).unwrap_or(&null), format!("{at}.{k}"))
            })
            .map(|path| path.trim_start_matches('.').to_string()),
        (Array(a), Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).enumerate().find_map(|(i, (a, b))| first_difference(a, b, format!("{at}[{i}]")))
        }
        _ => (a != b).then_some(at),
    }
}
