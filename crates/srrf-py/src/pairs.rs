//! Pairs of the corruption benchmark, as arrays.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use srrf_cloud::io::ReadOptions;
use srrf_corrupt::datasets::{self, ShapeSource, Split};
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::{Pair, PairConfig, RotationRange};
use srrf_eval::{CLEAN, PairSource, Protocol, SynthesizedPairs, data};

use crate::bases::Remembered;
use crate::cloud::{origins, to_array};
use crate::corruption;
use crate::pose;
use crate::refusal::{Fault, Refusal};
use crate::work;

/// Pairs that are made when they are asked for.
#[pyclass(frozen, module = "srrf._srrf")]
pub struct Pairs {
    inner: Arc<SynthesizedPairs>,
    /// Where each group ends in the list of all pairs.
    ends: Vec<usize>,
    /// Points of each cloud.
    points: usize,
    threads: usize,
}

/// What one of the words of a configuration stands for.
fn word<T: serde::de::DeserializeOwned>(name: &str, value: &str, known: &str) -> Result<T, Refusal> {
    serde_json::from_value(serde_json::Value::from(value))
        .map_err(|_| Refusal::new(Fault::Option, format!("{name} is `{value}`: use one of {known}")))
}

#[pymethods]
impl Pairs {
    #[new]
    #[pyo3(signature = (
        *, shapes, corruptions, severities, clean, data, split, seed, points, rotation_deg, translation, corrupt,
        sampling, normalize, reading, crop, dcp_poses, spread, num_threads
    ))]
    #[allow(clippy::too_many_arguments, reason = "one for each option")]
    fn new(
        py: Python<'_>,
        shapes: usize,
        corruptions: Vec<String>,
        severities: Vec<i64>,
        clean: bool,
        data: Option<PathBuf>,
        split: &str,
        seed: u64,
        points: usize,
        rotation_deg: Option<f64>,
        translation: f64,
        corrupt: &str,
        sampling: &str,
        normalize: &str,
        reading: &str,
        crop: Option<f64>,
        dcp_poses: bool,
        spread: bool,
        num_threads: Option<i64>,
    ) -> PyResult<Self> {
        let threads = work::threads(num_threads)?;
        let pair = PairConfig {
            corrupt: word("corrupt", corrupt, "both, source, target")?,
            sampling: word("sampling", sampling, "shared, independent")?,
            normalize: word("normalize", normalize, "none, canonical, after_pose")?,
            rotation: rotation_deg.map_or(RotationRange::So3, |max_deg| RotationRange::EulerAxes { max_deg }),
            translation,
            points,
            keep_correspondence: true,
            variants: corruption::variants(reading)?,
        };
        let protocol = Protocol {
            clean,
            corruptions: corruptions.iter().map(|name| corruption::kind(name)).collect::<Result<_, _>>()?,
            mixtures: Vec::new(),
            severities: severities.iter().map(|n| corruption::severity(*n)).collect::<Result<_, _>>()?,
            shapes,
            seed,
            pair,
            crop,
            dcp_poses,
            spread,
        };
        let split = split.to_owned();
        let inner = work::run(py, threads, move |_| {
            let source = open(data, &split, shapes, seed)?;
            Ok(SynthesizedPairs::new(Box::new(Remembered::new(source)), protocol)?)
        })?;
        let mut end = 0;
        let ends = inner.groups().iter().map(|group| {
            end += group.pairs;
            end
        });
        let ends = ends.collect();
        Ok(Self { inner: Arc::new(inner), ends, points, threads })
    }

    fn __len__(&self) -> usize {
        self.ends.last().copied().unwrap_or(0)
    }

    /// One line on the data and the protocol.
    fn description(&self) -> String {
        self.inner.description()
    }

    /// The pairs of these indices as dictionaries of arrays: made in parallel.
    fn pairs<'py>(&self, py: Python<'py>, indices: Vec<usize>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.check_memory(indices.len())?;
        let threads = if indices.len() == 1 { 1 } else { self.threads };
        let made = self.make(py, threads, &indices, Ok)?;
        let dict = |(made, index): (Pair, usize)| {
            let dict = self.described(py, &made, self.place(index).0)?;
            dict.set_item("target_from_source", pose::matrix(py, &made.target_from_source)?)?;
            for (name, origin) in
                [("source_origin", &made.source_origin), ("target_origin", &made.target_origin)]
            {
                dict.set_item(name, origin.as_ref().map(|origin| origins(py, origin)))?;
            }
            dict.set_item("source", to_array(py, made.source.into_points())?)?;
            dict.set_item("target", to_array(py, made.target.into_points())?)?;
            Ok(dict)
        };
        made.into_iter().zip(indices).map(dict).collect()
    }

    /// The pairs of these indices, stacked: made in parallel.
    fn arrays<'py>(&self, py: Python<'py>, indices: Vec<usize>) -> PyResult<Bound<'py, PyDict>> {
        // While they are stacked they are there twice.
        self.check_memory(2 * indices.len())?;
        let made = self.make(py, self.threads, &indices, |pairs| Stacked::new(&pairs))?;
        let chosen: Vec<(usize, usize)> = indices.iter().map(|i| self.place(*i)).collect();
        let dict = PyDict::new(py);
        let n = chosen.len();
        let corruption: Vec<&str> =
            chosen.iter().map(|(g, _)| &*self.inner.groups()[*g].corruption).collect();
        let severity: Vec<i64> =
            chosen.iter().map(|(g, _)| i64::from(self.inner.groups()[*g].severity)).collect();
        dict.set_item("source", made.source.into_pyarray(py).reshape([n, made.points[0], 3])?)?;
        dict.set_item("target", made.target.into_pyarray(py).reshape([n, made.points[1], 3])?)?;
        dict.set_item("target_from_source", made.poses.into_pyarray(py).reshape([n, 4, 4])?)?;
        dict.set_item(
            "source_origin",
            made.source_origin.map(|o| o.into_pyarray(py).reshape([n, made.points[0]])).transpose()?,
        )?;
        dict.set_item(
            "target_origin",
            made.target_origin.map(|o| o.into_pyarray(py).reshape([n, made.points[1]])).transpose()?,
        )?;
        dict.set_item("corruption", corruption)?;
        dict.set_item("severity", severity.into_pyarray(py))?;
        dict.set_item("shape", made.shapes)?;
        dict.set_item("class_name", made.classes)?;
        dict.set_item("symmetric", made.symmetric.into_pyarray(py))?;
        Ok(dict)
    }
}

impl Pairs {
    /// Group and item of a pair.
    fn place(&self, index: usize) -> (usize, usize) {
        let group = self.ends.partition_point(|end| *end <= index);
        let before = group.checked_sub(1).map_or(0, |before| self.ends[before]);
        (group, index - before)
    }

    /// Refuses what the machine does not hold.
    fn check_memory(&self, pairs: usize) -> Result<(), Refusal> {
        let pair = 2 * (size_of::<[f64; 3]>() + size_of::<i64>()) * self.points;
        let (bytes, most) = ((pair as u64).saturating_mul(pairs as u64), ReadOptions::default().memory());
        if bytes <= most {
            return Ok(());
        }
        let message = format!(
            "so many pairs would take {:.1} GB, more than half of this machine's memory; take fewer at a time, such as \
             arrays(slice(0, 64))",
            bytes as f64 / 1e9
        );
        Err(Refusal::new(Fault::Input, message))
    }

    /// What becomes of the pairs of these indices, which are made in parallel.
    fn make<T: Send + 'static>(
        &self,
        py: Python<'_>,
        threads: usize,
        indices: &[usize],
        then: fn(Vec<Pair>) -> Result<T, Refusal>,
    ) -> PyResult<T> {
        let inner = Arc::clone(&self.inner);
        let chosen: Vec<(usize, usize)> = indices.iter().map(|i| self.place(*i)).collect();
        work::run(py, threads, move |stop| {
            let make = |(group, item): &(usize, usize)| {
                if stop.load(Ordering::Relaxed) {
                    return Err(Refusal::new(Fault::Internal, "stopped"));
                }
                Ok(inner.bare_pair(*group, *item)?)
            };
            then(chosen.par_iter().map(make).collect::<Result<_, Refusal>>()?)
        })
    }

    fn described<'py>(&self, py: Python<'py>, pair: &Pair, group: usize) -> PyResult<Bound<'py, PyDict>> {
        let of = &self.inner.groups()[group];
        let dict = PyDict::new(py);
        dict.set_item("corruption", if of.corruption == CLEAN { CLEAN } else { &of.corruption })?;
        dict.set_item("severity", of.severity)?;
        dict.set_item("shape", &pair.id)?;
        dict.set_item("class_name", &pair.class)?;
        dict.set_item("symmetric", pair.symmetric)?;
        Ok(dict)
    }
}

/// The shapes: those that are scored, or those that are learned from.
fn open(
    data: Option<PathBuf>,
    split: &str,
    shapes: usize,
    seed: u64,
) -> Result<Box<dyn ShapeSource>, Refusal> {
    let no_shapes = |e: datasets::SourceError| Refusal::new(Fault::Input, e.to_string());
    match (split, data) {
        ("test", data) => Ok(data::open(data.as_deref(), shapes)?),
        ("train", Some(path)) => {
            datasets::open(&path, Split::Train).map_err(|e| Refusal::new(Fault::File, e.to_string()))
        }
        ("train", None) => Ok(Box::new(ProceduralShapes::new(seed, shapes, None).map_err(no_shapes)?)),
        _ => Err(Refusal::new(Fault::Option, format!("split is `{split}`: use test or train"))),
    }
}

/// Many pairs in few arrays.
struct Stacked {
    points: [usize; 2],
    source: Vec<f64>,
    target: Vec<f64>,
    poses: Vec<f64>,
    source_origin: Option<Vec<i64>>,
    target_origin: Option<Vec<i64>>,
    shapes: Vec<String>,
    classes: Vec<String>,
    symmetric: Vec<bool>,
}

impl Stacked {
    fn new(pairs: &[Pair]) -> Result<Self, Refusal> {
        let points = pairs.first().map_or([0; 2], |pair| [pair.source.len(), pair.target.len()]);
        if pairs.iter().any(|pair| [pair.source.len(), pair.target.len()] != points) {
            return Err(Refusal::new(
                Fault::Input,
                "the clouds differ in size, so that they do not stack; take the pairs one by one",
            ));
        }
        let all = |of: fn(&Pair) -> &[[f64; 3]]| {
            pairs.iter().map(|pair| of(pair).as_flattened()).collect::<Vec<_>>().concat()
        };
        let origin = |of: fn(&Pair) -> &Option<Vec<Option<u32>>>| -> Option<Vec<i64>> {
            let rows: Option<Vec<_>> = pairs.iter().map(|pair| of(pair).as_deref()).collect();
            Some(rows?.into_iter().flatten().map(|o| o.map_or(-1, i64::from)).collect())
        };
        Ok(Self {
            points,
            source: all(|pair| pair.source.points()),
            target: all(|pair| pair.target.points()),
            // nalgebra stores columns.
            poses: pairs
                .iter()
                .flat_map(|pair| <[[f64; 4]; 4]>::from(pair.target_from_source.to_matrix4().transpose()))
                .flatten()
                .collect(),
            source_origin: origin(|pair| &pair.source_origin),
            target_origin: origin(|pair| &pair.target_origin),
            shapes: pairs.iter().map(|pair| pair.id.clone()).collect(),
            classes: pairs.iter().map(|pair| pair.class.clone()).collect(),
            symmetric: pairs.iter().map(|pair| pair.symmetric).collect(),
        })
    }
}
