//! Files of clouds.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use numpy::PyArray2;
use pyo3::prelude::*;
use srrf_args::files;
use srrf_cloud::io::{CloudFile, Note, Outgoing, ReadOptions, write_outgoing};
use srrf_cloud::{LengthUnit, TriangleMesh};

use crate::cloud::{Cloud, to_array};
use crate::pose;
use crate::refusal::{Fault, Refusal, in_python};
use crate::work;

/// How a file is read, as Python gives it.
#[derive(Debug, FromPyObject)]
#[pyo3(from_item_all)]
pub struct AskedReading {
    columns: Option<String>,
    array: Option<String>,
    layout: Option<String>,
    scan: Option<usize>,
    topic: Option<String>,
    message: Option<usize>,
    max_memory: Option<u64>,
}

impl AskedReading {
    fn options(self) -> Result<ReadOptions, Refusal> {
        Ok(ReadOptions {
            columns: parsed("columns", self.columns)?,
            array: self.array,
            layout: parsed("layout", self.layout)?,
            scan: self.scan,
            topic: self.topic,
            message: self.message,
            keep_zeros: true,
            max_memory: self.max_memory,
            ..ReadOptions::default()
        })
    }
}

/// What the text of an option stands for.
fn parsed<T: FromStr<Err: fmt::Display>>(name: &str, text: Option<String>) -> Result<Option<T>, Refusal> {
    let parse = |text: String| text.parse().map_err(|e| Refusal::new(Fault::Option, format!("{name}: {e}")));
    text.map(parse).transpose()
}

/// How many of one unit are one of another.
#[pyfunction]
pub fn unit_factor(from: &str, to: &str) -> Result<f64, Refusal> {
    let unit = |name: &str| -> Result<LengthUnit, Refusal> {
        name.parse().map_err(|e: srrf_cloud::UnitError| Refusal::new(Fault::Option, e.to_string()))
    };
    Ok(unit(from)?.in_units_of(unit(to)?))
}

/// The points of a file, and sentences on its reading.
type ReadPoints<'py> = (Bound<'py, PyArray2<f64>>, Vec<String>);

/// All points of a file, in its order, NaN and infinity too. `surface` says whether points are drawn from the surface of a mesh
/// instead of its vertices, and how many; none asks what it is.
#[pyfunction]
pub fn read<'py>(
    py: Python<'py>,
    path: PathBuf,
    reading: AskedReading,
    vertices: Option<bool>,
    surface: Option<usize>,
    seed: u64,
) -> PyResult<ReadPoints<'py>> {
    let options = reading.options()?;
    let name = path.display().to_string();
    let (points, said) = work::run(py, work::threads(None)?, move |_| {
        let contents = CloudFile::open_with(&path, options)?.contents()?;
        let mut said: Vec<String> = contents.notes.iter().map(Note::to_string).collect();
        if contents.faces.is_empty() || vertices == Some(true) {
            return Ok((contents.points, said));
        }
        let faces = contents.faces.len();
        if vertices.is_none() {
            said.push(format!(
                "a mesh of {faces} faces, whose {} vertices were read; vertices=False draws points from its surface, \
                 vertices=True says that this is wanted",
                contents.points.len()
            ));
            return Ok((contents.points, said));
        }
        let mesh = TriangleMesh::new(&contents.points, &contents.faces).map_err(|e| {
            Refusal::new(Fault::Input, format!("{name}: {e}; mend the mesh, or pass vertices=True"))
        })?;
        let count = surface.unwrap_or_else(|| mesh.samples_for(mesh.vertex_spacing()));
        Ok((mesh.sample(count, seed).into_points(), said))
    })?;
    Ok((to_array(py, points)?, said))
}

/// A file as the program reads it: without points that are no numbers or stand for "no return".
#[pyfunction]
#[pyo3(signature = (path, name = None))]
pub fn open(py: Python<'_>, path: PathBuf, name: Option<String>) -> PyResult<Cloud> {
    work::run(py, work::threads(None)?, move |_| {
        // The library's own error first: it knows a file that is not there.
        CloudFile::open(&path)?;
        let input = files::read(&path, None, ReadOptions::default())
            .map_err(|e| Refusal::new(Fault::File, in_python(&e.to_string())))?;
        let name = name.unwrap_or_else(|| input.name.clone());
        Ok(Cloud::of_input(input, name))
    })
}

/// A scan: its name, its points, and the pose of its scanner.
type ScanRow<'py> = (String, u64, Option<Bound<'py, PyArray2<f64>>>);

/// The scans of a file.
#[pyfunction]
pub fn scans<'py>(py: Python<'py>, path: PathBuf, reading: AskedReading) -> PyResult<Vec<ScanRow<'py>>> {
    let options = reading.options()?;
    let found =
        work::run(py, work::threads(None)?, move |_| Ok(CloudFile::open_with(&path, options)?.scans()?))?;
    let row = |scan: srrf_cloud::io::ScanEntry| {
        let pose = scan.pose.map(|pose| pose::matrix(py, &pose)).transpose()?;
        Ok((scan.name, scan.points, pose))
    };
    found.into_iter().map(row).collect()
}

/// Writes a cloud in the format that the extension says. Answers whether single precision was asked for and would have moved
/// points, so that the file has double precision.
#[pyfunction]
pub fn write(py: Python<'_>, path: PathBuf, cloud: &Cloud, single: bool) -> PyResult<bool> {
    let cloud = cloud.clone();
    let kept = work::run(py, 1, move |_| {
        let outgoing = Outgoing { single, ..Outgoing::of_points(cloud.points.points()) };
        Ok::<_, Refusal>(write_outgoing(&path, &outgoing)?)
    })?;
    Ok(single && kept.double.is_some())
}
