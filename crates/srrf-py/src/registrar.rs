//! The registrar and its prepared targets.

use std::sync::Arc;

use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use srrf::cli::answer_json;
use srrf::{Request, RequestTarget, Warning};
use srrf_cloud::PointCloud;

use crate::cloud::Cloud;
use crate::options::Asked;
use crate::pose;
use crate::refusal::Refusal;
use crate::work;

/// Options and a loaded network.
#[pyclass(frozen, module = "srrf._srrf", name = "Registrar")]
pub struct PyRegistrar {
    inner: Arc<srrf::Registrar>,
    threads: usize,
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

/// As [`OnTo`], for another thread.
enum Ready {
    Prepared(srrf::Target),
    Cloud(Arc<PointCloud>),
}

#[pymethods]
impl PyRegistrar {
    #[new]
    #[pyo3(signature = (*, method, rotation, refine, weights, device, seed, abstain_below, num_threads))]
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
        num_threads: Option<i64>,
    ) -> PyResult<Self> {
        let threads = work::threads(num_threads)?;
        let asked = Asked { method, rotation, refine, weights, device, seed, abstain_below };
        let options = asked.options()?;
        let inner = work::run(py, threads, move |_| Ok(srrf::Registrar::new(options)?))?;
        Ok(Self { inner: Arc::new(inner), threads })
    }

    /// Makes a target ready.
    fn prepare(&self, py: Python<'_>, target: &Cloud) -> PyResult<PyTarget> {
        let (registrar, cloud) = (Arc::clone(&self.inner), target.clone());
        let points = Arc::clone(&cloud.points);
        let inner = work::run(py, self.threads, move |_| Ok(registrar.prepare(&points)?))?;
        Ok(PyTarget { inner, cloud })
    }

    /// The answer as one line of JSON: what the program writes by `--json`, without the time of reading.
    #[pyo3(signature = (source, target, initial = None))]
    fn register(
        &self,
        py: Python<'_>,
        source: &Cloud,
        target: OnTo<'_>,
        initial: Option<PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<String> {
        let initial = initial.map(|matrix| pose::rigid(&matrix, "initial")).transpose()?;
        let source = source.clone();
        let (onto, ready) = match target {
            OnTo::Prepared(target) => (target.cloud.clone(), Ready::Prepared(target.inner.clone())),
            OnTo::Cloud(cloud) => (cloud.clone(), Ready::Cloud(Arc::clone(&cloud.points))),
        };
        let registrar = Arc::clone(&self.inner);
        work::run(py, self.threads, move |stop| {
            let target: RequestTarget<'_> = match &ready {
                Ready::Prepared(target) => target.into(),
                Ready::Cloud(cloud) => (&**cloud).into(),
            };
            let request = Request { initial, ..Request::new(&source.points, target) }.until(stop);
            let mut outcome = registrar.register(&request)?;
            let left_out = |cloud: &&Cloud| cloud.dropped > 0;
            outcome.warnings.extend(
                [&source, &onto]
                    .into_iter()
                    .filter(left_out)
                    .map(|cloud| Warning::LeftOut { cloud: cloud.name.clone(), points: cloud.dropped }),
            );
            let dropped = [source.dropped, onto.dropped];
            let value = answer_json(&outcome, &source.name, &onto.name, dropped);
            Ok::<_, Refusal>(value.to_string())
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
