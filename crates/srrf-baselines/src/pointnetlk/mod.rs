//! PointNetLK (Aoki and others 2019), and the analytic Jacobian of PointNetLK Revisited (Li and others
//! 2021) as a switch.
//!
//! A PointNet turns each cloud into one feature; inverse-compositional Lucas-Kanade moves the source
//! until its feature is that of the target. Where this differs from the authors' code: no batch norm
//! (frozen during the iterations, as there, it is an affine map, which the linear layer behind it can
//! hold as well); no pre-training of the PointNet as a classifier; a damping of 1e-6 of the mean
//! diagonal in the normal equations, which the code leaves singular where the features have died; always
//! all iterations, where the code stops at a motion below 1e-7.

mod jacobian;

use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::{Device, Tensor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use srrf_model::fast::{Activation, linear};
use srrf_model::ops::even_tokens;
use srrf_model::{CopyError, NetworkConfig, TrainingBatch, WrongSize, transform};

use crate::dgcnn::max_over;
use crate::learned::{LearnedConfig, Pose};
use crate::se3::{exp, identity, parts};

/// How the derivative of the target's feature by its pose is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LkJacobian {
    /// Backward differences with a step of 0.01 in each coordinate of the twist: the first paper.
    FiniteDifference,
    /// The chain rule at the point that each feature's maximum comes from: Revisited.
    Analytic,
}

/// Sizes of [`PointNetLk`]. Defaults are those of the authors' code.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PointNetLkConfig {
    /// Points of each cloud that the network sees, chosen evenly; 0 (default) for all.
    #[schemars(range(min = 0, max = 65536))]
    pub points: usize,
    /// Widths of the layers. Default 64, 64, 64, 128, 1,024; Revisited: 64, 128, 1,024.
    #[schemars(length(min = 1, max = 64), inner(range(min = 1, max = 8192)))]
    pub widths: Vec<usize>,
    /// The Jacobian. Default `finite_difference`.
    pub jacobian: LkJacobian,
    /// Iterations in training. Default 10.
    #[schemars(range(min = 1, max = 1000))]
    pub iterations: usize,
    /// Iterations at test. Default 10; Revisited: 20.
    #[schemars(range(min = 1, max = 1000))]
    pub test_iterations: usize,
}

impl Default for PointNetLkConfig {
    fn default() -> Self {
        Self {
            points: 0,
            widths: vec![64, 64, 64, 128, 1024],
            jacobian: LkJacobian::FiniteDifference,
            iterations: 10,
            test_iterations: 10,
        }
    }
}

/// Weights of the losses of [`PointNetLk`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointNetLkLosses {
    /// Squared difference of the features after the last iteration, sum over the features. The paper: 1.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub residual: f64,
    /// Mean of the 16 squared elements of `G G_gt^-1 - I`. The authors' code: 16.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub pose: f64,
}

/// The network.
#[derive(Module, Debug)]
pub struct PointNetLk {
    layers: Vec<Linear>,
}

impl PointNetLk {
    /// Features of each point: `[rows, 3]` to `[rows, features]`.
    fn embed(&self, points: Tensor<2>) -> Tensor<2> {
        self.layers.iter().fold(points, |x, layer| linear(layer, x, Activation::Relu))
    }

    /// The feature of each cloud: `[clouds, n, 3]` to `[clouds, features]`.
    fn feature(&self, clouds: Tensor<3>) -> Tensor<2> {
        let [count, n, _] = clouds.dims();
        max_over(self.embed(clouds.reshape([count * n, 3])), n)
    }
}

impl NetworkConfig for PointNetLkConfig {
    type Network = PointNetLk;
    const KEY: &'static str = "pointnetlk_config";

    fn check(&self) -> Result<(), WrongSize> {
        if self.widths.is_empty() || self.widths.contains(&0) {
            return Err(WrongSize::new("widths", "needs 1 layer or more, each 1 wide or more"));
        }
        if self.widths[self.widths.len() - 1] < 6 {
            return Err(WrongSize::new("widths", "must end in 6 or more, as many as a pose has parameters"));
        }
        if self.iterations == 0 || self.test_iterations == 0 {
            return Err(WrongSize::new("iterations", "and test_iterations must be 1 or more"));
        }
        if (1..3).contains(&self.points) {
            return Err(WrongSize::new("points", "must be 0 (all) or 3 or more"));
        }
        Ok(())
    }

    fn init(&self, device: &Device) -> PointNetLk {
        let inputs = std::iter::once(3).chain(self.widths.iter().copied());
        PointNetLk {
            layers: inputs.zip(&self.widths).map(|(i, &o)| LinearConfig::new(i, o).init(device)).collect(),
        }
    }
}

impl PointNetLkConfig {
    /// The motion after `iterations`, `[batch, 4, 4]`, and the last difference of the features.
    fn align(
        &self,
        network: &PointNetLk,
        source: Tensor<3>,
        target: Tensor<3>,
        iterations: usize,
        phase: f32,
    ) -> Result<(Tensor<3>, Tensor<2>), CopyError> {
        let source = even_tokens(source, self.points, phase)?;
        let target = even_tokens(target, self.points, phase)?;
        let [batch, _, _] = source.dims();
        let feature = network.feature(target.clone()); // [batch, features]
        let j = match self.jacobian {
            LkJacobian::FiniteDifference => jacobian::finite_difference(network, &target, &feature),
            LkJacobian::Analytic => jacobian::analytic(network, &target)?,
        }; // [batch, features, 6]
        let inverse = jacobian::pseudo_inverse(j)?; // [batch, 6, features]
        let mut motion = identity(batch, 4, &source);
        let mut residual = feature.clone();
        for _ in 0..iterations {
            let (rotation, translation) = parts(motion.clone());
            residual = network.feature(transform(source.clone(), rotation, translation)) - feature.clone();
            let step = inverse.clone().matmul(residual.clone().unsqueeze_dim::<3>(2)); // [batch, 6, 1]
            motion = exp(-step.squeeze_dim::<2>(2)).matmul(motion);
        }
        Ok((motion, residual))
    }
}

impl LearnedConfig for PointNetLkConfig {
    type Losses = PointNetLkLosses;
    const NAME: &'static str = "pointnetlk";
    const TERMS: &'static [&'static str] = &["residual", "pose"];

    fn losses(
        &self,
        losses: &PointNetLkLosses,
        network: &PointNetLk,
        batch: &TrainingBatch,
    ) -> Result<Vec<(&'static str, Tensor<1>, f64)>, CopyError> {
        let (source, target) = (batch.source.clone(), batch.target.clone());
        let (motion, residual) = self.align(network, source, target, self.iterations, batch.phase)?;
        let (rotation, translation) = parts(motion);
        // G G_gt^-1 = [R R_gt^T, t - R R_gt^T t_gt]; the last row of the difference is 0.
        let turned = rotation.matmul(batch.rotation.clone().transpose());
        let [pairs, _, _] = turned.dims();
        let moved = turned.clone().matmul(batch.translation.clone().unsqueeze_dim::<3>(2));
        let shift = translation - moved.squeeze_dim::<2>(2);
        let difference = (turned.clone() - identity(pairs, 3, &turned)).square().sum() + shift.square().sum();
        let residual = residual.square().sum() / pairs as f64;
        let pose = difference / (16 * pairs) as f64;
        Ok(vec![("residual", residual, losses.residual), ("pose", pose, losses.pose)])
    }

    fn pose(&self, network: &PointNetLk, source: Tensor<3>, target: Tensor<3>) -> Result<Pose, CopyError> {
        let (motion, _) = self.align(network, source, target, self.test_iterations, 0.5)?;
        let (rotation, translation) = parts(motion);
        Ok(Pose { rotation, translation })
    }

    fn passes(&self) -> usize {
        self.test_iterations
    }
}
