//! Scores of poses: the scorer of `srrf-eval`.

use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use srrf_eval::{PoseError, Scores, is_right};

use crate::cloud::Cloud;
use crate::pose;
use crate::refusal::{Fault, Refusal};

/// The errors of each pair and the scores over all, as JSON: `{"errors": [...], "scores": {...}}`. A pose that is missing counts
/// as failed.
#[pyfunction]
#[pyo3(signature = (poses, truth, clouds = None))]
pub fn score(
    poses: Vec<Option<PyReadonlyArray2<'_, f64>>>,
    truth: Vec<PyReadonlyArray2<'_, f64>>,
    clouds: Option<Vec<(PyRef<'_, Cloud>, PyRef<'_, Cloud>)>>,
) -> Result<String, Refusal> {
    let mut errors = Vec::with_capacity(truth.len());
    for (index, (found, truth)) in poses.iter().zip(&truth).enumerate() {
        let truth = pose::rigid(truth, &format!("truth[{index}]"))?;
        // A pose that is not finite is a failure of the method, and counted as such.
        let usable = found.as_ref().filter(|found| found.as_array().iter().all(|v| v.is_finite()));
        let found = usable.map(|found| pose::rigid(found, &format!("poses[{index}]"))).transpose()?;
        let mut error = PoseError::new(found.as_ref(), &truth);
        if let Some((source, target)) = clouds.as_ref().and_then(|clouds| clouds.get(index)) {
            error.right =
                Some(found.is_some_and(|pose| is_right(&pose, &truth, &source.points, &target.points)));
        }
        errors.push(error);
    }
    let scores = Scores::from_errors(&errors)
        .map_err(|e| Refusal::new(Fault::Input, format!("{e}; pass at least one pose")))?;
    Ok(serde_json::json!({ "errors": errors, "scores": scores }).to_string())
}
