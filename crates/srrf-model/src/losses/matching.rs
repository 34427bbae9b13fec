//! What the true pose says of the matching probabilities.

use burn::tensor::Tensor;
use burn::tensor::activation::softmax;

use crate::ops::squared_distances;
use crate::procrustes::transform;

/// Kullback-Leibler divergence of the matching probabilities from what the true pose says. Not in the paper:
/// RGM, DIT and others teach matches by a cross-entropy with the one true match; where the points of the two clouds
/// do not coincide, there is none, so each source point has a label that falls off as a Gaussian around its
/// true place, half as wide as the target points are apart. Source points with nothing near their true place
/// (cut away, or background) count little. Where the matching has slack, `matched` is taught the same weight by
/// its binary cross-entropy, less that of the weight with itself.
///
/// # Shapes
/// - `probabilities`: `[batch, n, m]`, `matched`: `[batch, n, 1]`, `points`: `[batch, n, 3]`, `targets`:
///   `[batch, m, 3]`, output `[1]`
pub fn matching_loss(
    probabilities: Tensor<3>,
    matched: Option<Tensor<3>>,
    points: Tensor<3>,
    targets: Tensor<3>,
    true_rotation: Tensor<3>,
    true_translation: Tensor<2>,
) -> Tensor<1> {
    let (points, targets) = (points.detach(), targets.detach());
    let apart = squared_distances(&targets, &targets);
    // The point itself, and copies of it: `f32` leaves up to a few 1e-6 of their distance.
    let itself = apart.clone().lower_equal_elem(1e-5);
    let apart = apart.mask_fill(itself, f32::MAX).min_dim(2); // [batch, m, 1]
    let spacing = apart.clamp(1e-6, 1.0).mean_dim(1); // squared, [batch, 1, 1]
    let scaled = squared_distances(&transform(points, true_rotation, true_translation), &targets) / spacing;
    let weights = (scaled.clone().min_dim(2) * -0.5).exp(); // [batch, n, 1]
    let labels = softmax(scaled * -2.0, 2); // standard deviation: half the spacing
    let log = |p: Tensor<3>| (p + 1e-9).log();
    let divergence = (labels.clone() * (log(labels) - log(probabilities))).sum_dim(2);
    let rows = (divergence * weights.clone()).sum() / (weights.clone().sum() + 1e-6);
    let Some(matched) = matched else { return rows };
    let against = |p: Tensor<3>, q: Tensor<3>| p.clone() * (log(p) - log(q));
    let none = against(weights.clone().neg() + 1.0, matched.clone().neg() + 1.0);
    rows + (against(weights, matched) + none).mean()
}
