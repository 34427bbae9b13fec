//! PANet (Wu and others 2023): features at several scales of neighbourhood, weighed against each other
//! at each point by attention; a global feature of each cloud; a pose by regression, iterated.
//!
//! "-style" in what the authors did not publish and where their code had to give: the training (pairs,
//! optimiser, loss) is ours after PCRNet and DCP; group norm for batch norm, and none on the one number
//! that scores a scale; no dropout, for runs that repeat to the last byte; features at `tokens` points,
//! neighbours from the whole cloud. The scales share weights and edges, so the small one is a part of the
//! large one's work here.

use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::activation::softmax;
use burn::tensor::{Device, Tensor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use srrf_model::fast::{Activation, linear};
use srrf_model::ops::{HostClouds, even_tokens, flat_indices, k_nearest, rows};
use srrf_model::{CopyError, NetworkConfig, TrainingBatch, WrongSize, transform};

use crate::dgcnn::{Block, max_over};
use crate::learned::{LearnedConfig, Pose};
use crate::se3::{compose, rotation_of};

/// Sizes of [`Panet`]. Defaults are those of the authors' code.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PanetConfig {
    /// Points of each cloud that carry features, chosen evenly; 0 (default) for all. The others still
    /// serve as neighbours.
    #[schemars(range(min = 0, max = 65536))]
    pub tokens: usize,
    /// Neighbours of the scales, the largest first. Default 16, 8.
    #[schemars(length(min = 1, max = 16), inner(range(min = 1, max = 1024)))]
    pub scales: Vec<usize>,
    /// Widths of the layers on the edges. Default 64, 64, 128, 256.
    #[schemars(length(min = 1, max = 64), inner(range(min = 1, max = 8192)))]
    pub widths: Vec<usize>,
    /// Width of the global feature. Default 512.
    #[schemars(range(min = 1, max = 8192))]
    pub width: usize,
    /// Widths of the regression. Default 1,024, 512, 512, 256.
    #[schemars(length(max = 64), inner(range(min = 1, max = 8192)))]
    pub head: Vec<usize>,
    /// Iterations. Default 4.
    #[schemars(range(min = 1, max = 1000))]
    pub iterations: usize,
}

impl Default for PanetConfig {
    fn default() -> Self {
        Self {
            tokens: 0,
            scales: vec![16, 8],
            widths: vec![64, 64, 128, 256],
            width: 512,
            head: vec![1024, 512, 512, 256],
            iterations: 4,
        }
    }
}

/// Weights of the losses of [`Panet`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PanetLosses {
    /// Mean absolute difference of the coordinates of the source under the found and the true pose.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub points: f64,
}

/// The network.
#[derive(Module, Debug)]
pub struct Panet {
    layers: Vec<Block>,
    attention: Vec<ScaleAttention>,
    joint: Block,
    head: Vec<Linear>,
    pose: Linear,
}

/// Which scale counts how much at each point.
#[derive(Module, Debug)]
struct ScaleAttention {
    squeeze: Block,
    scores: Linear,
}

impl ScaleAttention {
    fn new(width: usize, scales: usize, device: &Device) -> Self {
        let squeezed = (width / 4).max(1);
        Self {
            squeeze: Block::new(width, squeezed, device),
            scores: LinearConfig::new(squeezed, scales).init(device),
        }
    }

    /// The weighted sum of the features of the scales: `[clouds * n, scales, width]` to
    /// `[clouds * n, width]`.
    fn forward(&self, features: Tensor<3>, clouds: usize) -> Tensor<2> {
        let sum = features.clone().sum_dim(1).squeeze_dim::<2>(1);
        let scores = linear(&self.scores, self.squeeze.forward(sum, clouds), Activation::None);
        let weights = softmax(scores, 1).unsqueeze_dim::<3>(2); // [clouds * n, scales, 1]
        (features * weights).sum_dim(1).squeeze_dim::<2>(1)
    }
}

impl NetworkConfig for PanetConfig {
    type Network = Panet;
    const KEY: &'static str = "panet_config";

    fn check(&self) -> Result<(), WrongSize> {
        let falls = self.scales.windows(2).all(|pair| pair[0] > pair[1]);
        if self.scales.is_empty() || self.scales.contains(&0) || !falls {
            return Err(WrongSize::new("scales", "needs 1 number of neighbours or more, the largest first"));
        }
        if self.widths.is_empty() || self.widths.contains(&0) || self.width == 0 || self.head.contains(&0) {
            return Err(WrongSize::new("widths", "width and head must be 1 wide or more"));
        }
        if self.iterations == 0 {
            return Err(WrongSize::new("iterations", "must be 1 or more"));
        }
        if (1..3).contains(&self.tokens) {
            return Err(WrongSize::new("tokens", "must be 0 (all) or 3 or more"));
        }
        Ok(())
    }

    fn init(&self, device: &Device) -> Panet {
        let inputs = |first: usize, widths: &[usize]| -> Vec<(usize, usize)> {
            std::iter::once(first).chain(widths.iter().copied()).zip(widths.iter().copied()).collect()
        };
        let head = inputs(2 * self.width, &self.head);
        let last = self.head.last().copied().unwrap_or(2 * self.width);
        Panet {
            layers: inputs(3, &self.widths).iter().map(|&(i, o)| Block::new(i, o, device)).collect(),
            attention: self
                .widths
                .iter()
                .map(|&width| ScaleAttention::new(width, self.scales.len(), device))
                .collect(),
            joint: Block::new(self.widths.iter().sum(), self.width, device),
            head: head.iter().map(|&(i, o)| LinearConfig::new(i, o).init(device)).collect(),
            pose: LinearConfig::new(last, 7).init(device),
        }
    }
}

impl PanetConfig {
    /// The neighbours of the tokens of each cloud at the largest scale: `[clouds, n * k, 3]`.
    fn neighbourhoods(&self, clouds: Tensor<3>, phase: f32) -> Result<Tensor<3>, CopyError> {
        let tokens = even_tokens(clouds.clone(), self.tokens, phase)?;
        let ([count, points, _], [_, n, _]) = (clouds.dims(), tokens.dims());
        let (host_tokens, host) = (HostClouds::read(&tokens)?, HostClouds::read(&clouds)?);
        let supports: Vec<_> = host.iter().collect();
        let k = self.scales[0];
        let found = flat_indices(&host_tokens, points, |i, tokens| k_nearest(tokens, supports[i], k));
        Ok(rows(clouds.reshape([count * points, 3]), &found).reshape([count, n * k, 3]))
    }

    /// The global feature of each cloud: `[clouds, n * k, 3]` to `[clouds, width]`.
    fn encode(&self, network: &Panet, neighbours: Tensor<3>) -> Tensor<2> {
        let [clouds, edges, _] = neighbours.dims();
        let (k, n) = (self.scales[0], edges / self.scales[0]);
        let mut x = neighbours.reshape([clouds * edges, 3]);
        let mut levels = Vec::with_capacity(network.layers.len());
        for (layer, attention) in network.layers.iter().zip(&network.attention) {
            x = layer.forward(x, clouds);
            let [_, width] = x.dims();
            // The nearest neighbours come first, so a smaller scale is the first rows of the larger.
            let of_scale = |&scale: &usize| {
                let nearest = x.clone().reshape([clouds * n, k, width]).narrow(1, 0, scale);
                max_over(nearest.reshape([clouds * n * scale, width]), scale)
            };
            let scales = Tensor::stack(self.scales.iter().map(of_scale).collect(), 1);
            levels.push(attention.forward(scales, clouds));
        }
        max_over(network.joint.forward(Tensor::cat(levels, 1), clouds), n)
    }

    fn forward(
        &self,
        network: &Panet,
        source: Tensor<3>,
        target: Tensor<3>,
        phase: f32,
    ) -> Result<Pose, CopyError> {
        let target = self.encode(network, self.neighbourhoods(target, phase)?);
        let source = self.neighbourhoods(source, phase)?;
        let mut found: Option<(Tensor<3>, Tensor<2>)> = None;
        for _ in 0..self.iterations {
            // A motion leaves the neighbours what they are.
            let moved = match &found {
                Some((rotation, translation)) => {
                    transform(source.clone(), rotation.clone(), translation.clone())
                }
                None => source.clone(),
            };
            let x = Tensor::cat(vec![self.encode(network, moved), target.clone()], 1); // [batch, 2 width]
            let x = network.head.iter().fold(x, |x, layer| linear(layer, x, Activation::Relu));
            let x = linear(&network.pose, x, Activation::None); // [batch, 7]
            let step = (rotation_of(x.clone().narrow(1, 0, 4)), x.narrow(1, 4, 3));
            found = Some(match found {
                Some(before) => compose(step, before),
                None => step,
            });
        }
        let (rotation, translation) = found.unwrap_or_else(|| {
            let [batch, _, _] = source.dims();
            (crate::se3::identity(batch, 3, &source), Tensor::zeros([batch, 3], &source.device()))
        });
        Ok(Pose { rotation, translation })
    }
}

impl LearnedConfig for PanetConfig {
    type Losses = PanetLosses;
    const NAME: &'static str = "panet";
    const TERMS: &'static [&'static str] = &["points"];

    fn losses(
        &self,
        losses: &PanetLosses,
        network: &Panet,
        batch: &TrainingBatch,
    ) -> Result<Vec<(&'static str, Tensor<1>, f64)>, CopyError> {
        let Pose { rotation, translation } =
            self.forward(network, batch.source.clone(), batch.target.clone(), batch.phase)?;
        let found = transform(batch.source.clone(), rotation, translation);
        let wanted = transform(batch.source.clone(), batch.rotation.clone(), batch.translation.clone());
        Ok(vec![("points", (found - wanted).abs().mean(), losses.points)])
    }

    fn pose(&self, network: &Panet, source: Tensor<3>, target: Tensor<3>) -> Result<Pose, CopyError> {
        self.forward(network, source, target, 0.5)
    }

    fn passes(&self) -> usize {
        self.iterations
    }
}
