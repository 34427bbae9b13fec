//! The equivariant graph layer (Satorras and others 2021) on the matches of one cloud.

use burn::module::Module;
use burn::nn::{LayerNorm, LayerNormConfig, Linear, LinearConfig};
use burn::tensor::Tensor;
use burn::tensor::{Device, activation};
use srrf_model::fast::{Activation, linear};
use srrf_model::ops::{CopyError, HostClouds, flat_indices, k_nearest, rows};

/// Invariants of an edge: squared distance, distance, dot product.
const INVARIANTS: usize = 3;

/// One layer: messages on edges, features of nodes, a step of the coordinates.
#[derive(Module, Debug)]
pub(super) struct GraphLayer {
    edge_inner: Linear,
    edge_outer: Linear,
    edge_norm: LayerNorm,
    node_inner: Linear,
    node_outer: Linear,
    step_inner: Linear,
    step_outer: Linear,
}

impl GraphLayer {
    /// Features of `width` channels.
    pub fn new(width: usize, device: &Device) -> Self {
        let layer = |inputs: usize, outputs: usize| LinearConfig::new(inputs, outputs).init(device);
        Self {
            edge_inner: layer(2 * width + INVARIANTS, width),
            edge_outer: layer(width, width),
            edge_norm: LayerNormConfig::new(width).init(device),
            node_inner: layer(2 * width, width),
            node_outer: layer(width, width),
            step_inner: layer(width, width),
            step_outer: layer(width, 1),
        }
    }

    /// Coordinates and features after the layer.
    ///
    /// # Shapes
    /// - `x`: `[rows, 3]`, `f`: `[rows, width]`, `neighbours`: `rows * k` row numbers
    pub fn forward(
        &self,
        x: Tensor<2>,
        f: Tensor<2>,
        neighbours: &[i64],
        k: usize,
    ) -> (Tensor<2>, Tensor<2>) {
        let [count, width] = f.dims();
        // Each row k times, then its neighbours.
        let own = |t: &Tensor<2>| {
            let [_, channels] = t.dims();
            t.clone().unsqueeze_dim::<3>(1).repeat_dim(1, k).reshape([count * k, channels])
        };
        let (x_i, x_j) = (own(&x), rows(x.clone(), neighbours));
        let away = x_i.clone() - x_j.clone();
        let squared = away.clone().square().sum_dim(1);
        let distance = squared.clone().clamp_min(1e-12).sqrt();
        let dot = (x_i * x_j).sum_dim(1);
        let edges = vec![own(&f), rows(f.clone(), neighbours), squared, distance, dot];
        let message = self.silu(&self.edge_inner, Tensor::cat(edges, 1));
        let message = self.edge_norm.forward(self.silu(&self.edge_outer, message)); // [rows * k, width]

        let step = self.silu(&self.step_inner, message.clone());
        let step = away * linear(&self.step_outer, step, Activation::None);
        let x = x + step.reshape([count, k, 3]).mean_dim(1).squeeze_dim::<2>(1);

        let sum = message.reshape([count, k, width]).sum_dim(1).squeeze_dim::<2>(1);
        let inner = self.silu(&self.node_inner, Tensor::cat(vec![f.clone(), sum], 1));
        (x, f + linear(&self.node_outer, inner, Activation::None))
    }

    fn silu(&self, layer: &Linear, x: Tensor<2>) -> Tensor<2> {
        activation::silu(linear(layer, x, Activation::None))
    }
}

/// Row numbers of the `k` nearest points of each point, itself included: `[clouds, n, 3]` to
/// `clouds * n * k`.
pub(super) fn neighbours(points: &Tensor<3>, k: usize) -> Result<Vec<i64>, CopyError> {
    let [_, n, _] = points.dims();
    let host = HostClouds::read(points)?;
    Ok(flat_indices(&host, n, |_, cloud| k_nearest(cloud, cloud, k)))
}
