//! The seam between the loop and what it trains: a new network is one implementation of [`Trained`].

use std::collections::BTreeMap;
use std::fmt::Debug;

use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor};
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use srrf_cloud::profile::stage;
use srrf_model::ops::{CopyError, HostClouds, to_host};
use srrf_model::weights::WeightsError;
use srrf_model::{NetworkConfig, TrainingBatch};

use crate::stage::StageConfig;

/// Named means over the pairs of a batch.
pub type Losses = BTreeMap<&'static str, f64>;

/// A stage of the training of `C`.
pub type StageOf<C> = StageConfig<<C as Trained>::Parts>;

/// What a network found on the pairs of a batch, for validation.
pub struct FoundPoses {
    /// Rotations `[batch, 3, 3]` and translations `[batch, 3]` in network units, for each of [`Trained::ROWS`].
    pub poses: Vec<(Tensor<3>, Tensor<2>)>,
    /// Means over the pairs of other quantities, by name.
    pub notes: Vec<(&'static str, f64)>,
}

/// A network that the loop trains: its sizes, its losses, its poses.
pub trait Trained: NetworkConfig + JsonSchema {
    /// Weights of the losses, the `[losses]` of a configuration.
    type LossConfig: Clone + Debug + PartialEq + Serialize + DeserializeOwned + JsonSchema + Send + Sync;
    /// What of the network a stage trains: keys of each `[[stages]]`.
    type Parts: Clone + Debug + PartialEq + Serialize + DeserializeOwned + JsonSchema + Send + Sync;
    /// What the network has to know of a batch's clouds before it computes, found ahead of the step by
    /// other threads.
    type Layout: Send;
    /// Name in a configuration, as `method`.
    const METHOD: &'static str;
    /// Poses that validation scores. RMSE(R) of the last one decides which weights are best.
    const ROWS: &'static [&'static str];
    /// Losses in the picture of the curves.
    const CURVES: &'static [&'static str];

    /// Weights by file or name, to start from.
    ///
    /// # Errors
    /// [`WeightsError`] where there are none of this kind.
    fn start(start: &str, device: &Device) -> Result<Self::Network, WeightsError>;

    /// What is wrong with what a stage trains, as key and reason.
    fn wrong_parts(parts: &Self::Parts) -> Option<(&'static str, &'static str)>;

    /// Whether a stage changes the poses, so that validation in it says something.
    fn trains_poses(parts: &Self::Parts) -> bool;

    /// The layout of a batch: its clouds, sources and then targets.
    fn layout(&self, parts: &Self::Parts, clouds: &HostClouds, phase: f32) -> Self::Layout;

    /// What the device can do of a batch ahead of its step, on other threads: what depends on those parts of
    /// `network` alone that none of the `stages` of the run trains. Only called where a device computes beside the host.
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    fn prefetched(
        &self,
        _stages: &[StageOf<Self>],
        _network: &Self::Network,
        _batch: &TrainingBatch,
        layout: Self::Layout,
    ) -> Result<Self::Layout, CopyError> {
        Ok(layout)
    }

    /// Gradients and losses of one batch, on a graph of its own.
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    fn gradient(
        &self,
        losses: &Self::LossConfig,
        parts: &Self::Parts,
        network: &Self::Network,
        batch: TrainingBatch,
        layout: Self::Layout,
    ) -> Result<(GradientsParams, Losses), CopyError>;

    /// The poses of a batch, as at inference.
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    fn found(&self, network: &Self::Network, batch: TrainingBatch) -> Result<FoundPoses, CopyError>;
}

/// The weighted sum of the loss terms, and their values.
#[derive(Default)]
pub struct LossTerms {
    total: Option<Tensor<1>>,
    values: Vec<(&'static str, Tensor<1>)>,
}

impl LossTerms {
    /// Adds a term; one of weight 0 is only written down.
    pub fn add(&mut self, name: &'static str, value: Tensor<1>, weight: f64) {
        self.values.push((name, value.clone().detach()));
        if weight != 0.0 {
            let term = value * weight;
            self.total = Some(match self.total.take() {
                Some(total) => total + term,
                None => term,
            });
        }
    }

    /// The gradient of the sum for the parameters of `network`, and the values.
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn finish<M: Module>(self, network: &M) -> Result<(GradientsParams, Losses), CopyError> {
        let (mut names, mut values): (Vec<_>, Vec<_>) = self.values.into_iter().unzip();
        let mut gradients = GradientsParams::new();
        if let Some(total) = self.total {
            names.push("total");
            values.push(total.clone().detach());
            gradients = stage("backward", || GradientsParams::from_grads(total.backward(), network));
        }
        // Read last and at once: a device that works ahead would have to stop for each.
        let values: Vec<f64> = to_host(&Tensor::cat(values, 0))?;
        Ok((gradients, names.into_iter().zip(values).collect()))
    }
}
