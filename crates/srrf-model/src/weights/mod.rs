//! Weights as safetensors: every parameter under its path, with the network's sizes and a model
//! card in the header.

mod error;
mod parameters;
mod serialize;

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use burn::module::Module;
use burn::tensor::Device;
use half::f16;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use sha2::{Digest, Sha256};

use crate::sizes::NetworkConfig;
use crate::srrf::SrrfConfig;

pub use error::WeightsError;
pub use parameters::{parameters, with_parameters};
pub use serialize::serialize;

/// Header key of the model's name.
const NAME_KEY: &str = "name";

/// A network with what its file says about it.
#[derive(Debug, Clone)]
pub struct LoadedModel<C: NetworkConfig = SrrfConfig> {
    /// The network, on the device, without gradients.
    pub model: C::Network,
    /// Its sizes.
    pub config: C,
    /// Name of the model, such as `srrf`.
    pub name: String,
    /// SHA-256 of the file, in hexadecimal.
    pub sha256: String,
    /// All header entries.
    pub metadata: HashMap<String, String>,
}

impl<C: NetworkConfig> LoadedModel<C> {
    /// Numbers that were learned.
    pub fn parameter_count(&self) -> usize {
        self.model.num_params()
    }
}

/// Serialises a network in half precision, with its sizes and `notes` in the header.
///
/// # Errors
/// [`WeightsError::NotFinite`] for a parameter that is not finite, or does not fit half precision, [`WeightsError::Copy`]
/// where the device does not give it, [`WeightsError::Format`] or [`WeightsError::Header`] if the header cannot be written.
pub fn to_safetensors<C: NetworkConfig>(
    model: &C::Network,
    config: &C,
    name: &str,
    notes: &BTreeMap<String, String>,
) -> Result<Vec<u8>, WeightsError> {
    let origin = || format!("weights of {name}");
    let parameters = parameters(model).map_err(|source| WeightsError::Copy { origin: origin(), source })?;
    let halved = |(path, (shape, values)): (String, (Vec<usize>, Vec<f32>))| {
        let values: Vec<f16> = values.into_iter().map(f16::from_f32).collect();
        if values.iter().any(|v| !v.is_finite()) {
            return Err(WeightsError::NotFinite { origin: origin(), name: path });
        }
        Ok((path, shape, values.into_iter().flat_map(f16::to_le_bytes).collect()))
    };
    let tensors: Vec<(String, Vec<usize>, Vec<u8>)> =
        parameters.into_iter().map(halved).collect::<Result<_, _>>()?;
    let views = tensors
        .iter()
        .map(|(path, shape, bytes)| Ok((path.clone(), TensorView::new(Dtype::F16, shape.clone(), bytes)?)))
        .collect::<Result<Vec<_>, _>>()
        .map_err(|source| WeightsError::Format { origin: origin(), source })?;
    let config = header_json(config, &origin())?;
    let mut header = notes.clone();
    header.insert(C::KEY.into(), config);
    header.insert(NAME_KEY.into(), name.into());
    serialize(views, &header).map_err(|source| WeightsError::Format { origin: origin(), source })
}

/// Writes a network to `path`, whole or not at all, as [`to_safetensors`] has it.
///
/// # Errors
/// As [`to_safetensors`], and [`WeightsError::Io`]; the old file, if any, is then unharmed.
pub fn save<C: NetworkConfig>(
    path: &Path,
    model: &C::Network,
    config: &C,
    name: &str,
    notes: &BTreeMap<String, String>,
) -> Result<(), WeightsError> {
    write_atomically(path, &to_safetensors(model, config, name, notes)?)
}

/// The same weights with another configuration in the header, of the same sizes: how the network is used. Tensors and all
/// other entries stay as they are; `origin` names the bytes in errors.
///
/// # Errors
/// As [`parse`], also for a configuration whose sizes are not those of the weights.
pub fn with_config<C: NetworkConfig>(
    bytes: &[u8],
    origin: &str,
    config: &C,
) -> Result<Vec<u8>, WeightsError> {
    let format = |source| WeightsError::Format { origin: origin.to_owned(), source };
    let (_, header) = SafeTensors::read_metadata(bytes).map_err(format)?;
    let mut metadata: BTreeMap<String, String> =
        header.metadata().clone().unwrap_or_default().into_iter().collect();
    metadata.insert(C::KEY.into(), header_json(config, origin)?);
    let tensors = SafeTensors::deserialize(bytes).map_err(format)?;
    let written = serialize(tensors.tensors(), &metadata).map_err(format)?;
    parse::<C>(&written, origin, &Device::flex())?;
    Ok(written)
}

/// The configuration as the header has it.
fn header_json<C: NetworkConfig>(config: &C, origin: &str) -> Result<String, WeightsError> {
    serde_json::to_string(config).map_err(|why| WeightsError::Header {
        origin: origin.to_owned(),
        key: C::KEY,
        why: why.to_string(),
    })
}

/// Reads an SRRF network from the bytes of a safetensors file; `origin` names them in errors.
///
/// # Errors
/// [`WeightsError`] for broken files and for weights of another architecture.
pub fn from_safetensors(bytes: &[u8], origin: &str, device: &Device) -> Result<LoadedModel, WeightsError> {
    parse::<SrrfConfig>(bytes, origin, device)
}

/// Reads a network of any method from the bytes of a safetensors file; `origin` names them in errors.
///
/// # Errors
/// As [`from_safetensors`].
pub fn parse<C: NetworkConfig>(
    bytes: &[u8],
    origin: &str,
    device: &Device,
) -> Result<LoadedModel<C>, WeightsError> {
    let origin = origin.to_string();
    let format = |source| WeightsError::Format { origin: origin.clone(), source };
    let (_, header) = SafeTensors::read_metadata(bytes).map_err(format)?;
    let metadata = header.metadata().clone().unwrap_or_default();
    let config: C = match metadata.get(C::KEY) {
        Some(json) => serde_json::from_str(json).map_err(|e| e.to_string()),
        None => Err("the entry is missing".to_string()),
    }
    .map_err(|why| WeightsError::Header { origin: origin.clone(), key: C::KEY, why })?;
    config.check_ranges().map_err(|e| WeightsError::Header {
        origin: origin.clone(),
        key: C::KEY,
        why: e.to_string(),
    })?;

    let mut values = BTreeMap::new();
    for (name, view) in SafeTensors::deserialize(bytes).map_err(format)?.tensors() {
        let data: Vec<f32> = match view.dtype() {
            Dtype::F16 => {
                view.data().chunks_exact(2).map(|b| f16::from_le_bytes([b[0], b[1]]).to_f32()).collect()
            }
            Dtype::F32 => {
                view.data().chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
            }
            other => {
                let why = format!("type {other:?} is not supported, only F16 and F32");
                return Err(WeightsError::Parameter { origin, name, why });
            }
        };
        if data.iter().any(|v| !v.is_finite()) {
            return Err(WeightsError::NotFinite { origin, name });
        }
        values.insert(name, (view.shape().to_vec(), data));
    }
    let model = with_parameters(config.init(device), values)
        .map_err(|(name, why)| WeightsError::Parameter { origin: origin.clone(), name, why })?;
    let sha256 = Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect();
    let name = metadata.get(NAME_KEY).cloned().unwrap_or_else(|| "unnamed".into());
    Ok(LoadedModel { model, config, name, sha256, metadata })
}

/// Reads an SRRF network from a safetensors file.
///
/// # Errors
/// As [`from_safetensors`], and [`WeightsError::Io`].
pub fn load(path: &Path, device: &Device) -> Result<LoadedModel, WeightsError> {
    read::<SrrfConfig>(path, device)
}

/// Reads a network of any method from a safetensors file.
///
/// # Errors
/// As [`load`].
pub fn read<C: NetworkConfig>(path: &Path, device: &Device) -> Result<LoadedModel<C>, WeightsError> {
    let bytes = std::fs::read(path).map_err(|source| WeightsError::Io { path: path.into(), source })?;
    parse(&bytes, &path.display().to_string(), device)
}

/// Writes `bytes` to `path`, whole or not at all.
///
/// # Errors
/// [`WeightsError::Io`]; the old file, if any, is then unharmed.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), WeightsError> {
    srrf_cloud::io::write_atomically(path, |out| out.write_all(bytes))
        .map_err(|source| WeightsError::Io { path: path.into(), source })
}
