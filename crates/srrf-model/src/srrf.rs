//! The pipeline: the paper's figure 2, one statement a stage.

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use srrf_cloud::profile::stage;

use crate::branch::{BranchConfig, BranchLayout, BranchOutput, RegistrationBranch};
use crate::inference::InferenceConfig;
use crate::integration::{Fusion, IntegrationRule};
use crate::ops::{CopyError, HostClouds};
use crate::prior::PositionPrior;
use crate::sem::{Sem, SemConfig, SemLayout, SkeletonBatch};
use crate::timing::timed;

/// Sizes of the whole network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SrrfConfig {
    /// The skeleton extraction module.
    pub sem: SemConfig,
    /// The branch on the corrupted clouds, superscript c in the paper.
    pub dense: BranchConfig,
    /// The branch on the skeletons, superscript s.
    pub skeleton: BranchConfig,
    /// The transformation integration.
    pub integration: IntegrationRule,
    /// How the trained network is used; training takes no notice of it.
    #[serde(default, skip_serializing_if = "InferenceConfig::is_default")]
    pub inference: InferenceConfig,
}

impl SrrfConfig {
    /// A new network; see [`crate::init::seeded`] for weights that do not depend on the backend.
    pub fn init(&self, device: &Device) -> Srrf {
        Srrf {
            sem: self.sem.init(device),
            dense: self.dense.init(device),
            skeleton: self.skeleton.init(device),
        }
    }

    /// The layout of `clouds`, sources and then targets.
    pub fn layout(&self, clouds: &HostClouds, phase: f32) -> SrrfLayout {
        let (sem, dense) = (self.sem.layout(clouds), self.dense.layout(clouds, phase));
        SrrfLayout { sem, dense, phase, prior: None }
    }
}

/// The network.
#[derive(Module, Debug)]
pub struct Srrf {
    /// Skeleton extraction.
    pub sem: Sem,
    /// The branch on the corrupted clouds.
    pub dense: RegistrationBranch,
    /// The branch on the skeletons.
    pub skeleton: RegistrationBranch,
}

/// The layout of a batch for the whole network; the skeleton branch has its own, once there are
/// skeletons.
#[derive(Debug, Clone)]
pub struct SrrfLayout {
    /// Of the skeleton extraction module, on sources and then targets.
    pub sem: SemLayout,
    /// Of the dense branch, likewise.
    pub dense: BranchLayout,
    /// In [0, 1): where along the curve the tokens of the skeleton branch start, if not all are tokens.
    pub phase: f32,
    /// Where matches are to be expected, once a pass has found a pose; training and first passes have none.
    pub prior: Option<PositionPrior>,
}

/// One of the two branches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NetworkBranch {
    /// The branch on the corrupted clouds.
    Dense,
    /// The branch on the skeletons.
    Skeleton,
}

/// Everything that a reader may want to see.
#[derive(Debug, Clone)]
pub struct SrrfOutput {
    /// Skeletons `X^s`.
    pub source_skeleton: SkeletonBatch,
    /// Skeletons `Y^s`.
    pub target_skeleton: SkeletonBatch,
    /// `{R_c, t_c}` and its soft matches.
    pub dense: BranchOutput,
    /// `{R_s, t_s}` and its soft matches.
    pub skeleton: BranchOutput,
    /// `{R, t}`, the inlier ratios and lambda.
    pub fused: Fusion,
}

impl Srrf {
    /// Registers a batch of pairs of centred clouds (see [`crate::PairBatch`]). `phase` in [0, 1)
    /// chooses which points carry tokens; 0.5 at inference.
    ///
    /// # Shapes
    /// - `source`, `target`: `[batch, points, 3]`
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn forward(
        &self,
        integration: &IntegrationRule,
        source: Tensor<3>,
        target: Tensor<3>,
        phase: f32,
    ) -> Result<SrrfOutput, CopyError> {
        self.forward_near(integration, source, target, phase, None)
    }

    /// As [`Srrf::forward`], with a prior on where matches lie: the passes after the first one.
    ///
    /// # Shapes
    /// - `source`, `target`: `[batch, points, 3]`
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn forward_near(
        &self,
        integration: &IntegrationRule,
        source: Tensor<3>,
        target: Tensor<3>,
        phase: f32,
        prior: Option<PositionPrior>,
    ) -> Result<SrrfOutput, CopyError> {
        let layout = stage("layout", || -> Result<_, CopyError> {
            let both = HostClouds::read(&Tensor::cat(vec![source.clone(), target.clone()], 0))?;
            let (sem, dense) = (self.sem.layout(&both), self.dense.layout(&both, phase));
            Ok(SrrfLayout { sem, dense, phase, prior })
        })?;
        let (skeletons, skeleton, dense) = self.branches(source.clone(), target.clone(), &layout)?;
        // (4) Integration: {R, t} = lambda {R_c, t_c} + (1 - lambda) {R_s, t_s}.
        let fused =
            stage("integration", || integration.fuse(dense.pose(), skeleton.pose(), &source, &target))?;
        let (source_skeleton, target_skeleton) = skeletons;
        Ok(SrrfOutput { source_skeleton, target_skeleton, dense, skeleton, fused })
    }

    /// One branch without the other, with a prior on where matches lie in the passes after the first one: what the
    /// integration is to be compared with.
    ///
    /// # Shapes
    /// - `source`, `target`: `[batch, points, 3]`
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn alone(
        &self,
        which: NetworkBranch,
        source: Tensor<3>,
        target: Tensor<3>,
        phase: f32,
        prior: Option<&PositionPrior>,
    ) -> Result<BranchOutput, CopyError> {
        let clouds = Tensor::cat(vec![source, target], 0); // [2 batch, points, 3]
        let (branch, clouds) = match which {
            NetworkBranch::Dense => (&self.dense, clouds),
            NetworkBranch::Skeleton => {
                let layout = self.sem.layout(&HostClouds::read(&clouds)?);
                (&self.skeleton, self.sem.forward_with(clouds, &layout)?.detached_points())
            }
        };
        let layout = branch.layout(&HostClouds::read(&clouds)?, phase);
        branch.forward_with(clouds, &layout, prior)
    }

    /// The stages before the integration, of clouds whose layout is known: the skeletons of source and
    /// target, what the skeleton branch found, and what the dense branch found.
    ///
    /// # Shapes
    /// - `source`, `target`: `[batch, points, 3]`
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn branches(
        &self,
        source: Tensor<3>,
        target: Tensor<3>,
        layout: &SrrfLayout,
    ) -> Result<((SkeletonBatch, SkeletonBatch), BranchOutput, BranchOutput), CopyError> {
        let clouds = Tensor::cat(vec![source, target], 0); // [2 batch, points, 3]
        // (1) Skeletal extraction, Eq. (5) and (6).
        let skeletons =
            timed("sem", &clouds.device(), || self.sem.forward_with(clouds.clone(), &layout.sem))?;
        // The gradient stop between SEM and registration.
        let stopped = skeletons.detached_points();
        let on_skeletons = stage("skeleton layout", || -> Result<_, CopyError> {
            Ok(self.skeleton.layout(&HostClouds::read(&stopped)?, layout.phase))
        })?;
        let (skeleton, dense) = self.poses(stopped, &on_skeletons, clouds, layout)?;
        Ok((skeletons.halves(), skeleton, dense))
    }

    /// The registration, of clouds whose skeletons are known: what the skeleton branch found, and what the dense
    /// branch found.
    ///
    /// # Shapes
    /// - `skeletons`: `[2 batch, skeleton_points, 3]`, `clouds`: `[2 batch, points, 3]`, sources and then targets
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn poses(
        &self,
        skeletons: Tensor<3>,
        on_skeletons: &BranchLayout,
        clouds: Tensor<3>,
        layout: &SrrfLayout,
    ) -> Result<(BranchOutput, BranchOutput), CopyError> {
        // (2, 3) Features, interaction, matching and SVD: {R_s, t_s} and {R_c, t_c}.
        let prior = layout.prior.as_ref();
        let skeleton =
            stage("skeleton branch", || self.skeleton.forward_with(skeletons, on_skeletons, prior))?;
        let dense = stage("dense branch", || self.dense.forward_with(clouds, &layout.dense, prior))?;
        Ok((skeleton, dense))
    }
}
