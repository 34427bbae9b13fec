//! SEM, the skeleton extraction module: set-abstraction encoder, weight head, convex combination
//! (Eq. 5) and radii (Eq. 6).

use burn::module::Module;
use burn::nn::{LayerNorm, LayerNormConfig, Linear, LinearConfig};
use burn::tensor::activation::{relu, softmax};
use burn::tensor::{Device, Tensor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fast::{Activation, gather_max, gather_relu, linear};
use crate::ops::{CopyError, HostClouds, farthest_points, flat_indices, k_nearest, nearest_distance, rows};

/// Sizes of one set-abstraction level.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LevelConfig {
    /// Points kept by farthest point sampling.
    #[schemars(range(min = 1, max = 65536))]
    pub points: usize,
    /// Nearest neighbours that are grouped. Point2Skeleton groups 16 to 128 within radii.
    #[schemars(range(min = 1, max = 1024))]
    pub neighbours: usize,
    /// Widths of the shared MLP.
    #[schemars(length(min = 1, max = 64), inner(range(min = 1, max = 8192)))]
    pub widths: Vec<usize>,
}

/// Sizes of the skeleton extraction module.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SemConfig {
    /// The set-abstraction levels of the encoder. Point2Skeleton: 1024, 768, 512, 512 points.
    #[schemars(length(min = 1, max = 16))]
    pub levels: Vec<LevelConfig>,
    /// Width of the cloud's global feature, which joins each point's feature before the head.
    #[schemars(range(min = 1, max = 8192))]
    pub global: usize,
    /// Widths of the weight head. Point2Skeleton: 384, 256, 256, 128.
    #[schemars(length(max = 64), inner(range(min = 1, max = 8192)))]
    pub head: Vec<usize>,
    /// Skeleton points, the paper's N_X. Point2Skeleton: 100.
    #[schemars(range(min = 3, max = 8192))]
    pub skeleton_points: usize,
    /// Factor on the logits before the softmax. At 1 every skeleton point sits near the centroid
    /// for hundreds of steps (Point2Skeleton has a BatchNorm there instead).
    #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0))]
    pub logit_scale: f64,
}

impl SemConfig {
    /// A new module.
    pub fn init(&self, device: &Device) -> Sem {
        let mut channels = 0;
        let mut levels = Vec::new();
        for level in &self.levels {
            levels.push(Level {
                mlp: mlp(3 + channels, &level.widths, device),
                points: level.points,
                neighbours: level.neighbours,
            });
            channels = level.widths.last().copied().unwrap_or(channels);
        }
        let mut head = Vec::new();
        let mut width = 3 + channels + self.global;
        for &next in &self.head {
            head.push(HeadLayer {
                linear: LinearConfig::new(width, next).init(device),
                norm: LayerNormConfig::new(next).init(device),
            });
            width = next;
        }
        Sem {
            levels,
            global: LinearConfig::new(channels, self.global).init(device),
            head,
            weights: LinearConfig::new(width, self.skeleton_points).init(device),
            logit_scale: self.logit_scale,
        }
    }

    /// The layout of `clouds`.
    pub fn layout(&self, clouds: &HostClouds) -> SemLayout {
        SemLayout::new(
            clouds,
            self.levels.iter().map(|LevelConfig { points, neighbours, .. }| (*points, *neighbours)),
        )
    }
}

/// A stack of linear layers `channels -> widths[0] -> ..`.
fn mlp(channels: usize, widths: &[usize], device: &Device) -> Vec<Linear> {
    let inputs = std::iter::once(channels).chain(widths.iter().copied());
    inputs.zip(widths).map(|(input, &output)| LinearConfig::new(input, output).init(device)).collect()
}

/// One set-abstraction level.
#[derive(Module, Debug)]
struct Level {
    mlp: Vec<Linear>,
    points: usize,
    neighbours: usize,
}

/// Linear, LayerNorm, ReLU.
#[derive(Module, Debug)]
struct HeadLayer {
    linear: Linear,
    norm: LayerNorm,
}

/// The skeleton extraction module; one set of weights for both clouds.
#[derive(Module, Debug)]
pub struct Sem {
    levels: Vec<Level>,
    global: Linear,
    head: Vec<HeadLayer>,
    weights: Linear,
    logit_scale: f64,
}

/// The layout of the skeleton extraction module, a level after the other.
#[derive(Debug, Clone)]
pub struct SemLayout(Vec<LevelLayout>);

/// One set-abstraction level.
#[derive(Debug, Clone)]
struct LevelLayout {
    /// Rows of the points kept by farthest point sampling; none where every point is.
    chosen: Option<Vec<i64>>,
    /// Points kept a cloud.
    samples: usize,
    /// Rows of the neighbours of each of them.
    neighbours: Vec<i64>,
}

impl SemLayout {
    /// Levels of so many points and neighbours each.
    pub fn new(clouds: &HostClouds, levels: impl IntoIterator<Item = (usize, usize)>) -> Self {
        let mut host = clouds.clone();
        let level = |(points, k): (usize, usize)| {
            let n = host.per_cloud();
            // Farthest point sampling, unless every point is kept.
            let samples = points.min(n);
            let chosen =
                (samples < n).then(|| flat_indices(&host, n, |_, cloud| farthest_points(cloud, samples)));
            let centres = chosen.as_ref().map_or_else(|| host.clone(), |rows| host.select(rows, samples));
            let supports: Vec<_> = host.iter().collect();
            let neighbours = flat_indices(&centres, n, |i, centres| k_nearest(centres, supports[i], k));
            host = centres;
            LevelLayout { chosen, samples, neighbours }
        };
        Self(levels.into_iter().map(level).collect())
    }
}

/// The skeleton of each cloud.
#[derive(Debug, Clone)]
pub struct SkeletonBatch {
    /// Skeleton points `S`: `[clouds, skeleton_points, 3]`.
    pub points: Tensor<3>,
    /// Radii of their spheres, `R = W^T D`: `[clouds, skeleton_points]`.
    pub radii: Tensor<2>,
    /// Convex weights `W`, each column sums to 1: `[clouds, samples, skeleton_points]`.
    pub weights: Tensor<3>,
    /// The sampled points `X*`: `[clouds, samples, 3]`.
    pub samples: Tensor<3>,
}

impl Sem {
    /// Extracts the skeletons of centred clouds.
    ///
    /// # Shapes
    /// - `clouds`: `[clouds, points, 3]`
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn forward(&self, clouds: Tensor<3>) -> Result<SkeletonBatch, CopyError> {
        let layout = self.layout(&HostClouds::read(&clouds)?);
        self.forward_with(clouds, &layout)
    }

    /// The layout of `clouds`.
    pub fn layout(&self, clouds: &HostClouds) -> SemLayout {
        SemLayout::new(clouds, self.levels.iter().map(|level| (level.points, level.neighbours)))
    }

    /// As [`Sem::forward`], of clouds whose layout is known.
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn forward_with(&self, clouds: Tensor<3>, layout: &SemLayout) -> Result<SkeletonBatch, CopyError> {
        let (samples, features) = self.encode(clouds, layout);
        let [batch, n, channels] = features.dims();

        // The head sees each point's feature, the cloud's, and where the point is.
        let flat = features.clone().reshape([batch * n, channels]);
        let global = linear(&self.global, flat, Activation::Relu); // [batch * n, global]
        let [_, global_width] = global.dims();
        let all: Vec<i64> = (0..(batch * n) as i64).collect();
        let global = gather_max(global, &all, n).reshape([batch, 1, global_width]);
        let mut x = Tensor::cat(vec![samples.clone(), features, global.expand([batch, n, global_width])], 2)
            .reshape([batch * n, 3 + channels + global_width]);
        for layer in &self.head {
            x = relu(layer.norm.forward(linear(&layer.linear, x, Activation::None)));
        }
        let logits = linear(&self.weights, x, Activation::None) * self.logit_scale; // [batch * n, skeleton_points]
        let [_, skeleton_points] = logits.dims();
        let weights = softmax(logits.reshape([batch, n, skeleton_points]), 1); // sum_i W(i, j) = 1

        let points = weights.clone().transpose().matmul(samples.clone()); // S = W^T X*, Eq. (5)
        let distances = nearest_distance(samples.clone(), points.clone())?; // D, Eq. (6)
        let radii = weights.clone().transpose().matmul(distances.unsqueeze_dim::<3>(2)); // R = W^T D
        Ok(SkeletonBatch { points, radii: radii.squeeze_dim::<2>(2), weights, samples })
    }

    /// The sampled points `X*` and their contextual features.
    fn encode(&self, clouds: Tensor<3>, layout: &SemLayout) -> (Tensor<3>, Tensor<3>) {
        let [batch, mut n, _] = clouds.dims();
        let mut xyz = clouds.reshape([batch * n, 3]);
        let mut features: Option<Tensor<2>> = None;
        for (level, layout) in self.levels.iter().zip(&layout.0) {
            let centres = match &layout.chosen {
                Some(chosen) => rows(xyz.clone(), chosen),
                None => xyz.clone(),
            };
            let grouped = level.group(xyz, features, centres.clone(), &layout.neighbours);
            (xyz, features, n) = (centres, Some(grouped), layout.samples);
        }
        let features = features.unwrap_or_else(|| xyz.clone());
        let [_, channels] = features.dims();
        (xyz.reshape([batch, n, 3]), features.reshape([batch, n, channels]))
    }
}

impl Level {
    /// Shared MLP on `[x_j - x_i; f_j]` over the neighbours `j` of each centre `i`, then the
    /// maximum over them.
    ///
    /// The first linear layer is folded through the gather: it runs once on each support point,
    /// and the centre's share is subtracted after the rows are gathered.
    ///
    /// # Shapes
    /// - `xyz`: `[rows, 3]`, `features`: `[rows, channels]`, `centres`: `[samples, 3]`,
    ///   `neighbours`: `samples * k` row numbers
    /// - output: `[samples, width]`
    fn group(
        &self,
        xyz: Tensor<2>,
        features: Option<Tensor<2>>,
        centres: Tensor<2>,
        neighbours: &[i64],
    ) -> Tensor<2> {
        let [samples, _] = centres.dims();
        let input = match features {
            Some(features) => Tensor::cat(vec![xyz, features], 1),
            None => xyz,
        };
        let Some((first, others)) = self.mlp.split_first() else { return centres };
        let xyz_weight = first.weight.val().narrow(0, 0, 3); // the rows that act on x_j - x_i
        let table = linear(first, input, Activation::None);
        let shift = centres.matmul(xyz_weight); // [samples, width]
        if others.is_empty() {
            // max relu(t_j - s) = relu(max t_j - s): no need for a row for each neighbour.
            return relu(gather_max(table, neighbours, self.neighbours) - shift);
        }
        let mut x = gather_relu(table, shift, neighbours); // [samples * k, width]
        for layer in others {
            x = linear(layer, x, Activation::Relu);
        }
        let all: Vec<i64> = (0..(samples * self.neighbours) as i64).collect();
        gather_max(x, &all, self.neighbours)
    }
}

impl SkeletonBatch {
    /// The skeletons of the sources and those of the targets, of a batch that holds both in turn.
    pub fn halves(self) -> (Self, Self) {
        let batch = self.points.dims()[0] / 2;
        let half = |first: usize| Self {
            points: self.points.clone().narrow(0, first, batch),
            radii: self.radii.clone().narrow(0, first, batch),
            weights: self.weights.clone().narrow(0, first, batch),
            samples: self.samples.clone().narrow(0, first, batch),
        };
        (half(0), half(batch))
    }

    /// The skeleton points, cut off from the gradient of the module that made them.
    pub fn detached_points(&self) -> Tensor<3> {
        self.points.clone().detach()
    }
}
