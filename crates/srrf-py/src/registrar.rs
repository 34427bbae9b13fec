//! The registrar and its prepared targets.

use std::sync::Arc;

use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use srrf::cli::answer_json;
use srrf::{AppliedScale, Request, RequestTarget, ScaleOrigin};

use crate::cloud::Cloud;
use crate::options::{Asked, AskedScale, Scale};
use crate::pose;
use crate::refusal::{Fault, Refusal};
use crate::surface::{Drawing, DrawnPair, refuse_mesh};
use crate::work;

/// Options and a loaded network.
#[pyclass(frozen, module = "srrf._srrf", name = "Registrar")]
pub struct PyRegistrar {
    pub inner: Arc<srrf::Registrar>,
    pub threads: usize,
    pub vertices: bool,
    scale: Scale,
}

/// A target made ready for many sources.
#[pyclass(frozen, module = "srrf._srrf", name = "Target")]
#[derive(Clone)]
pub struct PyTarget {
    inner: srrf::Target,
    #[pyo3(get)]
    cloud: Cloud,
}

/// What a source is laid on.
#[derive(FromPyObject)]
enum OnTo<'py> {
    Prepared(PyRef<'py, PyTarget>),
    Cloud(PyRef<'py, Cloud>),
}

/// The source by the factor that was given.
fn scaled(source: Cloud, scale: Scale) -> Result<Cloud, Refusal> {
    match scale {
        Scale::Factor(factor) if factor != 1.0 => by_factor(source, factor),
        _ => Ok(source),
    }
}

fn by_factor(cloud: Cloud, factor: f64) -> Result<Cloud, Refusal> {
    let points = cloud.points.scaled(factor).map_err(|e| {
        Refusal::new(Fault::Input, format!("{}, multiplied by {factor}: {e}; pass another scale", cloud.name))
    })?;
    Ok(Cloud { points: Arc::new(points), ..cloud })
}

#[pymethods]
impl PyRegistrar {
    #[new]
    #[pyo3(signature = (*, method, rotation, refine, weights, device, seed, abstain_below, vertices, scale, num_threads))]
    #[allow(clippy::too_many_arguments, reason = "one for each option")]
    fn new(
        py: Python<'_>,
        method: String,
        rotation: String,
        refine: bool,
        weights: Option<String>,
        device: String,
        seed: u64,
        abstain_below: f64,
        vertices: bool,
        scale: Option<AskedScale>,
        num_threads: Option<i64>,
    ) -> PyResult<Self> {
        let threads = work::threads(num_threads)?;
        let asked = Asked { method, rotation, refine, weights, device, seed, abstain_below, scale };
        let scale = asked.scale()?;
        let options = asked.options()?;
        let inner = work::run(py, threads, move |_| Ok(srrf::Registrar::new(options)?))?;
        Ok(Self { inner: Arc::new(inner), threads, vertices, scale })
    }

    /// Makes a target ready.
    fn prepare(&self, py: Python<'_>, target: &Cloud) -> PyResult<PyTarget> {
        refuse_mesh(target, self.vertices, "a target made ready has no source whose density it could have")?;
        let (registrar, cloud) = (Arc::clone(&self.inner), target.clone());
        let points = Arc::clone(&cloud.points);
        let name = cloud.name.clone();
        let inner = work::run(py, self.threads, move |_| {
            registrar.prepare(&points).map_err(|e| Refusal::registering(e, &name, &name))
        })?;
        Ok(PyTarget { inner, cloud })
    }

    /// The answer as one line of JSON: what the program writes by `--json`, without the time of reading. With it come both clouds
    /// as they were registered.
    #[pyo3(signature = (source, target, initial = None))]
    fn register(
        &self,
        py: Python<'_>,
        source: &Cloud,
        target: OnTo<'_>,
        initial: Option<PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<(String, Cloud, Cloud)> {
        let initial = initial.map(|matrix| pose::rigid(&matrix, "initial")).transpose()?;
        let source = source.clone();
        let (onto, ready) = match target {
            OnTo::Prepared(target) => (target.cloud.clone(), Some(target.inner.clone())),
            OnTo::Cloud(cloud) => (cloud.clone(), None),
        };
        let (registrar, scale, vertices) = (Arc::clone(&self.inner), self.scale, self.vertices);
        work::run(py, self.threads, move |stop| {
            let source = scaled(source, scale)?;
            let drawing =
                Drawing { vertices, one_unit: scale != Scale::Auto, seed: registrar.options().seed };
            let DrawnPair { source, target, surfaces } = drawing.apply(&source, &onto)?;
            let laid_on: RequestTarget<'_> = match &ready {
                Some(ready) => ready.into(),
                None => (&*target.points).into(),
            };
            let request = Request { initial, ..Request::new(&source.points, laid_on) }.until(stop);
            let found = match scale {
                Scale::Auto => registrar.register_with_scale(&request),
                _ => registrar.register(&request),
            };
            let mut outcome = found.map_err(|e| Refusal::registering(e, &source.name, &target.name))?;
            outcome.surfaces = surfaces;
            if let Scale::Factor(factor) = scale {
                outcome.scale = Some(AppliedScale { factor, spread: None, origin: ScaleOrigin::Given });
            }
            outcome.warnings.extend([&source, &target].into_iter().flat_map(Cloud::warnings));
            let dropped = [source.dropped, target.dropped];
            let value = answer_json(&outcome, &source.name, &target.name, dropped);
            // As it was registered.
            let source = match outcome.scale {
                Some(AppliedScale { factor, origin: ScaleOrigin::Estimated, .. }) => {
                    by_factor(source, factor)?
                }
                _ => source,
            };
            Ok::<_, Refusal>((value.to_string(), source, target))
        })
    }

    fn __repr__(&self) -> String {
        format!("<Registrar {}>", self.inner.options())
    }
}

#[pymethods]
impl PyTarget {
    fn __repr__(&self) -> String {
        format!("<Target {}: {} points>", self.cloud.name, self.cloud.points.len())
    }
}
