//! Files of clouds.

use std::path::PathBuf;

use numpy::PyArray2;
use pyo3::prelude::*;
use srrf_cloud::io::{CloudFile, write_cloud};

use crate::cloud::{Cloud, to_array};
use crate::refusal::Refusal;
use crate::work;

/// All points of a file, in its order, NaN and infinity too.
#[pyfunction]
pub fn read(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let threads = work::threads(None)?;
    let points = work::run(py, threads, move |_| Ok(CloudFile::open(&path)?.points()?))?;
    to_array(py, points)
}

/// Writes a cloud in the format that the extension says.
#[pyfunction]
pub fn write(py: Python<'_>, path: PathBuf, cloud: &Cloud) -> PyResult<()> {
    let cloud = cloud.clone();
    work::run(py, 1, move |_| Ok::<_, Refusal>(write_cloud(&path, &cloud.points)?))
}
