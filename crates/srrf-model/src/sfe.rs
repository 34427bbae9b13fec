//! SFE, the structural feature extractor: local feature integration (LFI) over `k` neighbours and
//! post-norm transformer layers, fused by concatenation.

use burn::module::Module;
use burn::nn::{LayerNorm, LayerNormConfig, Linear, LinearConfig};
use burn::tensor::activation::relu;
use burn::tensor::{Device, Tensor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::attention::EncoderLayer;
use crate::fast::{Activation, linear};
use crate::ops::{CopyError, HostClouds, RowNumbers, flat_indices, k_nearest, rows_at};

/// Sizes of the structural feature extractor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SfeConfig {
    /// Number of LFI + transformer layers, the paper's N_l. DIT, the design's ancestor, uses 8.
    #[schemars(range(min = 1, max = 64))]
    pub layers: usize,
    /// Neighbours that LFI joins, the point itself included. DIT uses 20.
    #[schemars(range(min = 1, max = 1024))]
    pub neighbours: usize,
    /// Width of the features inside. DIT uses 64.
    #[schemars(range(min = 1, max = 8192))]
    pub width: usize,
    /// Attention heads; must divide `width`. DIT uses 4.
    #[schemars(range(min = 1, max = 64))]
    pub heads: usize,
    /// Width inside the MLP of a transformer layer. DIT uses 64.
    #[schemars(range(min = 1, max = 8192))]
    pub mlp: usize,
}

impl SfeConfig {
    /// Channels of the fused feature: `layers * width`.
    pub fn output_width(&self) -> usize {
        self.layers * self.width
    }

    /// A new extractor.
    pub fn init(&self, device: &Device) -> Sfe {
        let layer = |index| SfeLayer {
            join: LinearConfig::new(self.neighbours * if index == 0 { 3 } else { self.width }, self.width)
                .init(device),
            encoder: EncoderLayer::new(self.width, self.heads, self.mlp, device),
        };
        Sfe {
            layers: (0..self.layers).map(layer).collect(),
            norm: LayerNormConfig::new(self.output_width()).init(device),
            neighbours: self.neighbours,
        }
    }
}

/// One LFI and one transformer layer.
#[derive(Module, Debug)]
struct SfeLayer {
    /// `k * C -> width`, which makes the residual of the transformer layer possible: the paper
    /// adds `MSA(T')` to `T'`, whose widths differ.
    join: Linear,
    encoder: EncoderLayer,
}

/// The structural feature extractor.
#[derive(Module, Debug)]
pub struct Sfe {
    layers: Vec<SfeLayer>,
    norm: LayerNorm,
    neighbours: usize,
}

/// Row numbers of the `k` nearest neighbours of each token, itself included.
#[derive(Debug, Clone)]
pub struct Neighbourhood {
    /// In the whole cloud.
    in_cloud: RowNumbers,
    /// Among the tokens; none where every point is one, and these are those in the cloud.
    in_tokens: Option<RowNumbers>,
}

impl Neighbourhood {
    /// The `k` nearest neighbours of `tokens` in `cloud` and among themselves.
    pub fn new(tokens: &HostClouds, cloud: &HostClouds, k: usize) -> Self {
        Self { in_tokens: Some(nearest_rows(tokens, tokens, k)), in_cloud: nearest_rows(tokens, cloud, k) }
    }

    /// Where every point of `cloud` is a token.
    pub fn within(cloud: &HostClouds, k: usize) -> Self {
        Self { in_cloud: nearest_rows(cloud, cloud, k), in_tokens: None }
    }

    /// See [`RowNumbers::send`].
    pub(crate) fn send(&mut self, device: &Device) {
        self.in_cloud.send(device);
        if let Some(rows) = &mut self.in_tokens {
            rows.send(device);
        }
    }
}

/// Rows of the `k` points of each of `support` that are nearest to each of `clouds`.
fn nearest_rows(clouds: &HostClouds, support: &HostClouds, k: usize) -> RowNumbers {
    let supports: Vec<_> = support.iter().collect();
    RowNumbers::new(flat_indices(clouds, support.per_cloud(), |i, cloud| k_nearest(cloud, supports[i], k)))
}

impl Sfe {
    /// Neighbours that LFI joins.
    pub(crate) fn neighbours(&self) -> usize {
        self.neighbours
    }

    /// Features of `tokens`. The first LFI joins the coordinates of the neighbours in the whole
    /// `cloud`, the later ones the features of the neighbours among the tokens.
    ///
    /// # Shapes
    /// - `tokens`: `[clouds, n, 3]`, `cloud`: `[clouds, points, 3]` (the same tensor where every
    ///   point is a token)
    /// - output: `[clouds, n, layers * width]`
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn forward(&self, tokens: Tensor<3>, cloud: Tensor<3>) -> Result<Tensor<3>, CopyError> {
        let [_, n, _] = tokens.dims();
        let (tokens, host_cloud) = (HostClouds::read(&tokens)?, HostClouds::read(&cloud)?);
        Ok(self.forward_with(cloud, n, &Neighbourhood::new(&tokens, &host_cloud, self.neighbours)))
    }

    /// As [`Sfe::forward`], for `n` tokens a cloud of which it is known who their neighbours are.
    pub fn forward_with(&self, cloud: Tensor<3>, n: usize, neighbours: &Neighbourhood) -> Tensor<3> {
        let [clouds, points, _] = cloud.dims();
        let k = self.neighbours;
        let mut table = cloud.reshape([clouds * points, 3]);
        let mut indices = neighbours.in_cloud.on(&table.device());
        let in_tokens =
            neighbours.in_tokens.as_ref().map_or_else(|| indices.clone(), |rows| rows.on(&table.device()));
        let mut outputs = Vec::with_capacity(self.layers.len());
        for layer in &self.layers {
            let [_, channels] = table.dims();
            // T'_n = Concat(T^1 .. T^k) over the neighbours.
            let joined = rows_at(table, indices).reshape([clouds * n, k * channels]);
            let joined = linear(&layer.join, joined, Activation::None); // [clouds * n, width]
            let [_, width] = joined.dims();
            // That = LN(MSA(T') + T'), T_{n+1} = LN(MLP(That) + That).
            let features = layer.encoder.forward(joined.reshape([clouds, n, width]));
            outputs.push(features.clone());
            table = features.reshape([clouds * n, width]);
            indices = in_tokens.clone();
        }
        // F = LN(ReLU(Concat(F_2 .. F_{N_l + 1}))).
        self.norm.forward(relu(Tensor::cat(outputs, 2)))
    }
}
