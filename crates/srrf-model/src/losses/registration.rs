//! The registration loss, and how far soft matches are from where they should be.

use burn::tensor::Tensor;

use crate::ops::distance;
use crate::procrustes::transform;

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
