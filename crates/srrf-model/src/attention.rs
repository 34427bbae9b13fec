//! Multi-head attention and the post-norm transformer layers of SFE and PFI.

use burn::module::Module;
use burn::nn::{LayerNorm, LayerNormConfig, Linear, LinearConfig};
use burn::tensor::activation::{relu, softmax};
use burn::tensor::{Device, Tensor};

/// Multi-head attention: `Concat(A_1 .. A_h) W^O`, each `A_i = softmax(Q K^T / sqrt(d_K)) V`
/// (the paper's MA and Att).
#[derive(Module, Debug)]
pub struct MultiHeadAttention {
    query: Linear,
    key_value: Linear,
    output: Linear,
    heads: usize,
}

impl MultiHeadAttention {
    /// `width` must be a multiple of `heads`.
    pub fn new(width: usize, heads: usize, device: &Device) -> Self {
        Self {
            query: LinearConfig::new(width, width).init(device),
            key_value: LinearConfig::new(width, 2 * width).init(device),
            output: LinearConfig::new(width, width).init(device),
            heads,
        }
    }

    /// # Shapes
    /// - `queries`: `[clouds, n, width]`, `memory`: `[clouds, m, width]`
    /// - output: `[clouds, n, width]`
    pub fn forward(&self, queries: Tensor<3>, memory: Tensor<3>) -> Tensor<3> {
        let [clouds, n, width] = queries.dims();
        let [_, m, _] = memory.dims();
        let per_head = width / self.heads;

        let q = self.query.forward(queries) / (per_head as f64).sqrt();
        let q = q.reshape([clouds, n, self.heads, per_head]).swap_dims(1, 2); // [clouds, heads, n, d]
        let kv =
            self.key_value.forward(memory).reshape([clouds, m, 2 * self.heads, per_head]).swap_dims(1, 2);
        let k = kv.clone().narrow(1, 0, self.heads); // [clouds, heads, m, d]
        let v = kv.narrow(1, self.heads, self.heads);

        let weights = softmax(q.matmul(k.transpose()), 3); // [clouds, heads, n, m]
        let mixed = weights.matmul(v).swap_dims(1, 2).reshape([clouds, n, width]);
        self.output.forward(mixed)
    }
}

/// Two linear layers with a ReLU between them.
#[derive(Module, Debug)]
pub struct FeedForward {
    inner: Linear,
    outer: Linear,
}

impl FeedForward {
    /// `width -> hidden -> width`.
    pub fn new(width: usize, hidden: usize, device: &Device) -> Self {
        Self {
            inner: LinearConfig::new(width, hidden).init(device),
            outer: LinearConfig::new(hidden, width).init(device),
        }
    }

    /// # Shapes
    /// - `x` and output: `[clouds, n, width]`
    pub fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        self.outer.forward(relu(self.inner.forward(x)))
    }
}

/// A post-norm encoder layer: `That = LN(MSA(T') + T')`, `T = LN(MLP(That) + That)`.
#[derive(Module, Debug)]
pub struct EncoderLayer {
    attention: MultiHeadAttention,
    attention_norm: LayerNorm,
    mlp: FeedForward,
    mlp_norm: LayerNorm,
}

impl EncoderLayer {
    /// `width` must be a multiple of `heads`; `hidden` is the width inside the MLP.
    pub fn new(width: usize, heads: usize, hidden: usize, device: &Device) -> Self {
        Self {
            attention: MultiHeadAttention::new(width, heads, device),
            attention_norm: LayerNormConfig::new(width).init(device),
            mlp: FeedForward::new(width, hidden, device),
            mlp_norm: LayerNormConfig::new(width).init(device),
        }
    }

    /// # Shapes
    /// - `x` and output: `[clouds, n, width]`
    pub fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        let x = self.attention_norm.forward(self.attention.forward(x.clone(), x.clone()) + x);
        self.mlp_norm.forward(self.mlp.forward(x.clone()) + x)
    }
}

/// A post-norm decoder layer: self-attention, cross-attention to the other cloud (the paper's
/// MCA), MLP.
#[derive(Module, Debug)]
pub struct DecoderLayer {
    self_attention: MultiHeadAttention,
    self_norm: LayerNorm,
    cross_attention: MultiHeadAttention,
    cross_norm: LayerNorm,
    mlp: FeedForward,
    mlp_norm: LayerNorm,
}

impl DecoderLayer {
    /// `width` must be a multiple of `heads`; `hidden` is the width inside the MLP.
    pub fn new(width: usize, heads: usize, hidden: usize, device: &Device) -> Self {
        Self {
            self_attention: MultiHeadAttention::new(width, heads, device),
            self_norm: LayerNormConfig::new(width).init(device),
            cross_attention: MultiHeadAttention::new(width, heads, device),
            cross_norm: LayerNormConfig::new(width).init(device),
            mlp: FeedForward::new(width, hidden, device),
            mlp_norm: LayerNormConfig::new(width).init(device),
        }
    }

    /// # Shapes
    /// - `x` and output: `[clouds, n, width]`, `memory`: `[clouds, m, width]`
    pub fn forward(&self, x: Tensor<3>, memory: Tensor<3>) -> Tensor<3> {
        let x = self.self_norm.forward(self.self_attention.forward(x.clone(), x.clone()) + x);
        let x = self.cross_norm.forward(self.cross_attention.forward(x.clone(), memory) + x);
        self.mlp_norm.forward(self.mlp.forward(x.clone()) + x)
    }
}
