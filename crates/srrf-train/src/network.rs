//! The seam between the loop and what it trains: a new network is one implementation of [`Trained`].

use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor};
use serde::Serialize;
use serde::de::DeserializeOwned;
use srrf_cloud::Rigid;
use srrf_cloud::profile::stage;
use srrf_model::ops::{CopyError, HostClouds, to_host};
use srrf_model::weights::WeightsError;
use srrf_model::{NetworkConfig, PairBatch};

use crate::config::StageConfig;
use crate::step::Losses;

/// Pairs that go through the network together, with their true poses in network units.
pub struct Shard {
    /// The clouds.
    pub batch: PairBatch,
    /// `[batch, 3, 3]`.
    pub rotation: Tensor<3>,
    /// `[batch, 3]`.
    pub translation: Tensor<2>,
    /// In [0, 1), from the number of the pair: which points carry tokens. 0.5 in validation.
    pub phase: f32,
}

impl Shard {
    /// Sources and then targets, `[2 batch, points, 3]`.
    pub fn clouds(&self) -> Tensor<3> {
        Tensor::cat(vec![self.batch.source.clone(), self.batch.target.clone()], 0)
    }
}

/// What a network found on the pairs of a shard, for validation.
pub struct Found {
    /// A list of poses for each of [`Trained::ROWS`].
    pub poses: Vec<Vec<Option<Rigid>>>,
    /// Means over the pairs of other quantities, by name.
    pub notes: Vec<(&'static str, f64)>,
}

/// A network that the loop trains: its sizes, its losses, its poses.
pub trait Trained: NetworkConfig {
    /// Weights of the losses, the `[losses]` of a configuration.
    type LossConfig: Clone + std::fmt::Debug + PartialEq + Serialize + DeserializeOwned + Sync;
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

    /// What is wrong with a stage for this network, as key and reason.
    fn wrong_stage(stage: &StageConfig) -> Option<(&'static str, &'static str)>;

    /// What the network has to know of a shard's clouds before it computes, found ahead of the step by
    /// other threads.
    type Layout: Send;

    /// The layout of a shard: its clouds, sources and then targets.
    fn layout(&self, stage: &StageConfig, clouds: &HostClouds, phase: f32) -> Self::Layout;

    /// What the device can do of a shard ahead of its step, on other threads: what depends on those parts of
    /// `network` alone that none of the `stages` of the run trains. Only called where a device computes beside the host.
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    fn ahead(
        &self,
        _stages: &[StageConfig],
        _network: &Self::Network,
        _shard: &Shard,
        layout: Self::Layout,
    ) -> Result<Self::Layout, CopyError> {
        Ok(layout)
    }

    /// Gradients and losses of one shard, on a graph of its own.
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    fn gradient(
        &self,
        losses: &Self::LossConfig,
        stage: &StageConfig,
        network: &Self::Network,
        shard: Shard,
        layout: Self::Layout,
    ) -> Result<(GradientsParams, Losses), CopyError>;

    /// The poses of a shard, as at inference.
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    fn found(&self, network: &Self::Network, shard: Shard) -> Result<Found, CopyError>;
}

/// The weighted sum of the loss terms, and their values.
#[derive(Default)]
pub struct Terms {
    total: Option<Tensor<1>>,
    values: Vec<(&'static str, Tensor<1>)>,
}

impl Terms {
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
