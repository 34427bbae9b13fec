//! The graph network of DCP and RGM: one static graph of nearest neighbours, and a stack of layers on
//! its edges.

use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::{Device, Tensor};
use srrf_model::GroupNorm;
use srrf_model::fast::{Activation, gather_max, linear};
use srrf_model::ops::{CopyError, HostClouds, flat_indices, k_nearest, rows};

/// Groups of each norm, as in RPMNet.
pub(crate) const GROUPS: usize = 8;

/// A linear layer, group norm, ReLU. DCP has batch norm, whose statistics would tie shards and steps
/// together, and no bias, which batch norm cancels and group norm does not.
#[derive(Module, Debug)]
pub(crate) struct Block {
    linear: Linear,
    norm: GroupNorm,
}

impl Block {
    /// `inputs -> outputs`.
    pub fn new(inputs: usize, outputs: usize, device: &Device) -> Self {
        Self {
            linear: LinearConfig::new(inputs, outputs).init(device),
            norm: GroupNorm::new(outputs, GROUPS, device),
        }
    }

    /// # Shapes
    /// - `x`: `[clouds * n, inputs]`, output: `[clouds * n, outputs]`
    pub fn forward(&self, x: Tensor<2>, clouds: usize) -> Tensor<2> {
        self.norm.relu(linear(&self.linear, x, Activation::None), clouds)
    }
}

/// Edge features of tokens: their `k` nearest neighbours in the whole cloud, the token itself included,
/// each as `[neighbour; token]` (absolute coordinates, as in DCP's code).
///
/// # Shapes
/// - `tokens`: `[clouds, n, 3]`, `cloud`: `[clouds, points, 3]`
/// - output: `[clouds * n * k, 6]`
pub(crate) fn edges(tokens: &Tensor<3>, cloud: &Tensor<3>, k: usize) -> Result<Tensor<2>, CopyError> {
    let ([clouds, n, _], [_, points, _]) = (tokens.dims(), cloud.dims());
    let (host_tokens, host_cloud) = (HostClouds::read(tokens)?, HostClouds::read(cloud)?);
    let supports: Vec<_> = host_cloud.iter().collect();
    let neighbours = flat_indices(&host_tokens, points, |i, tokens| k_nearest(tokens, supports[i], k));
    let neighbours = rows(cloud.clone().reshape([clouds * points, 3]), &neighbours);
    let centres = tokens.clone().reshape([clouds * n, 1, 3]).repeat_dim(1, k).reshape([clouds * n * k, 3]);
    Ok(Tensor::cat(vec![neighbours, centres], 1))
}

/// The maximum over each `k` rows in turn: `[n * k, channels]` to `[n, channels]`.
pub(crate) fn max_over(x: Tensor<2>, k: usize) -> Tensor<2> {
    let [rows, _] = x.dims();
    gather_max(x, &(0..rows as i64).collect::<Vec<_>>(), k)
}

/// DCP's "DGCNN". Each layer works on the edges that the one before left; what a token keeps of each is
/// the maximum over its edges.
#[derive(Module, Debug)]
pub(crate) struct Dgcnn {
    layers: Vec<Block>,
    joint: Block,
    neighbours: usize,
}

impl Dgcnn {
    /// Layers of `widths` on graphs of `neighbours`, then one of `width` on all of them together.
    pub fn new(widths: &[usize], width: usize, neighbours: usize, device: &Device) -> Self {
        let inputs = std::iter::once(6).chain(widths.iter().copied());
        Self {
            layers: inputs.zip(widths).map(|(i, &o)| Block::new(i, o, device)).collect(),
            joint: Block::new(widths.iter().sum(), width, device),
            neighbours,
        }
    }

    /// Node features, and the levels that they were made of.
    ///
    /// # Shapes
    /// - `tokens`: `[clouds, n, 3]`, `cloud`: `[clouds, points, 3]`
    /// - output: `[clouds, n, width]` and `[clouds, n, sum of widths]`
    pub fn forward(
        &self,
        tokens: &Tensor<3>,
        cloud: &Tensor<3>,
    ) -> Result<(Tensor<3>, Tensor<3>), CopyError> {
        let [clouds, n, _] = tokens.dims();
        let mut x = edges(tokens, cloud, self.neighbours)?;
        let mut levels = Vec::with_capacity(self.layers.len());
        for layer in &self.layers {
            x = layer.forward(x, clouds);
            levels.push(max_over(x.clone(), self.neighbours));
        }
        let levels = Tensor::cat(levels, 1); // [clouds * n, sum of widths]
        let features = self.joint.forward(levels.clone(), clouds);
        let cloudwise = |x: Tensor<2>| {
            let [_, width] = x.dims();
            x.reshape([clouds, n, width])
        };
        Ok((cloudwise(features), cloudwise(levels)))
    }
}

/// Sources, then targets, as one batch, and back.
pub(crate) fn halves(x: Tensor<3>) -> (Tensor<3>, Tensor<3>) {
    let [clouds, _, _] = x.dims();
    (x.clone().narrow(0, 0, clouds / 2), x.narrow(0, clouds / 2, clouds / 2))
}
