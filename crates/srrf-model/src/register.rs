//! [`SrrfRegister`]: the network behind the [`Register`] seam.

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use srrf_cloud::{Branch, PointCloud, Register, RegisterError, Registration, Rigid, Skeletons};

use crate::batch::PairBatch;
use crate::geometry::even_subsample;
use crate::integration::IntegrationConfig;
use crate::srrf::Srrf;
use crate::weights::LoadedModel;

/// Which points carry tokens at inference: the middle of each step along the curve.
const PHASE: f32 = 0.5;

/// The network as a registration method.
#[derive(Debug)]
pub struct SrrfRegister {
    model: Srrf,
    integration: IntegrationConfig,
    device: Device,
    /// Largest number of points that the network sees of a cloud; larger clouds are subsampled
    /// evenly. It was trained with 1,024.
    pub max_points: usize,
    /// How often the network is applied, each time to the source as the last pose left it.
    /// Default: 2, which on the validation part takes a tenth off RMSE(R) and a quarter off MAE(R)
    /// (docs/experiments.md); 1 is the paper.
    pub passes: usize,
}

impl SrrfRegister {
    /// The network of a weights file; `device` must be the one it was loaded on.
    pub fn new(loaded: LoadedModel, device: Device) -> Self {
        Self {
            model: loaded.model.valid(),
            integration: loaded.config.integration,
            device,
            max_points: 1024,
            passes: 2,
        }
    }

    /// One pass over pairs that all have `points` points a cloud.
    fn pass(&self, pairs: &[(&PointCloud, &PointCloud)]) -> Vec<Option<Registration>> {
        let Some(batch) = PairBatch::new(pairs, &self.device) else { return vec![None; pairs.len()] };
        let output = self.model.forward(&self.integration, batch.source.clone(), batch.target.clone(), PHASE);
        let fused = batch.poses(&output.fused.rotation, &output.fused.translation);
        let dense = batch.poses(&output.dense.rotation, &output.dense.translation);
        let skeleton = batch.poses(&output.skeleton.rotation, &output.skeleton.translation);
        let source_skeletons = cloud_points(&output.source_skeleton.points);
        let target_skeletons = cloud_points(&output.target_skeleton.points);
        (0..pairs.len())
            .map(|i| {
                let branch = |name, pose: &[Option<Rigid>], ratio: &[f64]| {
                    Some(Branch { name, target_from_source: pose[i]?, inlier_ratio: ratio[i] })
                };
                let branches = vec![
                    branch("dense", &dense, &output.fused.dense_inlier_ratio)?,
                    branch("skeleton", &skeleton, &output.fused.skeleton_inlier_ratio)?,
                ];
                let frame = &batch.frames[i];
                let skeletons = Skeletons {
                    source: source_skeletons[i].iter().map(|p| frame.undo_source(p)).collect(),
                    target: target_skeletons[i].iter().map(|p| frame.undo_target(p)).collect(),
                };
                Some(Registration {
                    branches,
                    skeletons: Some(skeletons),
                    ..Registration::from_pose(fused[i]?)
                })
            })
            .collect()
    }
}

impl Register for SrrfRegister {
    fn name(&self) -> &str {
        "srrf"
    }

    fn register(&self, source: &PointCloud, target: &PointCloud) -> Result<Registration, RegisterError> {
        let mut answers = self.register_batch(&[(source, target)]);
        answers.pop().unwrap_or_else(|| Err(RegisterError::NoPose("the batch was empty".into())))
    }

    fn register_batch(
        &self,
        pairs: &[(&PointCloud, &PointCloud)],
    ) -> Vec<Result<Registration, RegisterError>> {
        pairs.iter().map(|pair| self.register_one(pair.0, pair.1)).collect()
    }
}

impl SrrfRegister {
    fn register_one(&self, source: &PointCloud, target: &PointCloud) -> Result<Registration, RegisterError> {
        source.check_rotation_observable().map_err(RegisterError::Source)?;
        target.check_rotation_observable().map_err(RegisterError::Target)?;
        let points = source.len().min(target.len()).min(self.max_points);
        let (source, target) = (subsample(source, points)?, subsample(target, points)?);
        let mut found: Option<Registration> = None;
        for _ in 0..self.passes.max(1) {
            let start = found.as_ref().map_or_else(Rigid::identity, |r| r.target_from_source);
            let moved = source.transformed(&start);
            let answer = self.pass(&[(&moved, &target)]).pop().flatten();
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

/// Points of each cloud of a batch, `[batch, points, 3]`, in `f64`.
fn cloud_points(points: &Tensor<3>) -> Vec<Vec<[f64; 3]>> {
    let [_, n, _] = points.dims();
    let flat = points.try_to_vec_as::<f64>().unwrap_or_default();
    let points: Vec<[f64; 3]> = flat.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    points.chunks(n.max(1)).map(<[_]>::to_vec).collect()
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
