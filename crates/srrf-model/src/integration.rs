//! Transformation integration: inlier ratios, lambda, and the weighted fusion projected back to
//! SO(3).

use burn::tensor::{Tensor, TensorData};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::defaults;
use crate::ops::{CopyError, HostClouds, share_within};
use crate::procrustes::{nearest_rotation, transform};

/// Which points the inlier test of a branch looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InlierTest {
    /// The paper's words: a correspondence `x_i -> yhat_i` is an inlier when
    /// `|R x_i + t - yhat_i| < tau`. Soft matches shrink towards the centroid, more so where there
    /// are more of them, so the ratios of the two branches are not on one scale.
    SoftMatch,
    /// The same test for both branches: a point of the full source cloud is an inlier when the
    /// branch's pose brings it closer than `tau` to the target cloud.
    Nearest,
    /// As [`InlierTest::Nearest`], from both sides: the mean of the shares of source points near the target
    /// and of target points near the source.
    BothWays,
    /// The paper's words for both poses with one set of correspondences, the dense branch's. They favour the dense pose, which
    /// was fitted to them: where the skeleton's makes more of them inliers, outliers have drawn the fit away. The
    /// threshold is `dense_threshold`.
    Common,
}

/// How the two poses are blended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IntegrationConfig {
    /// The inlier test.
    pub test: InlierTest,
    /// Inlier threshold of the dense branch, in network units (clouds of unit radius). RGM: 0.05.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0))]
    pub dense_threshold: f64,
    /// Inlier threshold of the skeleton branch, network units; its spacing is 4 times as wide.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0))]
    pub skeleton_threshold: f64,
    /// Lambda is `g_c^p / (g_c^p + (w g_s)^p)` with this `p`; the paper's is 1.
    #[schemars(range(min = 0.0, max = 1e4))]
    pub sharpness: f64,
    /// The `w` above. Below 1 the skeleton branch wins only where its pose has that much more inliers: of two poses that
    /// fit about as well, the dense branch's is the better one more often. Default and the paper: 1.
    #[serde(default = "defaults::one", skip_serializing_if = "defaults::is_one")]
    #[schemars(range(min = 0.0, max = 100.0), extend("default" = 1.0))]
    pub skeleton_weight: f64,
    /// With [`InlierTest::Common`]: lambda is 0 where the skeleton branch is ahead by more than so many standard errors, and 1 elsewhere
    /// (McNemar 1947: of the correspondences that are inliers of one pose alone, `n_s` and `n_c`, that is
    /// `n_s - n_c > z sqrt(n_s + n_c)`). Default: none, lambda weighs the ratios.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e4))]
    pub standard_errors: Option<f64>,
}

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

impl IntegrationConfig {
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
        let near = |branch: &PosedMatches<'_>, threshold| self.near(branch, threshold, source, target);
        let (dense_inlier_ratio, skeleton_inlier_ratio, ahead) = match self.test {
            InlierTest::SoftMatch => {
                let (c, s) = (
                    agreeing(&dense, &dense, self.dense_threshold)?,
                    agreeing(&skeleton, &skeleton, self.skeleton_threshold)?,
                );
                (shares(&c), shares(&s), None)
            }
            InlierTest::Common => {
                let (c, s) = (
                    agreeing(&dense, &dense, self.dense_threshold)?,
                    agreeing(&dense, &skeleton, self.dense_threshold)?,
                );
                (shares(&c), shares(&s), Some(standard_errors_ahead(&s, &c)))
            }
            InlierTest::Nearest | InlierTest::BothWays => {
                (near(&dense, self.dense_threshold)?, near(&skeleton, self.skeleton_threshold)?, None)
            }
        };
        let lambda: Vec<f64> = match (self.standard_errors, ahead) {
            (Some(least), Some(ahead)) => ahead.iter().map(|z| if *z > least { 0.0 } else { 1.0 }).collect(),
            _ => dense_inlier_ratio
                .iter()
                .zip(&skeleton_inlier_ratio)
                .map(|(c, s)| (c.powf(self.sharpness), (self.skeleton_weight * s).powf(self.sharpness)))
                .map(|(c, s)| if c + s > 0.0 { c / (c + s) } else { 0.5 })
                .collect(),
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

    /// `gamma = N_inlier / N` of each pair: the share of the source points that the pose brings near the target, or the mean
    /// of that and the share of target points with a source point near.
    fn near(
        &self,
        pose: &PosedMatches<'_>,
        threshold: f64,
        source: &Tensor<3>,
        target: &Tensor<3>,
    ) -> Result<Vec<f64>, CopyError> {
        let moved = pose.host_clouds(source)?;
        let target = HostClouds::read(target)?;
        let clouds: Vec<_> = moved.iter().zip(target.iter()).collect();
        let share = |a, b| share_within(a, b, threshold as f32);
        let ratio = |(a, b): &(_, _)| match self.test {
            InlierTest::BothWays => 0.5 * (share(*a, *b) + share(*b, *a)),
            _ => share(*a, *b),
        };
        Ok(clouds.par_iter().map(ratio).collect())
    }
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
