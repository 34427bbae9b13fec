//! Validation: the network on the held-out part of the training set, by the scorer of srrf-eval.

use std::collections::BTreeMap;

use srrf_cloud::Rigid;
use srrf_corrupt::Pair;
use srrf_eval::{MetricError, PairError, Scores};
use srrf_model::{IntegrationConfig, Srrf, chamfer, spread, transform};

use crate::step::{Workers, to_batch};

/// Pairs that go through the network together.
const CHUNK: usize = 4;

/// Results by row: `dense`, `skeleton`, `fused`.
#[derive(Debug, Clone)]
pub struct Validation {
    /// Scores of each pose.
    pub scores: BTreeMap<&'static str, Scores>,
    /// Mean Chamfer distance (unsquared, both ways) between the posed source skeleton and the
    /// target skeleton.
    pub skeleton_chamfer: f64,
    /// Root mean square distance of skeleton points from their mean.
    pub skeleton_spread: f64,
}

/// Why a validation failed.
#[derive(Debug, thiserror::Error)]
pub enum ValidateError {
    /// The scorer refused.
    #[error(transparent)]
    Metric(#[from] MetricError),
    /// The pairs differ in size, or a worker stopped.
    #[error("the validation pairs could not be run through the network")]
    Failed,
}

/// Scores `model` on `pairs`.
///
/// # Errors
/// [`ValidateError`] when nothing can be scored.
pub fn validate(
    model: &Srrf,
    integration: &IntegrationConfig,
    pairs: &[Pair],
    device: &burn::tensor::Device,
    workers: &Workers,
) -> Result<Validation, ValidateError> {
    let chunks: Vec<&[Pair]> = pairs.chunks(CHUNK).collect();
    let run = |i: usize| {
        let (batch, rotation, translation) = to_batch(chunks[i], device)?;
        let output = model.forward(integration, batch.source.clone(), batch.target.clone(), 0.5);
        let poses: [Vec<Option<Rigid>>; 3] = [
            batch.poses(&output.dense.rotation, &output.dense.translation),
            batch.poses(&output.skeleton.rotation, &output.skeleton.translation),
            batch.poses(&output.fused.rotation, &output.fused.translation),
        ];
        let posed = transform(output.source_skeleton.points, rotation, translation);
        let target = output.target_skeleton.points;
        let skeletons =
            (chamfer(posed, target.clone()).into_scalar::<f64>(), spread(target).into_scalar::<f64>());
        Some((poses, skeletons))
    };
    let results = workers.map(chunks.len(), run).ok_or(ValidateError::Failed)?;

    let mut errors: [Vec<PairError>; 3] = Default::default();
    let (mut skeleton_chamfer, mut skeleton_spread) = (0.0, 0.0);
    for (chunk, result) in chunks.iter().zip(results) {
        let (poses, (distance, spread)) = result.ok_or(ValidateError::Failed)?;
        for (errors, poses) in errors.iter_mut().zip(poses) {
            let truths = chunk.iter().map(|pair| &pair.target_from_source);
            errors.extend(poses.iter().zip(truths).map(|(p, truth)| PairError::new(p.as_ref(), truth)));
        }
        skeleton_chamfer += distance * chunk.len() as f64 / pairs.len() as f64;
        skeleton_spread += spread * chunk.len() as f64 / pairs.len() as f64;
    }
    let mut scores = BTreeMap::new();
    for (name, errors) in ["dense", "skeleton", "fused"].into_iter().zip(&errors) {
        scores.insert(name, Scores::from_errors(errors)?);
    }
    Ok(Validation { scores, skeleton_chamfer, skeleton_spread })
}
