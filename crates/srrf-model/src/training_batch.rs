//! Pairs to learn from.

use burn::tensor::Tensor;
use srrf_cloud::Rigid;

use crate::batch::PairBatch;

/// Pairs that go through a network together, with their true poses; all in network units.
#[derive(Debug, Clone)]
pub struct TrainingBatch {
    /// `[batch, points, 3]`.
    pub source: Tensor<3>,
    /// `[batch, points, 3]`.
    pub target: Tensor<3>,
    /// The true rotation, `[batch, 3, 3]`.
    pub rotation: Tensor<3>,
    /// The true translation, `[batch, 3]`.
    pub translation: Tensor<2>,
    /// In [0, 1), from the number of the pair: which points carry tokens, in networks that take not all of them. 0.5 in
    /// validation.
    pub phase: f32,
}

impl TrainingBatch {
    /// The pairs, whose true poses map the sources as they were given onto the targets as they were given.
    pub fn new(pairs: &PairBatch, target_from_source: &[Rigid], phase: f32) -> Self {
        let (rotation, translation) = pairs.truth(target_from_source);
        Self { source: pairs.source.clone(), target: pairs.target.clone(), rotation, translation, phase }
    }

    /// Sources and then targets, `[2 batch, points, 3]`.
    pub fn clouds(&self) -> Tensor<3> {
        Tensor::cat(vec![self.source.clone(), self.target.clone()], 0)
    }
}
