//! What the learned baselines share: the seam to training, and the way to [`Register`].

use std::fmt::Debug;

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use srrf_cloud::{Register, RegisterError, Registration, Solid};
use srrf_model::weights::LoadedModel;
use srrf_model::{CopyError, NetworkConfig, PairBatch, TrainingBatch, subsample};

/// Largest number of points that a network sees of a cloud: what it was trained with.
const MAX_POINTS: usize = 1024;

/// Poses: `target ~ R source + t`.
#[derive(Debug, Clone)]
pub struct Pose {
    /// `[batch, 3, 3]`.
    pub rotation: Tensor<3>,
    /// `[batch, 3]`.
    pub translation: Tensor<2>,
}

/// The sizes of a learned baseline, which say how it learns and how it answers.
pub trait LearnedConfig: NetworkConfig + JsonSchema {
    /// Weights of its losses.
    type Losses: Clone + Debug + PartialEq + Serialize + DeserializeOwned + JsonSchema + Send + Sync;
    /// Name of the method, in configurations and tables.
    const NAME: &'static str;
    /// Names of the losses.
    const TERMS: &'static [&'static str];

    /// The losses on some pairs, each of shape `[1]`, with their weights; one of weight 0 is only
    /// reported.
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    fn losses(
        &self,
        losses: &Self::Losses,
        network: &Self::Network,
        batch: &TrainingBatch,
    ) -> Result<Vec<(&'static str, Tensor<1>, f64)>, CopyError>;

    /// The answer, as at inference.
    ///
    /// # Shapes
    /// - `source`, `target`: `[batch, points, 3]`, centred
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    fn pose(&self, network: &Self::Network, source: Tensor<3>, target: Tensor<3>) -> Result<Pose, CopyError>;

    /// How often the pose is refined within one answer.
    fn passes(&self) -> usize {
        1
    }
}

/// A learned baseline as a registration method.
pub struct LearnedRegister<C: LearnedConfig> {
    network: C::Network,
    config: C,
    device: Device,
}

impl<C: LearnedConfig> LearnedRegister<C> {
    /// The network of a weights file; `device` must be the one it was loaded on.
    pub fn new(loaded: LoadedModel<C>, device: Device) -> Self {
        Self { network: loaded.model.valid(), config: loaded.config, device }
    }
}

impl<C: LearnedConfig> Register for LearnedRegister<C> {
    fn name(&self) -> &str {
        C::NAME
    }

    fn register_solid(&self, source: Solid<'_>, target: Solid<'_>) -> Result<Registration, RegisterError> {
        let points = source.len().min(target.len()).min(MAX_POINTS);
        let (source, target) = (subsample(&source, points)?, subsample(&target, points)?);
        let no_pose = |why: &str| RegisterError::NoPose(why.into());
        let batch = PairBatch::new(&[(&source, &target)], &self.device)
            .ok_or_else(|| no_pose("the clouds differ in their number of points"))?;
        let pose = self.config.pose(&self.network, batch.source.clone(), batch.target.clone())?;
        let found = batch.poses(&pose.rotation, &pose.translation)?.pop().flatten();
        let found = found
            .ok_or_else(|| no_pose("the network's output is not finite; are the coordinates extreme?"))?;
        Ok(Registration { iterations: self.config.passes(), ..Registration::from_pose(found) })
    }
}
