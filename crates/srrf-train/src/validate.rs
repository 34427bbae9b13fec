//! Validation: the network on the held-out part of the training set, by the scorer of srrf-eval.

use std::collections::BTreeMap;

use srrf_corrupt::Pair;
use srrf_eval::{MetricError, PoseError, Scores};

use crate::seam::{FoundPoses, Trained};
use crate::step::to_batch;
use crate::workers::Workers;

/// Pairs that go through the network together on the CPU.
pub const CHUNK: usize = 4;

/// Results.
#[derive(Debug, Clone)]
pub struct Validation {
    /// Scores of each row of [`Trained::ROWS`].
    pub scores: BTreeMap<&'static str, Scores>,
    /// Means of the network's other quantities, such as those of skeletons.
    pub notes: BTreeMap<&'static str, f64>,
}

/// Why a validation failed.
#[derive(Debug, thiserror::Error)]
pub enum ValidateError {
    /// The scorer refused.
    #[error(transparent)]
    Metric(#[from] MetricError),
    /// The device did not give its numbers.
    #[error(transparent)]
    Copy(#[from] srrf_model::CopyError),
    /// The pairs differ in size, or a worker stopped.
    #[error("the validation pairs could not be run through the network")]
    Failed,
}

/// Scores `model` on `pairs`, `chunk` of them at a time.
///
/// # Errors
/// [`ValidateError`] when nothing can be scored.
pub fn validate<C: Trained>(
    config: &C,
    model: &C::Network,
    pairs: &[Pair],
    chunk: usize,
    device: &burn::tensor::Device,
    workers: &Workers,
) -> Result<Validation, ValidateError> {
    let chunks: Vec<&[Pair]> = pairs.chunks(chunk.max(1)).collect();
    let run = |i: usize| {
        let (pairs, batch) = to_batch(chunks[i], 0.5, device).ok_or(ValidateError::Failed)?;
        let FoundPoses { poses, notes } = config.found(model, batch)?;
        let poses = poses.iter().map(|(rotation, translation)| pairs.poses(rotation, translation));
        Ok::<_, ValidateError>((poses.collect::<Result<Vec<_>, _>>()?, notes))
    };
    let results = workers.map(chunks.len(), run).ok_or(ValidateError::Failed)?;

    let mut errors: Vec<Vec<PoseError>> = vec![Vec::new(); C::ROWS.len()];
    let mut notes = BTreeMap::new();
    for (chunk, result) in chunks.iter().zip(results) {
        let (poses, found_notes) = result?;
        for (errors, poses) in errors.iter_mut().zip(poses) {
            let truths = chunk.iter().map(|pair| &pair.target_from_source);
            errors.extend(poses.iter().zip(truths).map(|(p, truth)| PoseError::new(p.as_ref(), truth)));
        }
        for (name, value) in found_notes {
            *notes.entry(name).or_insert(0.0) += value * chunk.len() as f64 / pairs.len() as f64;
        }
    }
    let mut scores = BTreeMap::new();
    for (name, errors) in C::ROWS.iter().zip(&errors) {
        scores.insert(*name, Scores::from_errors(errors)?);
    }
    Ok(Validation { scores, notes })
}
