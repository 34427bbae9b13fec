//! Equi-GSPR (Kang and others 2024), "-style": equivariant graph layers on putative matches, and the
//! pose from those that the graphs of both clouds agree on.
//!
//! The authors made it for indoor and driving scans, never tested it on ModelNet40, and their released
//! script differs from their paper. Where this differs from the script:
//!
//! - Ground truth masks nothing, at any time. The script's training multiplies the weights of the SVD by
//!   the true inlier labels; here the network's own inlier scores stand in their place.
//! - Putative matches are the nearest FPFH descriptors (which the script has as an option), from tokens
//!   of the source to all points of the target: 256 pairs, not 2,048.
//! - The nine numbers of the local frame on each edge are left out: they turn with the cloud, so features
//!   made from them are not invariant. What is left (squared distance, distance, dot product of the
//!   centred coordinates) is, so a rotation of a cloud leaves its features what they are.
//! - The translation's loss is its error, not the angle between translations, for centred clouds have
//!   almost none.
//! - The paper's low-rank module is not in the script and not here.

mod graph;
mod matches;

use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::activation::sigmoid;
use burn::tensor::{Device, Tensor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use srrf_model::fast::{Activation, linear};
use srrf_model::ops::{even_tokens, rows, to_host};
use srrf_model::{CopyError, NetworkConfig, TrainingBatch, WrongSize, transform, weighted_procrustes};

use crate::learned::{LearnedConfig, Pose};
use crate::se3::constant;
use graph::GraphLayer;
pub use matches::PutativeMatches;

/// Sizes of [`EquiGspr`]. Defaults are those of the released script, where it has them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EquiGsprConfig {
    /// Putative matches: points of the source, chosen evenly. Default 256; the script: 2,048.
    #[schemars(range(min = 1, max = 65536))]
    pub tokens: usize,
    /// Radius of the descriptors, in network units. Default 0.25.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0))]
    pub feature_radius: f64,
    /// Neighbours of each match in each graph. Default 16.
    #[schemars(range(min = 1, max = 1024))]
    pub neighbours: usize,
    /// Equivariant layers. Default 3.
    #[schemars(range(min = 1, max = 64))]
    pub layers: usize,
    /// Width of the features. Default 32.
    #[schemars(range(min = 1, max = 8192))]
    pub width: usize,
    /// Matches that the pose is made from. Default 128.
    #[schemars(range(min = 3, max = 65536))]
    pub kept: usize,
    /// Widths of the layers that score a match. Default 32, 16.
    #[schemars(length(max = 64), inner(range(min = 1, max = 8192)))]
    pub head: Vec<usize>,
    /// A match is right in training if the true pose leaves less than this between its points, in network
    /// units. Default 0.1.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0))]
    pub match_radius: f64,
}

impl Default for EquiGsprConfig {
    fn default() -> Self {
        Self {
            tokens: 256,
            feature_radius: 0.25,
            neighbours: 16,
            layers: 3,
            width: 32,
            kept: 128,
            head: vec![32, 16],
            match_radius: 0.1,
        }
    }
}

/// Weights of the losses of [`EquiGspr`]. The script: 1 each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EquiGsprLosses {
    /// Mean angle of the error of the rotation, as its chord: `|R - R_gt| / sqrt(2)`.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub rotation: f64,
    /// Mean error of the translation, network units.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub translation: f64,
    /// Binary cross-entropy of the scores with the true labels.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub scores: f64,
    /// Mean squared difference of the similarities from the true labels.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub similarity: f64,
}

/// The network.
#[derive(Module, Debug)]
pub struct EquiGspr {
    embedding: Linear,
    layers: Vec<GraphLayer>,
    head: Vec<Linear>,
    score: Linear,
}

impl NetworkConfig for EquiGsprConfig {
    type Network = EquiGspr;
    const KEY: &'static str = "equi_gspr_config";

    fn check(&self) -> Result<(), WrongSize> {
        if self.layers == 0 || self.neighbours == 0 || self.width == 0 || self.head.contains(&0) {
            return Err(WrongSize::new("layers", "neighbours, width and head must be 1 or more"));
        }
        if self.kept < 3 || self.tokens < self.kept {
            return Err(WrongSize::new("kept", "must be 3 or more, and at most `tokens`"));
        }
        let positive = |value: f64| value.is_finite() && value > 0.0;
        if !positive(self.feature_radius) || !positive(self.match_radius) {
            return Err(WrongSize::new("match_radius", "and feature_radius must be more than 0"));
        }
        Ok(())
    }

    fn init(&self, device: &Device) -> EquiGspr {
        let inputs = std::iter::once(2 * self.width).chain(self.head.iter().copied());
        EquiGspr {
            embedding: LinearConfig::new(PutativeMatches::WIDTH, self.width).init(device),
            layers: (0..self.layers).map(|_| GraphLayer::new(self.width, device)).collect(),
            head: inputs.zip(&self.head).map(|(i, &o)| LinearConfig::new(i, o).init(device)).collect(),
            score: LinearConfig::new(self.head.last().copied().unwrap_or(2 * self.width), 1).init(device),
        }
    }
}

/// What the network makes of the putative matches.
struct Scored {
    /// The kept matches, `[batch, kept, 3]` each.
    source: Tensor<3>,
    target: Tensor<3>,
    /// Their similarity and score, `[batch, kept]`, in [0, 1].
    similarity: Tensor<2>,
    score: Tensor<2>,
}

impl EquiGsprConfig {
    /// The pose from putative matches of any origin: whatever describes points in
    /// [`PutativeMatches::WIDTH`] numbers.
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn pose_of(&self, network: &EquiGspr, matches: PutativeMatches) -> Result<Pose, CopyError> {
        Self::fit(&self.score(network, matches)?)
    }

    /// Finds and scores matches.
    fn forward(
        &self,
        network: &EquiGspr,
        source: Tensor<3>,
        target: Tensor<3>,
        phase: f32,
    ) -> Result<Scored, CopyError> {
        let tokens = even_tokens(source.clone(), self.tokens, phase)?;
        let found = matches::putative(&source, &tokens, &target, self.feature_radius)?;
        self.score(network, found)
    }

    fn score(&self, network: &EquiGspr, found: PutativeMatches) -> Result<Scored, CopyError> {
        let [batch, n, _] = found.source.dims();
        // One graph a cloud, over the same matches; the layers are shared.
        let points = Tensor::cat(vec![found.source.clone(), found.target.clone()], 0); // [2 batch, n, 3]
        let features = Tensor::cat(vec![found.source_features, found.target_features], 0);
        let features = linear(&network.embedding, features, Activation::None); // [2 batch * n, width]
        let neighbours = graph::neighbours(&points, self.neighbours)?;
        let mut state = (points.reshape([2 * batch * n, 3]), features);
        for layer in &network.layers {
            state = layer.forward(state.0, state.1, &neighbours, self.neighbours);
        }
        let [_, width] = state.1.dims();
        let of_source = state.1.clone().narrow(0, 0, batch * n);
        let of_target = state.1.narrow(0, batch * n, batch * n);
        let similarity = (of_source.clone() * of_target.clone()).sum_dim(1) / (width as f64).sqrt();
        let similarity = sigmoid(similarity); // [batch * n, 1]

        let kept = self.kept.min(n);
        let chosen = matches::most_similar(&similarity, n, kept)?;
        let joined = rows(Tensor::cat(vec![of_source, of_target], 1), &chosen);
        let x = network.head.iter().fold(joined, |x, layer| linear(layer, x, Activation::Relu));
        let score = linear(&network.score, x, Activation::Sigmoid);
        let pick =
            |points: Tensor<3>| rows(points.reshape([batch * n, 3]), &chosen).reshape([batch, kept, 3]);
        Ok(Scored {
            source: pick(found.source),
            target: pick(found.target),
            similarity: rows(similarity, &chosen).reshape([batch, kept]),
            score: score.reshape([batch, kept]),
        })
    }

    /// The pose from the kept matches, by similarity and score.
    fn fit(scored: &Scored) -> Result<Pose, CopyError> {
        let weights = scored.similarity.clone() * scored.score.clone() + 1e-6;
        let weights = weights.clone() / weights.sum_dim(1);
        let (rotation, translation) =
            weighted_procrustes(scored.source.clone(), scored.target.clone(), weights.unsqueeze_dim::<3>(2))?;
        Ok(Pose { rotation, translation })
    }
}

impl LearnedConfig for EquiGsprConfig {
    type Losses = EquiGsprLosses;
    const NAME: &'static str = "equi-gspr";
    const TERMS: &'static [&'static str] = &["rotation", "translation", "scores", "similarity"];

    fn losses(
        &self,
        losses: &EquiGsprLosses,
        network: &EquiGspr,
        batch: &TrainingBatch,
    ) -> Result<Vec<(&'static str, Tensor<1>, f64)>, CopyError> {
        let scored = self.forward(network, batch.source.clone(), batch.target.clone(), batch.phase)?;
        let truth = (batch.rotation.clone(), batch.translation.clone());
        let labels = labels(&scored, truth.clone(), self.match_radius)?;
        let found = Self::fit(&scored)?;
        let chord = (found.rotation - truth.0).square().sum_dim(2).sum_dim(1) / 2.0;
        let rotation = chord.clamp_min(1e-12).sqrt().mean();
        let shift = (found.translation - truth.1).square().sum_dim(1);
        let translation = shift.clamp_min(1e-12).sqrt().mean();
        let p = scored.score.clamp(1e-6, 1.0 - 1e-6);
        let wrong = (labels.clone().neg() + 1.0) * (p.clone().neg() + 1.0).log();
        let scores = -(labels.clone() * p.log() + wrong).mean();
        let similarity = (scored.similarity - labels).square().mean();
        Ok(vec![
            ("rotation", rotation, losses.rotation),
            ("translation", translation, losses.translation),
            ("scores", scores, losses.scores),
            ("similarity", similarity, losses.similarity),
        ])
    }

    fn pose(&self, network: &EquiGspr, source: Tensor<3>, target: Tensor<3>) -> Result<Pose, CopyError> {
        Self::fit(&self.forward(network, source, target, 0.5)?)
    }
}

/// Which matches the true pose confirms, 1 or 0: `[batch, kept]`.
fn labels(
    scored: &Scored,
    (rotation, translation): (Tensor<3>, Tensor<2>),
    radius: f64,
) -> Result<Tensor<2>, CopyError> {
    let [batch, kept, _] = scored.source.dims();
    let apart = transform(scored.source.clone(), rotation, translation) - scored.target.clone();
    let apart: Vec<f64> = to_host(&apart.square().sum_dim(2))?;
    let labels: Vec<f64> = apart.iter().map(|d| f64::from(*d < radius * radius)).collect();
    Ok(constant(&labels, [batch, kept], &scored.source))
}
