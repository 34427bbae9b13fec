//! One corruption of one cloud, as `srrf corrupt` does it.

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use rand::{SeedableRng, rngs::ChaCha8Rng};
use srrf_corrupt::{CorruptionKind, Severity, UnknownCorruption, Variants};

use crate::cloud::{Cloud, checked, origins, to_array};
use crate::refusal::{Fault, Refusal};
use crate::{surface, work};

/// The names of the corruptions, in the paper's order.
pub fn names() -> Vec<&'static str> {
    CorruptionKind::ALL.map(CorruptionKind::name).to_vec()
}

/// A corruption by its name.
///
/// # Errors
/// [`Fault::Option`] names those that there are.
pub fn kind(name: &str) -> Result<CorruptionKind, Refusal> {
    name.parse().map_err(|e: UnknownCorruption| Refusal::new(Fault::Option, e.to_string()))
}

/// A severity by its number.
///
/// # Errors
/// [`Fault::Option`].
pub fn severity(number: i64) -> Result<Severity, Refusal> {
    let severity = u8::try_from(number).ok().and_then(|n| Severity::try_from(n).ok());
    severity.ok_or_else(|| {
        Refusal::new(
            Fault::Option,
            format!("severity {number} does not exist: severities are 1, 2, 3, 4 and 5"),
        )
    })
}

/// The numbers of a reading.
///
/// # Errors
/// [`Fault::Option`].
pub fn variants(reading: &str) -> Result<Variants, Refusal> {
    match reading {
        "paper" => Ok(Variants::paper()),
        "modelnet40_c" => Ok(Variants::modelnet40_c()),
        _ => Err(Refusal::new(Fault::Option, format!("reading `{reading}`: use paper or modelnet40_c"))),
    }
}

/// The corrupted points and where each comes from.
type CorruptedArrays<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<i64>>);

/// Corrupts a cloud: brought to the unit sphere, corrupted there, mapped back. Of a mesh, its vertices or its surface.
#[pyfunction(name = "corrupt")]
pub fn corrupt<'py>(
    py: Python<'py>,
    cloud: &Cloud,
    name: &str,
    number: i64,
    seed: u64,
    reading: &str,
    vertices: bool,
) -> PyResult<CorruptedArrays<'py>> {
    let (kind, severity, variants) = (kind(name)?, severity(number)?, variants(reading)?);
    let cloud = cloud.clone();
    let (points, origin) = work::run(py, 1, move |_| {
        let cloud = surface::alone(&cloud, vertices, seed)?;
        let (unit, frame) = cloud.points.to_unit_sphere();
        let corruption = srrf_corrupt::corruption(kind, &variants);
        let corrupted = corruption.apply(unit.points(), severity, &mut ChaCha8Rng::seed_from_u64(seed))?;
        let points = corrupted.points.iter().map(|p| frame.undo(p)).collect();
        Ok((checked(points, &cloud.name)?.into_points(), corrupted.origin))
    })?;
    Ok((to_array(py, points)?, origins(py, &origin)))
}
