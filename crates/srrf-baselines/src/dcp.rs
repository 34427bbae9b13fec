//! Deep closest point (Wang and Solomon 2019).
//!
//! Graph features of both clouds, a transformer between them (v2) or none (v1), soft matching, SVD. Where
//! this differs from the authors' code: group norm for batch norm, clouds centred and scaled as for every
//! method here, and, where `tokens` says so, features at some of the points only.

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use srrf_model::ops::even_tokens;
use srrf_model::{
    CopyError, NetworkConfig, TrainingBatch, WrongSize, procrustes, registration_loss, soft_matches,
};

use crate::dgcnn::{Dgcnn, halves};
use crate::learned::{LearnedConfig, Pose};
use crate::pre_norm::Transformer;

/// Which DCP.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DcpVersion {
    /// Without interaction of the clouds.
    V1,
    /// With the transformer.
    V2,
}

/// Sizes of [`Dcp`]. Defaults are those of the authors' code.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DcpConfig {
    /// v1 or v2. Default `v2`.
    pub version: DcpVersion,
    /// Points of each cloud that carry features, chosen evenly; 0 (default) for all. The others still
    /// serve as neighbours.
    #[schemars(range(min = 0, max = 65536))]
    pub tokens: usize,
    /// Neighbours of each point, itself included. Default 20.
    #[schemars(range(min = 1, max = 1024))]
    pub neighbours: usize,
    /// Widths of the layers on the edges. Default 64, 64, 128, 256.
    #[schemars(length(min = 1, max = 64), inner(range(min = 1, max = 8192)))]
    pub widths: Vec<usize>,
    /// Width of the embedding. Default 512.
    #[schemars(range(min = 1, max = 8192))]
    pub width: usize,
    /// Heads of the transformer. Default 4.
    #[schemars(range(min = 1, max = 64))]
    pub heads: usize,
    /// Width inside its feed-forward layers. Default 1,024.
    #[schemars(range(min = 1, max = 8192))]
    pub feed_forward: usize,
}

impl Default for DcpConfig {
    fn default() -> Self {
        Self {
            version: DcpVersion::V2,
            tokens: 0,
            neighbours: 20,
            widths: vec![64, 64, 128, 256],
            width: 512,
            heads: 4,
            feed_forward: 1024,
        }
    }
}

/// Weights of the losses of [`Dcp`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DcpLosses {
    /// `|R^T R_gt - I|^2 + |t - t_gt|^2`, means over 9 and 3 elements. The paper: 1.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub registration: f64,
}

/// The network.
#[derive(Module, Debug)]
pub struct Dcp {
    embedding: Dgcnn,
    transformer: Option<Transformer>,
}

impl NetworkConfig for DcpConfig {
    type Network = Dcp;
    const KEY: &'static str = "dcp_config";

    fn check(&self) -> Result<(), WrongSize> {
        if self.neighbours == 0 || self.widths.is_empty() || self.widths.contains(&0) || self.width == 0 {
            return Err(WrongSize::new("widths", "needs 1 layer, neighbour and channel or more"));
        }
        if self.heads == 0 || !self.width.is_multiple_of(self.heads) || self.feed_forward == 0 {
            return Err(WrongSize::new("heads", format!("must divide the width, {}", self.width)));
        }
        if (1..3).contains(&self.tokens) {
            return Err(WrongSize::new("tokens", "must be 0 (all) or 3 or more"));
        }
        Ok(())
    }

    fn init(&self, device: &Device) -> Dcp {
        let transformer = || Transformer::new(self.width, self.heads, self.feed_forward, device);
        Dcp {
            embedding: Dgcnn::new(&self.widths, self.width, self.neighbours, device),
            transformer: (self.version == DcpVersion::V2).then(transformer),
        }
    }
}

impl DcpConfig {
    fn forward(
        &self,
        network: &Dcp,
        source: Tensor<3>,
        target: Tensor<3>,
        phase: f32,
    ) -> Result<Pose, CopyError> {
        let clouds = Tensor::cat(vec![source, target], 0); // [2 batch, points, 3]
        let tokens = even_tokens(clouds.clone(), self.tokens, phase)?; // [2 batch, n, 3]
        let (features, _) = network.embedding.forward(&tokens, &clouds)?; // [2 batch, n, width]
        // v2: F + phi(F, other). v1 adds F itself, which doubles it.
        let change =
            network.transformer.as_ref().map_or_else(|| features.clone(), |t| t.forward(features.clone()));
        let [_, _, width] = features.dims();
        let (source_features, target_features) = halves(features + change);
        let (source_points, target_points) = halves(tokens);
        let scores = source_features.matmul(target_features.transpose()) / (width as f64).sqrt();
        let matches = soft_matches(scores, target_points);
        let (rotation, translation) = procrustes(source_points, matches.points)?;
        Ok(Pose { rotation, translation })
    }
}

impl LearnedConfig for DcpConfig {
    type Losses = DcpLosses;
    const NAME: &'static str = "dcp";
    const TERMS: &'static [&'static str] = &["registration"];

    fn losses(
        &self,
        losses: &DcpLosses,
        network: &Dcp,
        batch: &TrainingBatch,
    ) -> Result<Vec<(&'static str, Tensor<1>, f64)>, CopyError> {
        let found = self.forward(network, batch.source.clone(), batch.target.clone(), batch.phase)?;
        let (rotation, translation) = (batch.rotation.clone(), batch.translation.clone());
        let loss = registration_loss(found.rotation, found.translation, rotation, translation);
        Ok(vec![("registration", loss, losses.registration)])
    }

    fn pose(&self, network: &Dcp, source: Tensor<3>, target: Tensor<3>) -> Result<Pose, CopyError> {
        self.forward(network, source, target, 0.5)
    }
}
