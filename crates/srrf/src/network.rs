//! The network as a source of starts.

use std::sync::{Arc, OnceLock};

use schemars::JsonSchema;
use serde::Serialize;
use srrf_cloud::{PointCloud, Register, RegisterError, Registration, Rigid, thin_to};
use srrf_model::weights::LoadedModel;
use srrf_model::{SrrfRegister, embedded};

use crate::error::Error;
use crate::options::DEFAULT_DEVICE;

/// Points of the cloud that the network chooses its 1,024 from: enough to look evenly over a scan.
const THINNED: usize = 8192;
/// Tokens of the dense branch where the network only glances at a pair.
const GLANCE_TOKENS: usize = 128;

/// Which weights a network has.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct WeightsId {
    /// Their name.
    pub name: String,
    /// Their SHA-256, in hexadecimal.
    pub sha256: String,
}

/// A loaded network.
#[derive(Debug)]
pub struct Network {
    register: SrrfRegister,
    glance: SrrfRegister,
    /// Which one it is.
    pub weights: WeightsId,
}

impl Network {
    /// Loads weights: a file, or the name of a model in the program; the default if `None`.
    ///
    /// # Errors
    /// [`Error::Weights`], [`Error::Device`].
    pub fn load(from: Option<&str>, device: &str) -> Result<Self, Error> {
        let loaded = open(from, device)?;
        let device = srrf_model::device(device).map_err(Error::Device)?;
        let weights = WeightsId { name: loaded.name.clone(), sha256: loaded.sha256.clone() };
        let glance = SrrfRegister::glance(loaded.clone(), device.clone(), GLANCE_TOKENS);
        Ok(Self { register: SrrfRegister::new(loaded, device), glance, weights })
    }

    /// The network's poses after `start` has moved the source.
    ///
    /// # Errors
    /// [`RegisterError`] for clouds that it cannot take.
    pub fn look_from(
        &self,
        source: &PointCloud,
        target: &PointCloud,
        start: &Rigid,
    ) -> Result<Registration, RegisterError> {
        Ok(self.register.register(&source.transformed(start), target)?.after(start))
    }

    /// As [`Network::look_from`], faster and less exact: one pass on fewer tokens. It is for looking around.
    ///
    /// # Errors
    /// As [`Network::look_from`].
    pub fn glance_from(
        &self,
        source: &PointCloud,
        target: &PointCloud,
        start: &Rigid,
    ) -> Result<Registration, RegisterError> {
        Ok(self.glance.register(&source.transformed(start), target)?.after(start))
    }
}

/// A network that is loaded when it is first asked: many pairs never ask.
#[derive(Debug)]
pub struct LazyNetwork {
    weights: Option<String>,
    device: String,
    loaded: OnceLock<Result<Network, Arc<Error>>>,
}

impl LazyNetwork {
    /// Weights that a user names, and devices other than the default, are tried at once: their faults belong to the start.
    ///
    /// # Errors
    /// As [`Network::load`].
    pub fn new(weights: Option<&str>, device: &str) -> Result<Self, Error> {
        let lazy =
            Self { weights: weights.map(str::to_owned), device: device.to_owned(), loaded: OnceLock::new() };
        if weights.is_some() || device != DEFAULT_DEVICE {
            let network = Network::load(weights, device)?;
            lazy.loaded.get_or_init(|| Ok(network));
        }
        Ok(lazy)
    }

    /// The network.
    ///
    /// # Errors
    /// [`RegisterError::NoPose`] where it cannot be loaded.
    pub fn get(&self) -> Result<&Network, RegisterError> {
        let load = || Network::load(self.weights.as_deref(), &self.device).map_err(Arc::new);
        self.loaded.get_or_init(load).as_ref().map_err(|why| RegisterError::NoPose(Box::new(Arc::clone(why))))
    }
}

/// Loads weights, a file or the name of a model in the program (`None`: the default), to the device of
/// a name.
///
/// # Errors
/// [`Error::Weights`], [`Error::Device`].
pub fn open(from: Option<&str>, device: &str) -> Result<LoadedModel, Error> {
    let device = srrf_model::device(device).map_err(Error::Device)?;
    let loaded = from.map_or_else(|| embedded::load_default(&device), |name| embedded::open(name, &device));
    loaded.map_err(Error::Weights)
}

/// An even part of a large cloud: voxel centroids, [`THINNED`] or fewer. A cloud that is small already
/// stays as it is.
pub fn thinned(cloud: &PointCloud) -> PointCloud {
    thin_to(cloud, THINNED, cloud.to_unit_sphere().1.radius)
}
