//! Transformation integration: inlier ratios, lambda, and the weighted fusion projected back to
//! SO(3).

mod rule;

use burn::tensor::{Tensor, TensorData};
use rayon::prelude::*;

use crate::ops::{CopyError, HostClouds, share_within};
use crate::procrustes::{nearest_rotation, transform};

use rule::weigh;
pub use rule::{BranchRatios, CommonRatios, IntegrationRule, McNemar};

/// The fused pose and what it was made from.
#[derive(Debug, Clone)]
pub struct Fusion {
    /// `R`, the blend projected back to SO(3): `[batch, 3, 3]`.
    pub rotation: Tensor<3>,
    /// `t`: `[batch, 3]`.
    pub translation: Tensor<2>,
    /// `gamma_c` of each pair.
    pub dense_inlier_ratio: Vec<f64>,
    /// `gamma_s` of each pair.
    pub skeleton_inlier_ratio: Vec<f64>,
    /// `lambda` of each pair, 0.5 where both ratios are 0.
    pub lambda: Vec<f64>,
}

/// A branch's pose with the correspondences it came from.
pub struct PosedMatches<'a> {
    /// `[batch, 3, 3]`.
    pub rotation: &'a Tensor<3>,
    /// `[batch, 3]`.
    pub translation: &'a Tensor<2>,
    /// Points that were matched: `[batch, n, 3]`.
    pub points: &'a Tensor<3>,
    /// Their soft matches: `[batch, n, 3]`.
    pub matches: &'a Tensor<3>,
}

impl IntegrationRule {
    /// `{R, t} = lambda {R_c, t_c} + (1 - lambda) {R_s, t_s}` for clouds centred on their means.
    /// Lambda counts inliers, so it is a constant of the backward pass.
    ///
    /// # Shapes
    /// - `source`, `target`: `[batch, points, 3]`
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn fuse(
        &self,
        dense: PosedMatches<'_>,
        skeleton: PosedMatches<'_>,
        source: &Tensor<3>,
        target: &Tensor<3>,
    ) -> Result<Fusion, CopyError> {
        let ratio = |branch: &PosedMatches<'_>, threshold| match self {
            Self::SoftMatch(_) => Ok(shares(&agreeing(branch, branch, threshold)?)),
            Self::BothWays(_) => near(branch, threshold, source, target, true),
            _ => near(branch, threshold, source, target, false),
        };
        let common = |threshold| -> Result<_, CopyError> {
            Ok((agreeing(&dense, &dense, threshold)?, agreeing(&dense, &skeleton, threshold)?))
        };
        let weigh = |c: &[f64], s: &[f64], sharpness, weight| -> Vec<f64> {
            c.iter().zip(s).map(|(c, s)| weigh(*c, *s, sharpness, weight)).collect()
        };
        let (dense_inlier_ratio, skeleton_inlier_ratio, lambda) = match self {
            Self::SoftMatch(rule) | Self::Nearest(rule) | Self::BothWays(rule) => {
                let c = ratio(&dense, rule.dense_threshold)?;
                let s = ratio(&skeleton, rule.skeleton_threshold)?;
                let lambda = weigh(&c, &s, rule.sharpness, rule.skeleton_weight);
                (c, s, lambda)
            }
            Self::Common(rule) => {
                let (c, s) = common(rule.threshold)?;
                let (c, s) = (shares(&c), shares(&s));
                let lambda = weigh(&c, &s, rule.sharpness, rule.skeleton_weight);
                (c, s, lambda)
            }
            Self::McNemar(rule) => {
                let (c, s) = common(rule.threshold)?;
                let ahead = standard_errors_ahead(&s, &c);
                let lambda =
                    ahead.iter().map(|z| if *z > rule.standard_errors { 0.0 } else { 1.0 }).collect();
                (shares(&c), shares(&s), lambda)
            }
        };

        let device = source.device().without_autodiff();
        let weights = TensorData::new(lambda.clone(), [lambda.len(), 1]);
        let weight = Tensor::<2>::from_data(weights, (&device, source.dtype()));
        let blend = |a: Tensor<2>, b: Tensor<2>| a * weight.clone() + b * (-weight.clone() + 1.0);

        let batch = lambda.len();
        let rotation =
            blend(dense.rotation.clone().reshape([batch, 9]), skeleton.rotation.clone().reshape([batch, 9]));
        // The projection is the exact weighted chordal mean of the two rotations.
        let rotation = nearest_rotation(rotation.reshape([batch, 3, 3]))?;
        let translation = blend(dense.translation.clone(), skeleton.translation.clone());
        Ok(Fusion { rotation, translation, dense_inlier_ratio, skeleton_inlier_ratio, lambda })
    }
}

/// `gamma = N_inlier / N` of each pair: the share of the source points that the pose brings near the target, or, from
/// `both_sides`, the mean of that and the share of target points with a source point near.
fn near(
    pose: &PosedMatches<'_>,
    threshold: f64,
    source: &Tensor<3>,
    target: &Tensor<3>,
    both_sides: bool,
) -> Result<Vec<f64>, CopyError> {
    let moved = pose.host_clouds(source)?;
    let target = HostClouds::read(target)?;
    let clouds: Vec<_> = moved.iter().zip(target.iter()).collect();
    let share = |a, b| share_within(a, b, threshold as f32);
    let ratio = |(a, b): &(_, _)| match both_sides {
        true => 0.5 * (share(*a, *b) + share(*b, *a)),
        false => share(*a, *b),
    };
    Ok(clouds.par_iter().map(ratio).collect())
}

impl PosedMatches<'_> {
    /// `points` moved by the pose.
    fn host_clouds(&self, points: &Tensor<3>) -> Result<HostClouds, CopyError> {
        let (rotation, translation) = (self.rotation.clone().detach(), self.translation.clone().detach());
        HostClouds::read(&transform(points.clone().detach(), rotation, translation))
    }
}

/// Of each correspondence of a branch, whether it agrees with a pose: `|R x_i + t - yhat_i| < threshold`.
fn agreeing(
    branch: &PosedMatches<'_>,
    pose: &PosedMatches<'_>,
    threshold: f64,
) -> Result<Vec<Vec<bool>>, CopyError> {
    let moved = pose.host_clouds(branch.points)?;
    let matches = HostClouds::read(&branch.matches.clone().detach())?;
    let near = |(a, b): (&[f32; 3], &[f32; 3])| {
        (0..3).map(|c| f64::from(a[c] - b[c]).powi(2)).sum::<f64>() < threshold * threshold
    };
    Ok(moved.iter().zip(matches.iter()).map(|(a, b)| a.iter().zip(b).map(near).collect()).collect())
}

/// The share of each pair's correspondences that agree.
fn shares(agree: &[Vec<bool>]) -> Vec<f64> {
    agree.iter().map(|a| a.iter().filter(|near| **near).count() as f64 / a.len() as f64).collect()
}

/// McNemar's statistic, pair by pair: of the correspondences that agree with one pose alone, by how many standard errors more
/// agree with the first one.
fn standard_errors_ahead(first: &[Vec<bool>], second: &[Vec<bool>]) -> Vec<f64> {
    let of_pair = |(a, b): (&Vec<bool>, &Vec<bool>)| {
        let (mut gained, mut lost) = (0.0, 0.0);
        for (a, b) in a.iter().zip(b) {
            gained += f64::from(u8::from(*a && !*b));
            lost += f64::from(u8::from(*b && !*a));
        }
        if gained + lost > 0.0 { (gained - lost) / f64::sqrt(gained + lost) } else { 0.0 }
    };
    first.iter().zip(second).map(of_pair).collect()
}
