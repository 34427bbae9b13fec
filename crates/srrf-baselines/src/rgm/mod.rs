//! RGM, robust point cloud registration by deep graph matching (Fu and others 2021).
//!
//! Graph features of both clouds; twice a transformer that proposes each cloud's edges, a convolution on
//! that graph, an affinity of the nodes, and Sinkhorn; the assignment is learned by cross-entropy. At test
//! the Hungarian method makes it one-to-one, and a weighted SVD gives the pose. Where this differs from
//! the authors' code: group norm for batch norm in the features, Sinkhorn in its scaling form
//! ([`sinkhorn`]), nodes at `tokens` points, and no second matching from the
//! target's side at test, to intersect with the first.

mod assign;
mod layer;
mod truth;

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use srrf_model::ops::even_tokens;
use srrf_model::{
    CopyError, NetworkConfig, TrainingBatch, WrongSize, sinkhorn, transform, weighted_procrustes,
};

use crate::dgcnn::{Dgcnn, halves};
use crate::learned::{LearnedConfig, Pose};
use crate::se3::compose;
use layer::GraphLayer;

/// Sizes of [`Rgm`]. Defaults are those of the authors' code.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RgmConfig {
    /// Points of each cloud that are nodes, chosen evenly; 0 (default) for all. The others still serve as
    /// neighbours of the features.
    #[schemars(range(min = 0, max = 65536))]
    pub tokens: usize,
    /// Neighbours of each point in the features, itself included. Default 20.
    #[schemars(range(min = 1, max = 1024))]
    pub neighbours: usize,
    /// Widths of the layers on the edges. Default 64, 64, 128, 256.
    #[schemars(length(min = 1, max = 64), inner(range(min = 1, max = 8192)))]
    pub widths: Vec<usize>,
    /// Width of the last layer of the features, and of the nodes after each graph layer. Default 512.
    #[schemars(range(min = 1, max = 8192))]
    pub width: usize,
    /// Heads of the transformers. Default 4.
    #[schemars(range(min = 1, max = 64))]
    pub heads: usize,
    /// Width inside their feed-forward layers. Default 1,024.
    #[schemars(range(min = 1, max = 8192))]
    pub feed_forward: usize,
    /// Graph layers. Default 2.
    #[schemars(range(min = 1, max = 64))]
    pub layers: usize,
    /// Iterations of Sinkhorn. Default 20.
    #[schemars(range(min = 1, max = 1000))]
    pub sinkhorn: usize,
    /// Nodes match in training if they are each other's nearest within this distance, in network units,
    /// or, among those without a match, within twice of it. Default 0.05, where every point is a node.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0))]
    pub match_radius: f64,
    /// Iterations at test. Default 2.
    #[schemars(range(min = 1, max = 1000))]
    pub iterations: usize,
}

impl Default for RgmConfig {
    fn default() -> Self {
        Self {
            tokens: 0,
            neighbours: 20,
            widths: vec![64, 64, 128, 256],
            width: 512,
            heads: 4,
            feed_forward: 1024,
            layers: 2,
            sinkhorn: 20,
            match_radius: 0.05,
            iterations: 2,
        }
    }
}

/// Weights of the losses of [`Rgm`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RgmLosses {
    /// Binary cross-entropy of the assignment, sum over its entries, over the number of nodes. The
    /// paper: 1.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub assignment: f64,
}

/// The network.
#[derive(Module, Debug)]
pub struct Rgm {
    features: Dgcnn,
    layers: Vec<GraphLayer>,
}

impl NetworkConfig for RgmConfig {
    type Network = Rgm;
    const KEY: &'static str = "rgm_config";

    fn check(&self) -> Result<(), WrongSize> {
        if self.neighbours == 0 || self.widths.is_empty() || self.widths.contains(&0) || self.width == 0 {
            return Err(WrongSize::new("widths", "needs 1 layer, neighbour and channel or more"));
        }
        let joined = self.joined();
        if self.heads == 0 || !self.width.is_multiple_of(self.heads) || !joined.is_multiple_of(self.heads) {
            let why =
                format!("must divide width, {}, and width with the sum of widths, {joined}", self.width);
            return Err(WrongSize::new("heads", why));
        }
        if self.layers == 0 || self.sinkhorn == 0 || self.iterations == 0 || self.feed_forward == 0 {
            return Err(WrongSize::new("layers", "sinkhorn, iterations and feed_forward must be 1 or more"));
        }
        if self.match_radius.is_nan() || self.match_radius <= 0.0 {
            return Err(WrongSize::new("match_radius", "must be more than 0"));
        }
        if (1..3).contains(&self.tokens) {
            return Err(WrongSize::new("tokens", "must be 0 (all) or 3 or more"));
        }
        Ok(())
    }

    fn init(&self, device: &Device) -> Rgm {
        let layer = |i: usize| {
            let inputs = if i == 0 { self.joined() } else { self.width };
            GraphLayer::new(inputs, self.width, self.heads, self.feed_forward, i + 1 < self.layers, device)
        };
        Rgm {
            features: Dgcnn::new(&self.widths, self.width, self.neighbours, device),
            layers: (0..self.layers).map(layer).collect(),
        }
    }
}

/// What the network makes of a batch.
struct Matched {
    source_points: Tensor<3>,
    target_points: Tensor<3>,
    /// The assignment, `[batch, n, n]`; rows and columns sum to at most about 1.
    assignment: Tensor<3>,
}

impl RgmConfig {
    /// Width of the first nodes: all levels of the features and their projection.
    fn joined(&self) -> usize {
        self.widths.iter().sum::<usize>() + self.width
    }

    fn forward(
        &self,
        network: &Rgm,
        source: Tensor<3>,
        target: Tensor<3>,
        phase: f32,
    ) -> Result<Matched, CopyError> {
        let clouds = Tensor::cat(vec![source, target], 0); // [2 batch, points, 3]
        let tokens = even_tokens(clouds.clone(), self.tokens, phase)?; // [2 batch, n, 3]
        let (edge, node) = network.features.forward(&tokens, &clouds)?;
        let mut nodes = Tensor::cat(vec![node, edge], 2); // [2 batch, n, joined]
        let (source_points, target_points) = halves(tokens);
        let [batch, n, _] = source_points.dims();
        let mut assignment = Tensor::zeros([batch, n, n], &source_points.device());
        for layer in &network.layers {
            nodes = layer.convolve(nodes);
            assignment = sinkhorn(layer.affinity(nodes.clone()), self.sinkhorn).matrix();
            nodes = layer.mix(nodes, &assignment);
        }
        Ok(Matched { source_points, target_points, assignment })
    }
}

impl LearnedConfig for RgmConfig {
    type Losses = RgmLosses;
    const NAME: &'static str = "rgm";
    const TERMS: &'static [&'static str] = &["assignment"];

    fn losses(
        &self,
        losses: &RgmLosses,
        network: &Rgm,
        batch: &TrainingBatch,
    ) -> Result<Vec<(&'static str, Tensor<1>, f64)>, CopyError> {
        let found = self.forward(network, batch.source.clone(), batch.target.clone(), batch.phase)?;
        let posed = transform(found.source_points, batch.rotation.clone(), batch.translation.clone());
        let truth = truth::assignment(&posed, &found.target_points, self.match_radius)?;
        let [batch, n, _] = truth.dims();
        let s = found.assignment.clamp(1e-6, 1.0 - 1e-6);
        let no_match = (s.clone().neg() + 1.0).log() * (truth.clone().neg() + 1.0);
        let loss = -(truth * s.log() + no_match).sum() / (batch * n) as f64;
        Ok(vec![("assignment", loss, losses.assignment)])
    }

    fn pose(&self, network: &Rgm, source: Tensor<3>, target: Tensor<3>) -> Result<Pose, CopyError> {
        let mut pose: Option<(Tensor<3>, Tensor<2>)> = None;
        for _ in 0..self.iterations {
            let moved = match &pose {
                Some((rotation, translation)) => {
                    transform(source.clone(), rotation.clone(), translation.clone())
                }
                None => source.clone(),
            };
            let found = self.forward(network, moved, target.clone(), 0.5)?;
            let (matches, weights) = assign::one_to_one(&found.assignment, &found.target_points)?;
            let step = weighted_procrustes(found.source_points, matches, weights)?;
            pose = Some(match pose {
                Some(before) => compose(step, before),
                None => step,
            });
        }
        let (rotation, translation) = pose.unwrap_or_else(|| {
            let [batch, _, _] = source.dims();
            (crate::se3::identity(batch, 3, &source), Tensor::zeros([batch, 3], &source.device()))
        });
        Ok(Pose { rotation, translation })
    }

    fn passes(&self) -> usize {
        self.iterations
    }
}
