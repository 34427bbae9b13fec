//! Soft matching: a probability over the target points for each source point.

use burn::module::{Module, Param};
use burn::tensor::activation::softmax;
use burn::tensor::{Device, Tensor};

/// Soft matching with a learned temperature.
#[derive(Module, Debug)]
pub struct SoftMatching {
    /// Logarithm of the inverse temperature; starts at 0. Shape `[1]`.
    log_sharpness: Param<Tensor<1>>,
}

/// Soft matches of the source points.
#[derive(Debug, Clone)]
pub struct SoftMatches {
    /// `yhat`, the expected target point of each source point: `[batch, n, 3]`.
    pub points: Tensor<3>,
    /// `m(x_i, Y)`, the probability of each target point: `[batch, n, m]`.
    pub probabilities: Tensor<3>,
}

impl SoftMatching {
    /// A new matching, at temperature 1.
    pub fn new(device: &Device) -> Self {
        Self { log_sharpness: Param::from_tensor(Tensor::zeros([1], device)) }
    }

    /// `m(x_i, Y) = softmax(Phi_Y Phi_x^T / (T sqrt(d)))` and `yhat_i = Y^T m(x_i, Y)`.
    ///
    /// The paper prints no `sqrt(d)`; DCP's code, which its formula follows, divides by it, and
    /// without it the softmax saturates.
    ///
    /// # Shapes
    /// - `source_features`: `[batch, n, width]`, `target_features`: `[batch, m, width]`,
    ///   `target_points`: `[batch, m, 3]`
    pub fn forward(
        &self,
        source_features: Tensor<3>,
        target_features: Tensor<3>,
        target_points: Tensor<3>,
    ) -> SoftMatches {
        let [_, _, width] = source_features.dims();
        let sharpness = self.log_sharpness.val().exp().unsqueeze::<3>() / (width as f64).sqrt();
        soft_matches((source_features * sharpness).matmul(target_features.transpose()), target_points)
    }
}

/// `m = softmax(scores)` over the target points, and `yhat = m Y`.
///
/// # Shapes
/// - `scores`: `[batch, n, m]`, `target_points`: `[batch, m, 3]`
pub fn soft_matches(scores: Tensor<3>, target_points: Tensor<3>) -> SoftMatches {
    let probabilities = softmax(scores, 2);
    SoftMatches { points: probabilities.clone().matmul(target_points), probabilities }
}
