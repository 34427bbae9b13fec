//! The transformer of DCP: encoder and decoder layers with the norm in front, as RGM uses it too.

use burn::module::Module;
use burn::nn::{LayerNorm, LayerNormConfig};
use burn::tensor::{Device, Tensor};
use srrf_model::attention::{FeedForward, MultiHeadAttention};

use crate::dgcnn::halves;

/// `phi(own, other)`: an encoder on the other cloud, a decoder on the own one, a block of each, and a
/// norm behind each of the two.
///
/// DCP's LayerNorm divides by the unbiased deviation plus 1e-6; ours is Burn's (biased variance plus
/// 1e-5), which differs by less than a thousandth at these widths.
#[derive(Module, Debug)]
pub(crate) struct Transformer {
    encoder_attention: Attending,
    encoder_mlp: FeedForward,
    encoder_mlp_norm: LayerNorm,
    encoder_norm: LayerNorm,
    decoder_attention: Attending,
    decoder_cross: Attending,
    decoder_mlp: FeedForward,
    decoder_mlp_norm: LayerNorm,
    decoder_norm: LayerNorm,
}

/// Attention with the norm in front.
#[derive(Module, Debug)]
struct Attending {
    norm: LayerNorm,
    attention: MultiHeadAttention,
}

impl Attending {
    fn new(width: usize, heads: usize, device: &Device) -> Self {
        Self {
            norm: LayerNormConfig::new(width).init(device),
            attention: MultiHeadAttention::new(width, heads, device),
        }
    }

    /// To itself, or to a memory.
    fn forward(&self, x: Tensor<3>, memory: Option<Tensor<3>>) -> Tensor<3> {
        let normal = self.norm.forward(x.clone());
        let memory = memory.unwrap_or_else(|| normal.clone());
        x + self.attention.forward(normal, memory)
    }
}

impl Transformer {
    /// `width` must be a multiple of `heads`.
    pub fn new(width: usize, heads: usize, feed_forward: usize, device: &Device) -> Self {
        let norm = || LayerNormConfig::new(width).init(device);
        Self {
            encoder_attention: Attending::new(width, heads, device),
            encoder_mlp: FeedForward::new(width, feed_forward, device),
            encoder_mlp_norm: norm(),
            encoder_norm: norm(),
            decoder_attention: Attending::new(width, heads, device),
            decoder_cross: Attending::new(width, heads, device),
            decoder_mlp: FeedForward::new(width, feed_forward, device),
            decoder_mlp_norm: norm(),
            decoder_norm: norm(),
        }
    }

    /// `phi` of each cloud with the other one of its pair.
    ///
    /// # Shapes
    /// - `features` and output: `[clouds, n, width]`, sources then targets
    pub fn forward(&self, features: Tensor<3>) -> Tensor<3> {
        let x = self.encoder_attention.forward(features.clone(), None);
        let x = mlp(&self.encoder_mlp, &self.encoder_mlp_norm, x);
        let (source, target) = halves(self.encoder_norm.forward(x));
        let memory = Tensor::cat(vec![target, source], 0);
        let x = self.decoder_attention.forward(features, None);
        let x = self.decoder_cross.forward(x, Some(memory));
        self.decoder_norm.forward(mlp(&self.decoder_mlp, &self.decoder_mlp_norm, x))
    }
}

/// `x + MLP(norm(x))`.
fn mlp(mlp: &FeedForward, norm: &LayerNorm, x: Tensor<3>) -> Tensor<3> {
    let [clouds, n, width] = x.dims();
    let normal = norm.forward(x.clone()).reshape([clouds * n, width]);
    x + mlp.forward(normal).reshape([clouds, n, width])
}
