//! Weights as safetensors: every parameter under its path, with the network's sizes and a model
//! card in the header.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{Device, Tensor, TensorData};
use half::f16;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use sha2::{Digest, Sha256};

use crate::sizes::NetworkConfig;
use crate::srrf::SrrfConfig;

/// Header key of the model's name.
const NAME_KEY: &str = "name";

/// Why weights could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum WeightsError {
    /// The file cannot be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// There is neither a file nor a model in the program of that name.
    #[error("{name}: no such file, and no model of that name in the program (it has {known})")]
    Unknown {
        /// What was asked for.
        name: String,
        /// The names of the models in the program.
        known: String,
    },
    /// The bytes are no safetensors file, or a truncated one.
    #[error("{origin}: not a complete safetensors file: {source}")]
    Format {
        /// Where the bytes came from.
        origin: String,
        /// What the reader said.
        #[source]
        source: safetensors::SafeTensorError,
    },
    /// The header does not describe a network of this program.
    #[error(
        "{origin}: no network description under `{key}` in the header: {why}; was it written by srrf-train, for \
         this method?"
    )]
    Header {
        /// Where the bytes came from.
        origin: String,
        /// The entry that was looked for.
        key: &'static str,
        /// What is wrong.
        why: String,
    },
    /// A parameter is missing, has another shape, or is of an unsupported type.
    #[error("{origin}: parameter `{name}`: {why}; these weights belong to a network of another architecture")]
    Parameter {
        /// Where the bytes came from.
        origin: String,
        /// Path of the parameter.
        name: String,
        /// What is wrong.
        why: String,
    },
}

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

/// The parameters of a module by path, as `(shape, values)`.
pub fn parameters<M: Module>(module: &M) -> BTreeMap<String, (Vec<usize>, Vec<f32>)> {
    let mut collector = Collector { path: Vec::new(), found: BTreeMap::new() };
    module.visit(&mut collector);
    collector.found
}

struct Collector {
    path: Vec<String>,
    found: BTreeMap<String, (Vec<usize>, Vec<f32>)>,
}

impl ModuleVisitor for Collector {
    fn enter_module(&mut self, name: &str, _container_type: &str) {
        self.path.push(name.to_string());
    }

    fn exit_module(&mut self, _name: &str, _container_type: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let tensor = param.val();
        let values = tensor.try_to_vec_as::<f32>().unwrap_or_default();
        self.found.insert(self.path.join("."), (tensor.dims().to_vec(), values));
    }
}

/// Replaces every parameter of `module` by the one of the same path in `values`.
///
/// # Errors
/// The path and what is wrong with it, for the first parameter that is missing, has another shape,
/// or is left over.
pub fn with_parameters<M: Module>(
    module: M,
    values: BTreeMap<String, (Vec<usize>, Vec<f32>)>,
) -> Result<M, (String, String)> {
    let mut applier = Applier { path: Vec::new(), values, failed: None };
    let module = module.map(&mut applier);
    if let Some(failed) = applier.failed {
        return Err(failed);
    }
    match applier.values.into_keys().next() {
        Some(name) => Err((name, "the network has no such parameter".to_string())),
        None => Ok(module),
    }
}

struct Applier {
    path: Vec<String>,
    values: BTreeMap<String, (Vec<usize>, Vec<f32>)>,
    failed: Option<(String, String)>,
}

impl ModuleMapper for Applier {
    fn enter_module(&mut self, name: &str, _container_type: &str) {
        self.path.push(name.to_string());
    }

    fn exit_module(&mut self, _name: &str, _container_type: &str) {
        self.path.pop();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let name = self.path.join(".");
        let (id, tensor, mapper) = param.consume();
        let wanted = tensor.dims();
        let tensor = match self.values.remove(&name) {
            Some((shape, values)) if shape == wanted => {
                Tensor::from_data(TensorData::new(values, wanted), (&tensor.device(), tensor.dtype()))
            }
            found => {
                let why = match found {
                    Some((shape, _)) => format!("the file has shape {shape:?}, the network {wanted:?}"),
                    None => "missing from the file".to_string(),
                };
                self.failed.get_or_insert((name, why));
                tensor
            }
        };
        Param::from_mapped_value(id, tensor, mapper)
    }
}

/// Serialises a network in half precision, with its sizes and `notes` in the header.
///
/// # Errors
/// [`WeightsError::Format`] or [`WeightsError::Header`] if the header cannot be written.
pub fn to_safetensors<C: NetworkConfig>(
    model: &C::Network,
    config: &C,
    name: &str,
    notes: &BTreeMap<String, String>,
) -> Result<Vec<u8>, WeightsError> {
    let origin = || format!("weights of {name}");
    let tensors: Vec<(String, Vec<usize>, Vec<u8>)> = parameters(model)
        .into_iter()
        .map(|(path, (shape, values))| {
            (path, shape, values.iter().flat_map(|&v| f16::from_f32(v).to_le_bytes()).collect())
        })
        .collect();
    let views = tensors
        .iter()
        .map(|(path, shape, bytes)| Ok((path.as_str(), TensorView::new(Dtype::F16, shape.clone(), bytes)?)))
        .collect::<Result<Vec<_>, _>>()
        .map_err(|source| WeightsError::Format { origin: origin(), source })?;
    let config = serde_json::to_string(config).map_err(|why| WeightsError::Header {
        origin: origin(),
        key: C::KEY,
        why: why.to_string(),
    })?;
    let mut header: HashMap<String, String> = notes.iter().map(|(k, v)| (k.clone(), v.clone())).collect();
    header.insert(C::KEY.into(), config);
    header.insert(NAME_KEY.into(), name.into());
    safetensors::serialize(views, Some(header))
        .map_err(|source| WeightsError::Format { origin: origin(), source })
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
    config.check().map_err(|e| WeightsError::Header {
        origin: origin.clone(),
        key: C::KEY,
        why: e.to_string(),
    })?;

    let mut values = BTreeMap::new();
    for (name, view) in SafeTensors::deserialize(bytes).map_err(format)?.tensors() {
        let data = match view.dtype() {
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
