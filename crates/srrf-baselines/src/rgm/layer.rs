//! One graph layer of RGM.

use burn::module::{Module, Param};
use burn::nn::{Linear, LinearConfig};
use burn::tensor::activation::softmax;
use burn::tensor::{Device, Tensor};
use srrf_model::fast::{Activation, linear};
use srrf_model::standardised;

use crate::dgcnn::halves;
use crate::pre_norm::Transformer;
use crate::se3::identity;

/// The transformer that proposes edges, the convolution on them, the affinity of nodes, and the mixing of
/// the two graphs.
#[derive(Module, Debug)]
pub(super) struct GraphLayer {
    transformer: Transformer,
    neighbours: Linear,
    own: Linear,
    affinity: Affinity,
    mixing: Option<Linear>,
}

/// `X sym(A) Y^T` with `A = I + W`, then an instance norm with one scale and shift.
#[derive(Module, Debug)]
struct Affinity {
    weight: Param<Tensor<2>>,
    /// `[1]`.
    gamma: Param<Tensor<1>>,
    /// `[1]`.
    beta: Param<Tensor<1>>,
}

impl GraphLayer {
    /// Nodes of `inputs` channels to nodes of `width`; `mixes` where another layer follows.
    pub fn new(
        inputs: usize,
        width: usize,
        heads: usize,
        feed_forward: usize,
        mixes: bool,
        device: &Device,
    ) -> Self {
        Self {
            transformer: Transformer::new(inputs, heads, feed_forward, device),
            neighbours: LinearConfig::new(inputs, width).init(device),
            own: LinearConfig::new(inputs, width).init(device),
            affinity: Affinity {
                weight: Param::from_tensor(Tensor::zeros([width, width], device)),
                gamma: Param::from_tensor(Tensor::ones([1], device)),
                beta: Param::from_tensor(Tensor::zeros([1], device)),
            },
            mixing: mixes.then(|| LinearConfig::new(2 * width, width).init(device)),
        }
    }

    /// The nodes after the convolution on the soft graph: `A ReLU(W_1 x) + ReLU(W_2 x)`, where
    /// `A = softmax(E E^T / sqrt(d))` of each cloud, its columns brought to sum 1, and
    /// `E = F + phi(F, other)`.
    ///
    /// # Shapes
    /// - `nodes`: `[2 batch, n, inputs]`, sources then targets; output: `[2 batch, n, width]`
    pub fn convolve(&self, nodes: Tensor<3>) -> Tensor<3> {
        let [clouds, n, inputs] = nodes.dims();
        let embedded = nodes.clone() + self.transformer.forward(nodes.clone());
        let scores = embedded.clone().matmul(embedded.transpose()) / (inputs as f64).sqrt();
        let edges = softmax(scores, 2);
        let edges = edges.clone() / edges.sum_dim(1).clamp_min(1e-12);
        let flat = nodes.reshape([clouds * n, inputs]);
        let project = |layer: &Linear| {
            let x = linear(layer, flat.clone(), Activation::Relu);
            let [_, width] = x.dims();
            x.reshape([clouds, n, width])
        };
        edges.matmul(project(&self.neighbours)) + project(&self.own)
    }

    /// The normalised affinity of source and target nodes.
    ///
    /// # Shapes
    /// - `nodes`: `[2 batch, n, width]`; output: `[batch, n, n]`
    pub fn affinity(&self, nodes: Tensor<3>) -> Tensor<3> {
        let Affinity { weight, gamma, beta } = &self.affinity;
        let (source, target) = halves(nodes);
        let weight = weight.val();
        let symmetric = (weight.clone() + weight.transpose()).unsqueeze::<3>() / 2.0;
        let [_, width, _] = symmetric.dims();
        let symmetric = symmetric.clone() + identity(1, width, &symmetric);
        let scores = source.matmul(symmetric).matmul(target.transpose());
        standardised(scores, 1e-5) * gamma.val().unsqueeze::<3>() + beta.val().unsqueeze::<3>()
    }

    /// Joins each node with what the assignment puts opposite to it; leaves the nodes as they are in the
    /// last layer.
    ///
    /// # Shapes
    /// - `nodes` and output: `[2 batch, n, width]`, `assignment`: `[batch, n, n]`
    pub fn mix(&self, nodes: Tensor<3>, assignment: &Tensor<3>) -> Tensor<3> {
        let Some(mixing) = &self.mixing else { return nodes };
        let [clouds, n, width] = nodes.dims();
        let (source, target) = halves(nodes.clone());
        let opposite = vec![assignment.clone().matmul(target), assignment.clone().transpose().matmul(source)];
        let joined = Tensor::cat(vec![nodes, Tensor::cat(opposite, 0)], 2).reshape([clouds * n, 2 * width]);
        linear(mixing, joined, Activation::None).reshape([clouds, n, width])
    }
}
