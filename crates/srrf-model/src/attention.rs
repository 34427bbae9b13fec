//! Multi-head attention and the post-norm transformer layers of SFE and PFI.

use burn::module::Module;
use burn::nn::{LayerNorm, LayerNormConfig, Linear, LinearConfig};
use burn::tensor::{Device, Tensor};

use crate::fast::{Activation, add_norm, attention, linear};

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
        let dims = queries.dims();
        self.rows(rows(queries), rows(memory), dims[0]).reshape(dims)
    }

    /// The same on the rows of all clouds together: `[clouds * n, width]`.
    fn rows(&self, queries: Tensor<2>, memory: Tensor<2>, clouds: usize) -> Tensor<2> {
        let q = linear(&self.query, queries, Activation::None);
        let kv = linear(&self.key_value, memory, Activation::None);
        linear(&self.output, attention(q, kv, clouds, self.heads), Activation::None)
    }
}

/// The points of all clouds as rows: `[clouds, n, width]` to `[clouds * n, width]`.
fn rows(x: Tensor<3>) -> Tensor<2> {
    let [clouds, n, width] = x.dims();
    x.reshape([clouds * n, width])
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
    /// - `x` and output: `[rows, width]`
    pub fn forward(&self, x: Tensor<2>) -> Tensor<2> {
        linear(&self.outer, linear(&self.inner, x, Activation::Relu), Activation::None)
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
        let dims = x.dims();
        let x = rows(x);
        let x = add_norm(&self.attention_norm, self.attention.rows(x.clone(), x.clone(), dims[0]), x);
        add_norm(&self.mlp_norm, self.mlp.forward(x.clone()), x).reshape(dims)
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
        let dims = x.dims();
        let (x, memory) = (rows(x), rows(memory));
        let x = add_norm(&self.self_norm, self.self_attention.rows(x.clone(), x.clone(), dims[0]), x);
        let x = add_norm(&self.cross_norm, self.cross_attention.rows(x.clone(), memory, dims[0]), x);
        add_norm(&self.mlp_norm, self.mlp.forward(x.clone()), x).reshape(dims)
    }
}
