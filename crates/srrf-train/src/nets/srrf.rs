//! How the SRRF network is trained.

use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use srrf_model::ops::{CopyError, HostClouds};
use srrf_model::weights::WeightsError;
use srrf_model::{
    BranchLayout, BranchOutput, SemLayout, SkeletonBatch, SkeletonLossConfig, Srrf, SrrfConfig, SrrfLayout,
    TrainingBatch, chamfer, correspondence_loss, defaults, embedded, matching_loss, registration_loss,
    skeleton_loss, spread, transform,
};

use crate::seam::{FoundPoses, LossTerms, Losses, StageOf, Trained};

/// Weights of the losses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SrrfLossConfig {
    /// The skeleton losses.
    pub skeleton: SkeletonLossConfig,
    /// Weight of `L_reg` of each branch; 1 is the paper. The other losses of a trained network are ten to a hundred
    /// times as large.
    #[serde(default = "defaults::one", skip_serializing_if = "defaults::is_one")]
    #[schemars(range(min = 0.0, max = 1e6), extend("default" = 1.0))]
    pub registration: f64,
    /// Weight of the correspondence loss of each branch; 0 is the paper.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub correspondence: f64,
    /// Weight of the matching loss of each branch ([`srrf_model::matching_loss`]); 0 is the paper.
    #[serde(default, skip_serializing_if = "defaults::is_zero")]
    #[schemars(range(min = 0.0, max = 1e6), extend("default" = 0.0))]
    pub matching: f64,
    /// Weight of `L_reg` of the fused pose, beside `registration` for that of each branch. At 0 the integration is left
    /// out of the training step, which saves its inlier test; the branches learn from their own poses.
    #[serde(default = "defaults::one")]
    #[schemars(range(min = 0.0, max = 1e6))]
    pub fused: f64,
}

/// What of the network a stage trains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct SrrfParts {
    /// What happens to the skeleton module.
    #[serde(default = "frozen")]
    pub sem: SemTraining,
    /// Whether the two branches are trained.
    #[serde(default = "yes")]
    pub registration: bool,
}

fn frozen() -> SemTraining {
    SemTraining::Frozen
}

fn yes() -> bool {
    true
}

/// What a stage does to the skeleton module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SemTraining {
    /// It is used as it is.
    Frozen,
    /// Chamfer pre-training.
    Chamfer,
    /// The skeleton losses.
    Skeleton,
}

impl Trained for SrrfConfig {
    type LossConfig = SrrfLossConfig;
    type Parts = SrrfParts;
    type Layout = Layout;
    const METHOD: &'static str = "srrf";
    const ROWS: &'static [&'static str] = &["dense", "skeleton", "fused"];
    const CURVES: &'static [&'static str] =
        &["sem", "chamfer", "dense_correspondence", "skeleton_correspondence"];

    fn start(start: &str, device: &Device) -> Result<Srrf, WeightsError> {
        Ok(embedded::open(start, device)?.model)
    }

    fn wrong_parts(parts: &SrrfParts) -> Option<(&'static str, &'static str)> {
        (parts.sem == SemTraining::Frozen && !parts.registration)
            .then_some(("registration", "must be true where sem is frozen, or the stage trains nothing"))
    }

    fn trains_poses(parts: &SrrfParts) -> bool {
        parts.registration
    }

    fn layout(&self, parts: &SrrfParts, clouds: &HostClouds, phase: f32) -> Layout {
        match parts.registration {
            true => Layout::Whole(Box::new(SrrfConfig::layout(self, clouds, phase))),
            false => Layout::Skeletons(self.sem.layout(clouds)),
        }
    }

    fn prefetched(
        &self,
        stages: &[StageOf<Self>],
        network: &Srrf,
        batch: &TrainingBatch,
        layout: Layout,
    ) -> Result<Layout, CopyError> {
        let Layout::Whole(mut layout) = layout else { return Ok(layout) };
        let device = batch.source.device();
        layout.dense.send(&device);
        if stages.iter().any(|stage| stage.trains.sem != SemTraining::Frozen) {
            return Ok(Layout::Whole(layout));
        }
        let skeletons = network.sem.forward_with(batch.clouds(), &layout.sem)?.detached_points();
        let mut on_skeletons = network.skeleton.layout(&HostClouds::read(&skeletons)?, layout.phase);
        on_skeletons.send(&device);
        Ok(Layout::Registration(Box::new(FrozenSkeletons { layout, skeletons, on_skeletons })))
    }

    fn gradient(
        &self,
        losses: &SrrfLossConfig,
        parts: &SrrfParts,
        network: &Srrf,
        batch: TrainingBatch,
        layout: Layout,
    ) -> Result<(GradientsParams, Losses), CopyError> {
        // Only what the stage trains is on the graph.
        let trains_sem = parts.sem != SemTraining::Frozen;
        let mut fork = network.clone();
        fork.sem = if trains_sem { fork.sem.train() } else { fork.sem.valid() };
        fork.dense = if parts.registration { fork.dense.train() } else { fork.dense.valid() };
        fork.skeleton = if parts.registration { fork.skeleton.train() } else { fork.skeleton.valid() };

        let (skeletons, branches) = match layout {
            Layout::Whole(layout) => {
                let (source, target) = (batch.source.clone(), batch.target.clone());
                let (skeletons, skeleton, dense) = fork.branches(source, target, &layout)?;
                (Some(skeletons), Some((skeleton, dense)))
            }
            Layout::Registration(known) => {
                let FrozenSkeletons { layout, skeletons, on_skeletons } = *known;
                (None, Some(fork.poses(skeletons, &on_skeletons, batch.clouds(), &layout)?))
            }
            Layout::Skeletons(layout) => {
                (Some(fork.sem.forward_with(batch.clouds(), &layout)?.halves()), None)
            }
        };
        let TrainingBatch { source, target, rotation, translation, .. } = batch;
        let mut terms = LossTerms::default();
        if let Some((skeleton, dense)) = branches {
            for (names, branch) in [(DENSE, &dense), (SKELETON, &skeleton)] {
                branch_terms(&mut terms, names, branch, losses, &rotation, &translation);
            }
            if losses.fused > 0.0 {
                let fused = self.integration.fuse(dense.pose(), skeleton.pose(), &source, &target)?;
                let (r, t) = (rotation.clone(), translation.clone());
                terms.add("fused", registration_loss(fused.rotation, fused.translation, r, t), losses.fused);
            }
        }
        if let Some((source_skeleton, target_skeleton)) = skeletons.filter(|_| trains_sem) {
            let (x, y) = ((source, &source_skeleton), (target, &target_skeleton));
            skeleton_terms(&mut terms, parts.sem, losses, x, y, rotation, translation)?;
        }
        terms.finish(&fork)
    }

    fn found(&self, network: &Srrf, batch: TrainingBatch) -> Result<FoundPoses, CopyError> {
        let TrainingBatch { source, target, rotation, translation, phase } = batch;
        let output = network.forward(&self.integration, source, target, phase)?;
        let poses = vec![
            (output.dense.rotation, output.dense.translation),
            (output.skeleton.rotation, output.skeleton.translation),
            (output.fused.rotation, output.fused.translation),
        ];
        let posed = transform(output.source_skeleton.points, rotation, translation);
        let target = output.target_skeleton.points;
        // Mean Chamfer distance (unsquared, both ways) between the posed source skeleton and the target
        // skeleton, and the root mean square distance of skeleton points from their mean.
        let notes = vec![
            ("skeleton_chamfer", chamfer(posed, target.clone())?.into_scalar::<f64>()),
            ("skeleton_spread", spread(target).into_scalar::<f64>()),
        ];
        Ok(FoundPoses { poses, notes })
    }
}

/// What a stage has to know of the clouds.
#[derive(Debug)]
pub enum Layout {
    /// Stages that train the registration.
    Whole(Box<SrrfLayout>),
    /// Stages that train the registration alone, where the frozen skeletons were found ahead.
    Registration(Box<FrozenSkeletons>),
    /// Stages that train the skeleton module alone.
    Skeletons(SemLayout),
}

/// Skeletons that no stage changes.
#[derive(Debug)]
pub struct FrozenSkeletons {
    /// Of the clouds.
    layout: Box<SrrfLayout>,
    /// `[2 batch, skeleton_points, 3]`.
    skeletons: Tensor<3>,
    /// Of the skeletons.
    on_skeletons: BranchLayout,
}

const DENSE: [&str; 3] = ["dense", "dense_correspondence", "dense_matching"];
const SKELETON: [&str; 3] = ["skeleton", "skeleton_correspondence", "skeleton_matching"];

/// `L_reg` of a branch, its correspondence loss and its matching loss.
fn branch_terms(
    terms: &mut LossTerms,
    [name, correspondence, matching]: [&'static str; 3],
    branch: &BranchOutput,
    losses: &SrrfLossConfig,
    rotation: &Tensor<3>,
    translation: &Tensor<2>,
) {
    let (r, t) = (branch.rotation.clone(), branch.translation.clone());
    terms.add(name, registration_loss(r, t, rotation.clone(), translation.clone()), losses.registration);
    let (points, matches) = (branch.source_points.clone(), branch.matches.clone());
    terms.add(
        correspondence,
        correspondence_loss(points.clone(), matches, rotation.clone(), translation.clone()),
        losses.correspondence,
    );
    if losses.matching > 0.0 {
        let (probabilities, matched) = (branch.probabilities.clone(), branch.matched.clone());
        let (targets, r, t) = (branch.target_points.clone(), rotation.clone(), translation.clone());
        terms.add(matching, matching_loss(probabilities, matched, points, targets, r, t), losses.matching);
    }
}

/// The losses of the skeleton module.
fn skeleton_terms(
    terms: &mut LossTerms,
    training: SemTraining,
    losses: &SrrfLossConfig,
    (source, source_skeleton): (Tensor<3>, &SkeletonBatch),
    (target, target_skeleton): (Tensor<3>, &SkeletonBatch),
    rotation: Tensor<3>,
    translation: Tensor<2>,
) -> Result<(), CopyError> {
    terms.add("spread", spread(target_skeleton.points.clone().detach()), 0.0);
    if training == SemTraining::Chamfer {
        let points = Tensor::cat(vec![source_skeleton.points.clone(), target_skeleton.points.clone()], 0);
        terms.add("chamfer", chamfer(points, Tensor::cat(vec![source, target], 0))?, 1.0);
        return Ok(());
    }
    let (x, y) = ((source, source_skeleton), (target, target_skeleton));
    let loss = skeleton_loss(&losses.skeleton, x, y, rotation, translation)?;
    terms.add("sampling", loss.sampling, 0.0);
    terms.add("point_to_sphere", loss.point_to_sphere, 0.0);
    terms.add("radius", loss.radius, 0.0);
    terms.add("distribution", loss.distribution, 0.0);
    terms.add("distribution_over_spread", loss.distribution_over_spread, 0.0);
    terms.add("index_match", loss.index_match, 0.0);
    terms.add("sem", loss.total, 1.0);
    Ok(())
}
