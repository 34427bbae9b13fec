//! The registration loss.

use burn::tensor::Tensor;
use burn::tensor::activation::softmax;

use crate::procrustes::transform;
use crate::sem::distance;

/// `L_reg = |R^T R_gt - I|^2 + |t - t_gt|^2`, each as the mean over its elements, as in DCP's code
/// (9 for the rotation, 3 for the translation; the paper prints squared norms).
///
/// # Shapes
/// - `rotation`, `true_rotation`: `[batch, 3, 3]`; `translation`, `true_translation`: `[batch, 3]`
/// - output: `[1]`
pub fn registration_loss(
    rotation: Tensor<3>,
    translation: Tensor<2>,
    true_rotation: Tensor<3>,
    true_translation: Tensor<2>,
) -> Tensor<1> {
    let device = true_rotation.device().without_autodiff();
    let identity = Tensor::<2>::eye(3, &device).cast(true_rotation.dtype()).unsqueeze::<3>();
    let difference = rotation.transpose().matmul(true_rotation) - identity;
    difference.square().mean() + (translation - true_translation).square().mean()
}

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

/// `|a_i - b_j|^2`, `[batch, n, m]`.
pub(crate) fn squared_distances(a: &Tensor<3>, b: &Tensor<3>) -> Tensor<3> {
    let square = |x: &Tensor<3>| x.clone().square().sum_dim(2);
    let product = a.clone().matmul(b.clone().transpose());
    (square(a) + square(b).transpose() - product * 2.0).clamp_min(0.0)
}

/// Mean distance between the soft matches and where the true pose puts the source points. Not in
/// the paper: it tells every correspondence what it should be, where `L_reg` speaks to their sum
/// only.
///
/// # Shapes
/// - `points`, `matches`: `[batch, n, 3]`; output `[1]`
pub fn correspondence_loss(
    points: Tensor<3>,
    matches: Tensor<3>,
    true_rotation: Tensor<3>,
    true_translation: Tensor<2>,
) -> Tensor<1> {
    let [batch, n, _] = points.dims();
    let wanted = transform(points, true_rotation, true_translation);
    distance((wanted - matches).reshape([batch * n, 3])).mean()
}
