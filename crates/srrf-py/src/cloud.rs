//! [`Cloud`]: the points of an array, copied once.

use std::sync::Arc;

use numpy::ndarray::ArrayView2;
use numpy::{Element, IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use srrf::Warning;
use srrf_args::files::Input;
use srrf_cloud::io::{Contents, Note};
use srrf_cloud::{CloudError, PointCloud};

use crate::refusal::{Fault, Refusal};

/// The finite points of an array of shape `(n, >= 3)` or of a file. Copies share them.
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
    /// Triangles of a mesh, as indices of `points`.
    pub faces: Arc<Vec<[u32; 3]>>,
    /// Faces that were left out, because a corner is NaN or infinite.
    pub lost_faces: usize,
    /// Where the scanner stood, where a file says it.
    pub viewpoint: Option<[f64; 3]>,
    /// What is to be known of how its file was read.
    pub notes: Vec<Note>,
}

#[pymethods]
impl Cloud {
    #[new]
    #[pyo3(signature = (array, name, faces = None))]
    fn new(
        array: &Bound<'_, PyAny>,
        name: String,
        faces: Option<PyReadonlyArray2<'_, u32>>,
    ) -> Result<Self, Refusal> {
        let points = rows(array, &name)?;
        let corners = faces.map_or_else(Vec::new, |faces| {
            faces.as_array().rows().into_iter().map(|f| [f[0], f[1], f[2]]).collect()
        });
        let (before, all_faces) = (points.len(), corners.len());
        let mut contents = Contents { faces: corners, ..Contents::of_points(points) };
        let dropped = contents.drop_not_finite();
        if dropped == before && dropped > 0 {
            return Err(Refusal::new(
                Fault::Input,
                format!(
                    "{name}: each of its {dropped} points has a coordinate that is NaN or infinite; pass numbers"
                ),
            ));
        }
        let lost_faces = all_faces - contents.faces.len();
        let points = PointCloud::new(contents.points).map_err(|e| Refusal::cloud(&name, &e))?;
        let (points, faces) = (Arc::new(points), Arc::new(contents.faces));
        Ok(Self { points, name, dropped, faces, lost_faces, viewpoint: None, notes: Vec::new() })
    }

    /// Whether it has faces.
    #[getter]
    pub fn is_mesh(&self) -> bool {
        self.faces.len() + self.lost_faces > 0
    }

    fn __len__(&self) -> usize {
        self.points.len()
    }

    /// The points, shape `(n, 3)`.
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        to_array(py, self.points.points().to_vec())
    }
}

impl Cloud {
    /// As the program reads a file.
    pub fn of_input(input: Input, name: String) -> Self {
        let Input { cloud, dropped, faces, lost_faces, viewpoint, notes, .. } = input;
        let (points, faces) = (Arc::new(cloud), Arc::new(faces));
        Self { points, name, dropped, faces, lost_faces, viewpoint, notes }
    }

    /// With other points, and no faces.
    pub fn with_points(&self, points: PointCloud) -> Self {
        Self { points: Arc::new(points), faces: Arc::default(), lost_faces: 0, ..self.clone() }
    }

    /// What is to be known of how it came about.
    pub fn warnings(&self) -> Vec<Warning> {
        let cloud = || self.name.clone();
        let left_out = (self.dropped > 0).then(|| Warning::LeftOut { cloud: cloud(), points: self.dropped });
        let notes = self.notes.iter().map(|note| Warning::Reading { cloud: cloud(), note: note.clone() });
        left_out.into_iter().chain(notes).collect()
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
