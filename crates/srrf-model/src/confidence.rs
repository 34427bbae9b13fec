//! Confidence: how much each source point counts in the SVD head. Not in the paper, whose head takes
//! all points alike; a switch, off by default.

use burn::module::{Module, Param};
use burn::tensor::activation::softmax;
use burn::tensor::{Device, Tensor};

/// A weight for each source point, from its features after the interaction, which know both clouds.
/// It is learned through the SVD head alone, and starts with equal weights.
#[derive(Module, Debug)]
pub struct Confidence {
    /// Direction in feature space along which confidence grows: `[width, 1]`. Starts at 0.
    direction: Param<Tensor<2>>,
}

impl Confidence {
    /// Equal weights for features of `width` channels.
    pub fn new(width: usize, device: &Device) -> Self {
        Self { direction: Param::from_tensor(Tensor::zeros([width, 1], device)) }
    }

    /// `w = softmax(Phi_X u)` over the points, so that the weights of a cloud sum to 1.
    ///
    /// # Shapes
    /// - `source_features`: `[batch, n, width]`
    /// - output: `[batch, n, 1]`
    pub fn forward(&self, source_features: Tensor<3>) -> Tensor<3> {
        let [batch, n, width] = source_features.dims();
        let scores = source_features.reshape([batch * n, width]).matmul(self.direction.val());
        softmax(scores.reshape([batch, n, 1]), 1)
    }
}
