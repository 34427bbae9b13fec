//! PFI, the point feature interaction: position encoding, encoder-decoder cross-attention between
//! the two clouds, residual, squeeze-and-excitation.

use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::activation::{relu, sigmoid};
use burn::tensor::{Device, Tensor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::attention::{DecoderLayer, EncoderLayer};
use crate::fast::{Activation, linear};

/// Sizes of the feature interaction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PfiConfig {
    /// Encoder and decoder blocks. DIT uses 12 at a learning rate of 3e-5, DCP 1 at 1e-3; the
    /// paper's rate is DCP's.
    #[schemars(range(max = 64))]
    pub blocks: usize,
    /// Attention heads; must divide the feature width. DCP uses 4.
    #[schemars(range(min = 1, max = 64))]
    pub heads: usize,
    /// Width inside the feed-forward layers. DCP: twice the feature width.
    #[schemars(range(min = 1, max = 8192))]
    pub feed_forward: usize,
    /// Width inside the position encoding. DIT uses 4,096.
    #[schemars(range(min = 1, max = 8192))]
    pub position_hidden: usize,
    /// The squeeze divides the channels by this. SENet and DIT use 16.
    #[schemars(range(min = 1, max = 8192))]
    pub squeeze: usize,
}

impl PfiConfig {
    /// A new interaction for features of `width` channels.
    pub fn init(&self, width: usize, device: &Device) -> Pfi {
        let squeezed = (width / self.squeeze).max(1);
        Pfi {
            position_inner: LinearConfig::new(3, self.position_hidden).init(device),
            position_outer: LinearConfig::new(self.position_hidden, width).init(device),
            encoder: (0..self.blocks)
                .map(|_| EncoderLayer::new(width, self.heads, self.feed_forward, device))
                .collect(),
            decoder: (0..self.blocks)
                .map(|_| DecoderLayer::new(width, self.heads, self.feed_forward, device))
                .collect(),
            squeeze: LinearConfig::new(width, squeezed).init(device),
            excite: LinearConfig::new(squeezed, width).init(device),
        }
    }
}

/// The feature interaction.
#[derive(Module, Debug)]
pub struct Pfi {
    position_inner: Linear,
    position_outer: Linear,
    encoder: Vec<EncoderLayer>,
    decoder: Vec<DecoderLayer>,
    squeeze: Linear,
    excite: Linear,
}

impl Pfi {
    /// `Phi_X = SE(F_X + phi(F_Y + P_Y, F_X + P_X))`, and the same for Y.
    ///
    /// Both directions run as one batch: clouds `0 .. clouds / 2` are the sources, the others
    /// their targets.
    ///
    /// # Shapes
    /// - `features`: `[clouds, n, width]`, `points`: `[clouds, n, 3]`, sources then targets
    /// - output: `[clouds, n, width]`
    pub fn forward(&self, features: Tensor<3>, points: Tensor<3>) -> Tensor<3> {
        let [clouds, n, width] = features.dims();
        // P = ReLU(FC(Sigmoid(FC(X)))).
        let position = linear(&self.position_inner, points.reshape([clouds * n, 3]), Activation::Sigmoid);
        let position = linear(&self.position_outer, position, Activation::Relu);
        let embedded = features.clone() + position.reshape([clouds, n, width]);

        let memory = self.encoder.iter().fold(embedded.clone(), |x, block| block.forward(x));
        // Each cloud attends to the other one of its pair.
        let memory = Tensor::cat(
            vec![memory.clone().narrow(0, clouds / 2, clouds / 2), memory.narrow(0, 0, clouds / 2)],
            0,
        );
        let phi = self.decoder.iter().fold(embedded, |x, block| block.forward(x, memory.clone()));
        self.recalibrate(features + phi)
    }

    /// Squeeze-and-excitation: `SE(x) = x * Sigmoid(FC(ReLU(FC(mean over points))))`.
    fn recalibrate(&self, x: Tensor<3>) -> Tensor<3> {
        let squeezed = relu(self.squeeze.forward(x.clone().mean_dim(1))); // [clouds, 1, width / r]
        x * sigmoid(self.excite.forward(squeezed))
    }
}
