//! [`Cloud`]: the points of an array, copied once.

use std::sync::Arc;

use numpy::ndarray::ArrayView2;
use numpy::{Element, IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use srrf_cloud::{CloudError, PointCloud};

use crate::refusal::{Fault, Refusal};

/// The finite points of an array of shape `(n, >= 3)`. Copies share them.
#[pyclass(frozen, module = "srrf._srrf")]
#[derive(Debug, Clone)]
pub struct Cloud {
    pub points: Arc<PointCloud>,
    /// What messages call it.
    #[pyo3(get)]
    pub name: String,
    /// Points left out because a coordinate is NaN or infinite.
    #[pyo3(get)]
    pub dropped: usize,
}

#[pymethods]
impl Cloud {
    #[new]
    fn new(array: &Bound<'_, PyAny>, name: String) -> Result<Self, Refusal> {
        let all = rows(array, &name)?;
        let before = all.len();
        let finite: Vec<[f64; 3]> = all.into_iter().filter(|p| p.iter().all(|c| c.is_finite())).collect();
        let dropped = before - finite.len();
        if finite.is_empty() && dropped > 0 {
            return Err(Refusal::new(
                Fault::Input,
                format!(
                    "{name}: each of its {dropped} points has a coordinate that is NaN or infinite; pass numbers"
                ),
            ));
        }
        let points = PointCloud::new(finite).map_err(|e| Refusal::cloud(&name, &e))?;
        Ok(Self { points: Arc::new(points), name, dropped })
    }

    fn __len__(&self) -> usize {
        self.points.len()
    }

    /// The points, shape `(n, 3)`.
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        to_array(py, self.points.points().to_vec())
    }
}

/// The first three columns of an array of numbers.
///
/// # Errors
/// [`Fault::Input`] for another kind of array; the package's own files say it better, before.
pub fn rows(array: &Bound<'_, PyAny>, name: &str) -> Result<Vec<[f64; 3]>, Refusal> {
    if let Ok(array) = array.extract::<PyReadonlyArray2<'_, f64>>() {
        return three_columns(&array.as_array(), name);
    }
    if let Ok(array) = array.extract::<PyReadonlyArray2<'_, f32>>() {
        return three_columns(&array.as_array(), name);
    }
    Err(Refusal::new(
        Fault::Input,
        format!(
            "{name}: expected an array of float32 or float64 with two axes, in the byte order of this machine"
        ),
    ))
}

fn three_columns<T: Element + Copy + Into<f64>>(
    array: &ArrayView2<'_, T>,
    name: &str,
) -> Result<Vec<[f64; 3]>, Refusal> {
    if array.ncols() < 3 {
        let shape = array.shape();
        return Err(Refusal::new(
            Fault::Input,
            format!("{name}: shape {shape:?}; expected (N, 3) or more columns"),
        ));
    }
    if let Some(values) = array.as_slice()
        && array.ncols() == 3
    {
        return Ok(values.as_chunks::<3>().0.iter().map(|p| p.map(Into::into)).collect());
    }
    Ok(array.rows().into_iter().map(|row| [row[0].into(), row[1].into(), row[2].into()]).collect())
}

/// Points as an array of shape `(n, 3)`, without a copy.
pub fn to_array(py: Python<'_>, points: Vec<[f64; 3]>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let rows = points.len();
    points.into_flattened().into_pyarray(py).reshape([rows, 3])
}

/// Indices of points, -1 where there is none.
pub fn origins<'py>(py: Python<'py>, origin: &[Option<u32>]) -> Bound<'py, PyArray1<i64>> {
    origin.iter().map(|o| o.map_or(-1, i64::from)).collect::<Vec<i64>>().into_pyarray(py)
}

/// A checked cloud.
///
/// # Errors
/// [`Fault::Input`], which names it.
pub fn checked(points: Vec<[f64; 3]>, name: &str) -> Result<PointCloud, Refusal> {
    PointCloud::new(points).map_err(|e: CloudError| Refusal::cloud(name, &e))
}
