//! Distances between points in tensors, differentiable in both.

use burn::tensor::Tensor;

use crate::ops::clouds::{HostClouds, flat_indices};
use crate::ops::copy::CopyError;
use crate::ops::gather::rows;
use crate::ops::neighbours::nearest;

/// `|a_i - b_j|^2`, `[batch, n, m]`.
pub(crate) fn squared_distances(a: &Tensor<3>, b: &Tensor<3>) -> Tensor<3> {
    let square = |x: &Tensor<3>| x.clone().square().sum_dim(2);
    let product = a.clone().matmul(b.clone().transpose());
    (square(a) + square(b).transpose() - product * 2.0).clamp_min(0.0)
}

/// Distance from each of `points` to the nearest of `support`, differentiable in both. The nearest
/// one is found on the host; the distance is floored at 1e-6, so that its gradient stays finite.
///
/// # Shapes
/// - `points`: `[clouds, n, 3]`, `support`: `[clouds, m, 3]`
/// - output: `[clouds, n]`
///
/// # Errors
/// [`CopyError`] where the coordinates cannot be copied.
pub fn nearest_distance(points: Tensor<3>, support: Tensor<3>) -> Result<Tensor<2>, CopyError> {
    let [clouds, n, _] = points.dims();
    let nearest = nearest_rows(&points, &support)?;
    let [_, m, _] = support.dims();
    let matched = rows(support.reshape([clouds * m, 3]), &nearest);
    Ok(distance(points.reshape([clouds * n, 3]) - matched).reshape([clouds, n]))
}

/// Row numbers, in the flattened support, of the nearest support point of each point.
pub(crate) fn nearest_rows(points: &Tensor<3>, support: &Tensor<3>) -> Result<Vec<i64>, CopyError> {
    let [_, m, _] = support.dims();
    let (points, support) = (HostClouds::read(points)?, HostClouds::read(support)?);
    let supports: Vec<_> = support.iter().collect();
    Ok(flat_indices(&points, m, |i, cloud| nearest(cloud, supports[i])))
}

/// Norm of each row, floored at 1e-6. Shape `[rows, 3]` to `[rows]`.
pub(crate) fn distance(difference: Tensor<2>) -> Tensor<1> {
    difference.square().sum_dim(1).squeeze_dim::<1>(1).clamp_min(1e-12).sqrt()
}
