//! Rigid motions as arrays of shape `(4, 4)`.

use nalgebra::{Matrix3, Vector3};
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use srrf_cloud::Rigid;

use crate::refusal::{Fault, Refusal};

/// How far `R^T R` may be from the identity: what rows of four decimals come to.
const TOLERANCE: f64 = 1e-3;
/// Rotations that are this exact stay as they are.
const EXACT: f64 = 1e-9;

/// The motion in a matrix of 4 rows of 4.
///
/// # Errors
/// [`Fault::Input`], which says what is wrong with it.
pub fn rigid(matrix: &PyReadonlyArray2<'_, f64>, name: &str) -> Result<Rigid, Refusal> {
    let m = matrix.as_array();
    let refuse = |problem: String| Refusal::new(Fault::Input, format!("{name}: {problem}"));
    if m.shape() != [4, 4] {
        return Err(refuse(format!("shape {:?}; a pose has shape (4, 4), target_from_source", m.shape())));
    }
    if m.iter().any(|v| !v.is_finite()) {
        return Err(refuse("it holds NaN or infinity".into()));
    }
    if (0..4).any(|c| (m[[3, c]] - [0.0, 0.0, 0.0, 1.0][c]).abs() > 1e-9) {
        return Err(refuse("the last row of a pose is 0 0 0 1; is it transposed?".into()));
    }
    let matrix = Matrix3::from_fn(|r, c| m[[r, c]]);
    let off = (matrix.transpose() * matrix - Matrix3::identity()).abs().max();
    if off > TOLERANCE {
        return Err(refuse(format!(
            "not a rigid motion: R^T R is off the identity by {off:.2e}; take scale and shear out"
        )));
    }
    if matrix.determinant() < 0.0 {
        return Err(refuse("a mirror image, not a rotation (the determinant is -1)".into()));
    }
    let nearest = if off < EXACT { Some(matrix) } else { Rigid::nearest_rotation(&matrix) };
    let rotation = nearest.ok_or_else(|| refuse("the rotation is not finite".into()))?;
    Ok(Rigid { rotation, translation: Vector3::from_fn(|r, _| m[[r, 3]]) })
}

/// As an array of shape `(4, 4)`.
pub fn matrix<'py>(py: Python<'py>, pose: &Rigid) -> PyResult<Bound<'py, PyArray2<f64>>> {
    // nalgebra stores columns.
    pose.to_matrix4().transpose().as_slice().to_pyarray(py).reshape([4, 4])
}

/// Checks a matrix, and brings a rounded rotation back to one.
///
/// # Errors
/// `InputError`.
#[pyfunction]
pub fn rigid_motion<'py>(
    py: Python<'py>,
    pose: &Bound<'py, PyAny>,
    name: &str,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    matrix(py, &rigid(&pose.extract::<PyReadonlyArray2<'_, f64>>()?, name)?)
}
