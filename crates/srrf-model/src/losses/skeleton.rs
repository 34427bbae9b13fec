//! The skeleton losses: `L_bsp = L_s + lambda_1 L_p + lambda_2 L_r` (Point2Skeleton) and the
//! distribution distance loss `L_ddl`.

use burn::tensor::{Tensor, TensorData};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::defaults;
use crate::ops::{CopyError, distance, nearest_distance, nearest_rows, rows};
use crate::procrustes::transform;
use crate::sem::SkeletonBatch;

/// Weights of the skeleton losses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SkeletonLossConfig {
    /// `lambda_1`, the weight of the point-to-sphere loss. Point2Skeleton: 0.3.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub point_to_sphere: f64,
    /// `lambda_2`, the weight of the radius loss. Point2Skeleton: 0.4.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub radius: f64,
    /// The weight of the distribution distance loss (mean over points; the paper prints a sum). At
    /// 1 the skeleton collapses to its centroid, at 0.25 it keeps its spread.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub distribution: f64,
    /// The weight of the distribution distance over the spread of the target skeleton, which shrinking does not
    /// lower, so that it may be as large as the distance is to count. Not in the paper; 0 is the paper.
    #[serde(default, skip_serializing_if = "defaults::is_zero")]
    #[schemars(range(min = 0.0, max = 1e6), extend("default" = 0.0))]
    pub distribution_over_spread: f64,
    /// The weight of the distance between skeleton points of the same number in both clouds, over
    /// their spread. Not in the paper; 0 is the paper.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub index_match: f64,
}

/// The losses of one batch, each of shape `[1]`.
#[derive(Debug, Clone)]
pub struct SkeletonLoss {
    /// `L_s`, the sampling loss.
    pub sampling: Tensor<1>,
    /// `L_p`, the point-to-sphere loss.
    pub point_to_sphere: Tensor<1>,
    /// `L_r`, the radius loss (negative mean radius).
    pub radius: Tensor<1>,
    /// `L_ddl`, the distribution distance.
    pub distribution: Tensor<1>,
    /// `L_ddl` over the spread.
    pub distribution_over_spread: Tensor<1>,
    /// The index-matched distance over the spread.
    pub index_match: Tensor<1>,
    /// The weighted sum.
    pub total: Tensor<1>,
}

/// Chamfer distance, unsquared, mean over the points in each direction: the pre-training loss.
///
/// # Shapes
/// - `a`: `[clouds, n, 3]`, `b`: `[clouds, m, 3]`; output `[1]`
///
/// # Errors
/// [`CopyError`] where the coordinates cannot be copied to the host, which finds the nearest points.
pub fn chamfer(a: Tensor<3>, b: Tensor<3>) -> Result<Tensor<1>, CopyError> {
    Ok(nearest_distance(a.clone(), b.clone())?.mean() + nearest_distance(b, a)?.mean())
}

/// The skeleton losses of a batch of pairs.
///
/// # Shapes
/// - `source`, `target`: `[batch, points, 3]`; `rotation`: `[batch, 3, 3]`, `translation`: `[batch, 3]`,
///   the true pose (target ~ R source + t)
///
/// # Errors
/// As [`chamfer`].
pub fn skeleton_loss(
    config: &SkeletonLossConfig,
    (source, source_skeleton): (Tensor<3>, &SkeletonBatch),
    (target, target_skeleton): (Tensor<3>, &SkeletonBatch),
    rotation: Tensor<3>,
    translation: Tensor<2>,
) -> Result<SkeletonLoss, CopyError> {
    let clouds = Tensor::cat(vec![source, target], 0);
    let points = Tensor::cat(vec![source_skeleton.points.clone(), target_skeleton.points.clone()], 0);
    let radii = Tensor::cat(vec![source_skeleton.radii.clone(), target_skeleton.radii.clone()], 0);

    let sampling = chamfer(sphere_samples(points.clone(), radii.clone()), clouds.clone())?; // L_s
    let point_to_sphere = point_to_sphere(clouds, points, radii.clone())?; // L_p
    let radius = -radii.mean(); // L_r

    // L_ddl between the source skeleton under the true pose and the target skeleton.
    let posed = transform(source_skeleton.points.clone(), rotation, translation);
    let distribution = chamfer(posed.clone(), target_skeleton.points.clone())?;
    // The spread is on the graph: without its gradient, shrinking the skeleton would be the cheapest way to lower
    // what is divided by it.
    let spread = spread(target_skeleton.points.clone()).clamp_min(1e-3);
    let distribution_over_spread = distribution.clone() / spread.clone();
    let index_match = index_match(posed, target_skeleton.points.clone()) / spread;

    let total = sampling.clone()
        + point_to_sphere.clone() * config.point_to_sphere
        + radius.clone() * config.radius
        + distribution.clone() * config.distribution
        + distribution_over_spread.clone() * config.distribution_over_spread
        + index_match.clone() * config.index_match;
    Ok(SkeletonLoss {
        sampling,
        point_to_sphere,
        radius,
        distribution,
        distribution_over_spread,
        index_match,
        total,
    })
}

/// Eight samples on each sphere, `s + r (+-1, +-1, +-1) / sqrt(3)`: `[clouds, 8 m, 3]`.
fn sphere_samples(points: Tensor<3>, radii: Tensor<2>) -> Tensor<3> {
    let [clouds, m, _] = points.dims();
    let unit = 1.0 / 3.0_f64.sqrt();
    let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 0 { unit } else { -unit };
    let corners: Vec<f64> = (0..8).flat_map(|corner| (0..3).map(move |axis| sign(corner, axis))).collect();
    let device = points.device().without_autodiff();
    let corners = Tensor::<4>::from_data(TensorData::new(corners, [1, 1, 8, 3]), (&device, points.dtype()));
    let offsets = radii.unsqueeze_dims::<4>(&[2, 3]) * corners; // [clouds, m, 8, 3]
    (points.unsqueeze_dim::<4>(2) + offsets).reshape([clouds, 8 * m, 3])
}

/// `L_p`: how far each point is from the sphere of its nearest skeleton point, and each sphere
/// from its nearest point.
fn point_to_sphere(clouds: Tensor<3>, points: Tensor<3>, radii: Tensor<2>) -> Result<Tensor<1>, CopyError> {
    let [batch, n, _] = clouds.dims();
    let [_, m, _] = points.dims();
    let nearest = nearest_rows(&clouds, &points)?;
    let centres = rows(points.clone().reshape([batch * m, 3]), &nearest);
    let near_radii = rows(radii.clone().reshape([batch * m, 1]), &nearest).squeeze_dim::<1>(1);
    let to_sphere = (distance(clouds.clone().reshape([batch * n, 3]) - centres) - near_radii).abs().mean();
    let to_cloud = (nearest_distance(points, clouds)? - radii).abs().mean();
    Ok(to_sphere + to_cloud)
}

/// Mean distance between skeleton points of the same number.
fn index_match(posed: Tensor<3>, target: Tensor<3>) -> Tensor<1> {
    let [batch, m, _] = target.dims();
    distance((posed - target).reshape([batch * m, 3])).mean()
}

/// Root mean square distance of the skeleton points from their mean: the number that shows a
/// collapse. Shape `[1]`.
pub fn spread(points: Tensor<3>) -> Tensor<1> {
    let centred = points.clone() - points.mean_dim(1);
    (centred.square().mean() * 3.0).sqrt()
}
