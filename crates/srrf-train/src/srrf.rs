//! How the SRRF network is trained.

use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor};
use srrf_cloud::Rigid;
use srrf_model::ops::{CopyError, HostClouds};
use srrf_model::weights::WeightsError;
use srrf_model::{
    BranchLayout, BranchOutput, SemLayout, Skeleton, Srrf, SrrfConfig, SrrfLayout, chamfer,
    correspondence_loss, embedded, matching_loss, registration_loss, skeleton_loss, spread, transform,
};

use crate::config::{LossConfig, SemTraining, StageConfig};
use crate::network::{Found, Shard, Terms, Trained};
use crate::step::Losses;

impl Trained for SrrfConfig {
    type LossConfig = LossConfig;
    const METHOD: &'static str = "srrf";
    const ROWS: &'static [&'static str] = &["dense", "skeleton", "fused"];
    const CURVES: &'static [&'static str] =
        &["sem", "chamfer", "dense_correspondence", "skeleton_correspondence"];

    fn start(start: &str, device: &Device) -> Result<Srrf, WeightsError> {
        Ok(embedded::open(start, device)?.model)
    }

    fn wrong_stage(stage: &StageConfig) -> Option<(&'static str, &'static str)> {
        (stage.sem == SemTraining::Frozen && !stage.registration)
            .then_some(("registration", "must be true where sem is frozen, or the stage trains nothing"))
    }

    type Layout = Layout;

    fn layout(&self, stage: &StageConfig, clouds: &HostClouds, phase: f32) -> Layout {
        match stage.registration {
            true => Layout::Whole(Box::new(SrrfConfig::layout(self, clouds, phase))),
            false => Layout::Skeletons(self.sem.layout(clouds)),
        }
    }

    fn ahead(
        &self,
        stages: &[StageConfig],
        network: &Srrf,
        shard: &Shard,
        layout: Layout,
    ) -> Result<Layout, CopyError> {
        let Layout::Whole(mut layout) = layout else { return Ok(layout) };
        let device = shard.batch.source.device();
        layout.dense.send(&device);
        if stages.iter().any(|stage| stage.sem != SemTraining::Frozen) {
            return Ok(Layout::Whole(layout));
        }
        let skeletons = network.sem.forward_with(shard.clouds(), &layout.sem)?.detached_points();
        let mut on_skeletons = network.skeleton.layout(&HostClouds::read(&skeletons)?, layout.phase);
        on_skeletons.send(&device);
        Ok(Layout::Registration(Box::new(FrozenSkeletons { layout, skeletons, on_skeletons })))
    }

    fn gradient(
        &self,
        losses: &LossConfig,
        stage: &StageConfig,
        network: &Srrf,
        shard: Shard,
        layout: Layout,
    ) -> Result<(GradientsParams, Losses), CopyError> {
        // Only what the stage trains is on the graph.
        let trains_sem = stage.sem != SemTraining::Frozen;
        let mut fork = network.clone();
        fork.sem = if trains_sem { fork.sem.train() } else { fork.sem.valid() };
        fork.dense = if stage.registration { fork.dense.train() } else { fork.dense.valid() };
        fork.skeleton = if stage.registration { fork.skeleton.train() } else { fork.skeleton.valid() };

        let (skeletons, branches) = match layout {
            Layout::Whole(layout) => {
                let (source, target) = (shard.batch.source.clone(), shard.batch.target.clone());
                let (skeletons, skeleton, dense) = fork.branches(source, target, &layout)?;
                (Some(skeletons), Some((skeleton, dense)))
            }
            Layout::Registration(known) => {
                let FrozenSkeletons { layout, skeletons, on_skeletons } = *known;
                (None, Some(fork.poses(skeletons, &on_skeletons, shard.clouds(), &layout)?))
            }
            Layout::Skeletons(layout) => {
                (Some(fork.sem.forward_with(shard.clouds(), &layout)?.halves()), None)
            }
        };
        let Shard { batch, rotation, translation, .. } = shard;
        let (source, target) = (batch.source, batch.target);
        let mut terms = Terms::default();
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
            skeleton_terms(&mut terms, stage.sem, losses, x, y, rotation, translation)?;
        }
        terms.finish(&fork)
    }

    fn found(&self, network: &Srrf, shard: Shard) -> Result<Found, CopyError> {
        let Shard { batch, rotation, translation, phase } = shard;
        let output = network.forward(&self.integration, batch.source.clone(), batch.target.clone(), phase)?;
        let poses: Vec<Vec<Option<Rigid>>> = vec![
            batch.poses(&output.dense.rotation, &output.dense.translation)?,
            batch.poses(&output.skeleton.rotation, &output.skeleton.translation)?,
            batch.poses(&output.fused.rotation, &output.fused.translation)?,
        ];
        let posed = transform(output.source_skeleton.points, rotation, translation);
        let target = output.target_skeleton.points;
        // Mean Chamfer distance (unsquared, both ways) between the posed source skeleton and the target
        // skeleton, and the root mean square distance of skeleton points from their mean.
        let notes = vec![
            ("skeleton_chamfer", chamfer(posed, target.clone())?.into_scalar::<f64>()),
            ("skeleton_spread", spread(target).into_scalar::<f64>()),
        ];
        Ok(Found { poses, notes })
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
    terms: &mut Terms,
    [name, correspondence, matching]: [&'static str; 3],
    branch: &BranchOutput,
    losses: &LossConfig,
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
    terms: &mut Terms,
    training: SemTraining,
    losses: &LossConfig,
    (source, source_skeleton): (Tensor<3>, &Skeleton),
    (target, target_skeleton): (Tensor<3>, &Skeleton),
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
