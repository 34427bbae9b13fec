//! [`SrrfRegister`]: the network behind the [`Register`] seam.

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use srrf_cloud::{
    Branch, BranchKind, PairFrame, PointCloud, Register, RegisterError, Registration, Rigid, Skeleton,
    Skeletons, SoftMatch, Solid,
};

use crate::batch::PairBatch;
use crate::branch::BranchOutput;
use crate::inference::InferenceConfig;
use crate::integration::IntegrationRule;
use crate::ops::{CopyError, even_subsample, to_host};
use crate::prior::PositionPrior;
use crate::sem::SkeletonBatch;
use crate::srrf::{NetworkBranch, Srrf};
use crate::weights::LoadedModel;

/// Which points carry tokens at inference: the middle of each step along the curve.
const PHASE: f32 = 0.5;

/// The network as a registration method.
#[derive(Debug)]
pub struct SrrfRegister {
    model: Srrf,
    /// The same network, as the last pass uses it.
    last: Srrf,
    integration: IntegrationRule,
    /// Standard deviation of the prior on where matches lie, in the passes after the first one.
    prior: Option<f64>,
    /// The only branch that runs; both and their integration if none.
    alone: Option<NetworkBranch>,
    device: Device,
    /// Largest number of points that the network sees of a cloud; larger clouds are subsampled
    /// evenly. It was trained with 1,024.
    pub max_points: usize,
    /// How often the network is applied, as [`InferenceConfig::passes`].
    pub passes: usize,
}

impl SrrfRegister {
    /// The network of a weights file; `device` must be the one it was loaded on.
    pub fn new(loaded: LoadedModel, device: Device) -> Self {
        let InferenceConfig { passes, last_tokens, last_matches, prior } = loaded.config.inference;
        let (model, integration) = (loaded.model.valid(), loaded.config.integration);
        let mut last = model.clone();
        last.dense = last.dense.with_matches(last_matches);
        if let Some(tokens) = last_tokens {
            last.dense = last.dense.with_tokens(tokens);
        }
        Self { model, last, integration, prior, alone: None, device, max_points: 1024, passes }
    }

    /// A network for a quick look: one pass, with at most `tokens` tokens in the dense branch.
    pub fn glance(mut loaded: LoadedModel, device: Device, tokens: usize) -> Self {
        if loaded.config.dense.tokens == 0 || loaded.config.dense.tokens > tokens {
            loaded.model.dense = loaded.model.dense.with_tokens(tokens);
        }
        loaded.config.inference = InferenceConfig::paper();
        Self::new(loaded, device)
    }

    /// One branch in all passes, without the other and without the integration: what the fused pose is to be
    /// compared with. Its name is `srrf-dense-alone` or `srrf-skeleton-alone`. (The branches of a [`Registration`] of the
    /// whole network are no such thing: in all passes but the first they start from the fused pose.)
    pub fn alone(self, branch: NetworkBranch) -> Self {
        Self { alone: Some(branch), ..self }
    }

    /// One pass over pairs that all have `points` points a cloud; `placed` says whether a pass before it placed the
    /// sources.
    fn pass(
        &self,
        model: &Srrf,
        pairs: &[(&PointCloud, &PointCloud)],
        placed: bool,
    ) -> Result<Vec<Option<Registration>>, CopyError> {
        let Some(batch) = PairBatch::new(pairs, &self.device) else { return Ok(vec![None; pairs.len()]) };
        let prior = self.prior.filter(|_| placed).map(|prior| PositionPrior::new(prior, &batch.frames));
        let (source, target) = (batch.source.clone(), batch.target.clone());
        if let Some(branch) = self.alone {
            let found = model.alone(branch, source, target, PHASE, prior.as_ref())?;
            let poses = batch.poses(&found.rotation, &found.translation)?.into_iter();
            let answers = poses
                .zip(soft_matches(&found, &batch.frames)?)
                .map(|(pose, matches)| Some(Registration { matches, ..Registration::from_pose(pose?) }));
            return Ok(answers.collect());
        }
        let output = model.forward_near(&self.integration, source, target, PHASE, prior)?;
        let fused = batch.poses(&output.fused.rotation, &output.fused.translation)?;
        let dense = batch.poses(&output.dense.rotation, &output.dense.translation)?;
        let skeleton = batch.poses(&output.skeleton.rotation, &output.skeleton.translation)?;
        let source_skeletons = skeletons(&output.source_skeleton, &batch.frames, PairFrame::undo_source)?;
        let target_skeletons = skeletons(&output.target_skeleton, &batch.frames, PairFrame::undo_target)?;
        let matches = soft_matches(&output.dense, &batch.frames)?;
        let found = source_skeletons.into_iter().zip(target_skeletons).zip(matches);
        let answers = found
            .enumerate()
            .map(|(i, ((source, target), matches))| {
                let branch = |kind, pose: &[Option<Rigid>], ratio: &[f64]| {
                    Some(Branch { kind, target_from_source: pose[i]?, inlier_ratio: ratio[i] })
                };
                let branches = vec![
                    branch(BranchKind::Dense, &dense, &output.fused.dense_inlier_ratio)?,
                    branch(BranchKind::Skeleton, &skeleton, &output.fused.skeleton_inlier_ratio)?,
                ];
                Some(Registration {
                    branches,
                    skeletons: Some(Skeletons { source, target }),
                    matches,
                    lambda: Some(output.fused.lambda[i]),
                    ..Registration::from_pose(fused[i]?)
                })
            })
            .collect();
        Ok(answers)
    }
}

impl Register for SrrfRegister {
    fn name(&self) -> &str {
        match self.alone {
            None => "srrf",
            Some(NetworkBranch::Dense) => "srrf-dense-alone",
            Some(NetworkBranch::Skeleton) => "srrf-skeleton-alone",
        }
    }

    fn register_solid(&self, source: Solid<'_>, target: Solid<'_>) -> Result<Registration, RegisterError> {
        let points = source.len().min(target.len()).min(self.max_points);
        let (source, target) = (subsample(&source, points)?, subsample(&target, points)?);
        let mut found: Option<Registration> = None;
        let passes = self.passes.max(1);
        for pass in 1..=passes {
            let model = if pass == passes { &self.last } else { &self.model };
            let start = found.as_ref().map_or_else(Rigid::identity, |r| r.target_from_source);
            let moved = source.transformed(&start);
            let answer = self.pass(model, &[(&moved, &target)], found.is_some())?.pop().flatten();
            let answer = answer.ok_or_else(|| {
                RegisterError::NoPose(
                    "the network's output is not finite; are the coordinates extreme?".into(),
                )
            })?;
            let mut answer = answer.after(&start);
            answer.iterations = found.as_ref().map_or(1, |r| r.iterations + 1);
            found = Some(answer);
        }
        found.ok_or_else(|| RegisterError::NoPose("no pass was made".into()))
    }
}

/// The skeletons of a batch in the coordinates of their clouds.
fn skeletons(
    found: &SkeletonBatch,
    frames: &[PairFrame],
    undo: fn(&PairFrame, &[f64; 3]) -> [f64; 3],
) -> Result<Vec<Skeleton>, CopyError> {
    let [_, s, _] = found.points.dims();
    let radii: Vec<f64> = to_host(&found.radii)?;
    let clouds = cloud_points(&found.points)?.into_iter().zip(radii.chunks(s.max(1)));
    let back = |(frame, (points, radii)): (&PairFrame, (Vec<[f64; 3]>, &[f64]))| Skeleton {
        points: points.iter().map(|p| undo(frame, p)).collect(),
        radii: radii.iter().map(|r| frame.undo_length(*r)).collect(),
    };
    Ok(frames.iter().zip(clouds).map(back).collect())
}

/// The soft matches `(x_i, yhat_i)` of a batch; the weight is the greatest probability in `m(x_i, Y)`, which is
/// 1 where `yhat_i` is one target point.
fn soft_matches(branch: &BranchOutput, frames: &[PairFrame]) -> Result<Vec<Vec<SoftMatch>>, CopyError> {
    let [_, n, _] = branch.matches.dims();
    let weights: Vec<f64> = to_host(&branch.probabilities.clone().max_dim(2))?;
    let (sources, targets) = (cloud_points(&branch.source_points)?, cloud_points(&branch.matches)?);
    let pairs = sources.iter().zip(&targets).zip(weights.chunks(n.max(1)));
    let of_pair = |(frame, ((source, target), weights)): (&PairFrame, ((&Vec<_>, &Vec<_>), &[f64]))| {
        let one = |((x, y), weight): ((&[f64; 3], &[f64; 3]), &f64)| SoftMatch {
            source: frame.undo_source(x),
            target: frame.undo_target(y),
            weight: *weight,
        };
        source.iter().zip(target).zip(weights).map(one).collect()
    };
    Ok(frames.iter().zip(pairs).map(of_pair).collect())
}

/// Points of each cloud of a batch, `[batch, points, 3]`, in `f64`.
fn cloud_points(points: &Tensor<3>) -> Result<Vec<Vec<[f64; 3]>>, CopyError> {
    let [_, n, _] = points.dims();
    let flat: Vec<f64> = to_host(points)?;
    let points: Vec<[f64; 3]> = flat.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    Ok(points.chunks(n.max(1)).map(<[_]>::to_vec).collect())
}

/// `points` points of the cloud, evenly along a space-filling curve.
///
/// # Errors
/// [`RegisterError::Source`] if `points` are too few for a cloud.
pub fn subsample(cloud: &PointCloud, points: usize) -> Result<PointCloud, RegisterError> {
    if cloud.len() <= points {
        return Ok(cloud.clone());
    }
    // The curve is laid through unit-sphere coordinates, so that f32 keeps its digits far from 0.
    let (unit, _) = cloud.to_unit_sphere();
    let unit: Vec<[f32; 3]> = unit.points().iter().map(|p| p.map(|v| v as f32)).collect();
    let chosen = even_subsample(&unit, points, PHASE);
    PointCloud::new(chosen.into_iter().map(|i| cloud.points()[i as usize]).collect())
        .map_err(RegisterError::Source)
}
