//! Many scans into one frame.

use std::borrow::Cow;
use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use serde_json::{Value, json};
use srrf::{Request, Target};
use srrf_align::{AlignError, AlignOptions, Map, NoStore, PairAnswer, RegisterPairs, Scans};
use srrf_cloud::{PointCloud, Rigid, Solid};

use crate::cloud::Cloud;
use crate::pose;
use crate::refusal::{Fault, Refusal};
use crate::registrar::PyRegistrar;
use crate::surface::refuse_mesh;
use crate::work;

/// The map as JSON: `{"scans": [...], "components": [...], "edges": [...], ...}`.
#[pyfunction]
pub fn align(
    py: Python<'_>,
    registrar: &PyRegistrar,
    clouds: Vec<PyRef<'_, Cloud>>,
    initial: Vec<Option<PyReadonlyArray2<'_, f64>>>,
    sequence: bool,
    refine: bool,
) -> PyResult<String> {
    for cloud in &clouds {
        refuse_mesh(cloud, registrar.vertices, "many scans have no one density it could have")?;
        Solid::new(&cloud.points).map_err(|e| Refusal::cloud(&cloud.name, &e))?;
    }
    let guess = |(index, matrix): (usize, &Option<PyReadonlyArray2<'_, f64>>)| {
        matrix.as_ref().map(|matrix| pose::rigid(matrix, &format!("initial[{index}]"))).transpose()
    };
    let initial = initial.iter().enumerate().map(guess).collect::<Result<_, _>>()?;
    let options = AlignOptions { initial, sequence, refine, ..AlignOptions::default() };
    let scans = Held(clouds.iter().map(|cloud| (*cloud).clone()).collect());
    let inner = Arc::clone(&registrar.inner);
    work::run(py, registrar.threads, move |stop| {
        let method = Stoppable { inner: &inner, stop };
        let map = srrf_align::align(&scans, &method, &options, &NoStore, &|_| {})
            .map_err(|e| refused(e, &scans))?;
        Ok(to_json(&map, &scans).to_string())
    })
}

/// Clouds that Python gave.
struct Held(Vec<Cloud>);

impl Scans for Held {
    type Error = Infallible;

    fn count(&self) -> usize {
        self.0.len()
    }

    fn viewpoint(&self, number: usize) -> Option<[f64; 3]> {
        self.0[number].viewpoint
    }

    fn cloud(&self, number: usize) -> Result<Cow<'_, PointCloud>, Infallible> {
        Ok(Cow::Borrowed(&self.0[number].points))
    }
}

/// A registrar that ends with the call.
struct Stoppable<'a> {
    inner: &'a srrf::Registrar,
    stop: &'a Arc<AtomicBool>,
}

impl RegisterPairs for Stoppable<'_> {
    type Target = Target;
    type Error = srrf::Error;

    fn prepare(&self, target: &PointCloud) -> Result<Target, srrf::Error> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(srrf::Error::Stopped);
        }
        self.inner.prepare(target)
    }

    fn register(
        &self,
        source: &PointCloud,
        target: &Target,
        target_from_source: Option<Rigid>,
    ) -> Result<PairAnswer, srrf::Error> {
        self.answered(self.inner, source, target, target_from_source)
    }

    fn refine(
        &self,
        source: &PointCloud,
        target: &Target,
        target_from_source: Rigid,
    ) -> Result<PairAnswer, srrf::Error> {
        self.answered(&self.inner.guided()?, source, target, Some(target_from_source))
    }
}

impl Stoppable<'_> {
    fn answered(
        &self,
        registrar: &srrf::Registrar,
        source: &PointCloud,
        target: &Target,
        target_from_source: Option<Rigid>,
    ) -> Result<PairAnswer, srrf::Error> {
        let request = Request { initial: target_from_source, ..Request::new(source, target) };
        registrar.pair_answer(&request.until(self.stop))
    }
}

fn refused(error: AlignError<Infallible, srrf::Error>, scans: &Held) -> Refusal {
    match error {
        AlignError::TooFew(n) => {
            Refusal::new(Fault::Input, format!("{n} scans: pass a list of two or more clouds"))
        }
        AlignError::Cloud { number, source } => Refusal::cloud(&scans.0[number].name, &source),
        AlignError::Register { number, source } => match source {
            srrf::Error::Source(e) | srrf::Error::Target(e) => Refusal::cloud(&scans.0[number].name, &e),
            other => Refusal::from(other),
        },
        other => Refusal::new(Fault::Input, other.to_string()),
    }
}

fn to_json(map: &Map, scans: &Held) -> Value {
    let rows = |pose: &Rigid| <[[f64; 4]; 4]>::from(pose.to_matrix4().transpose());
    let placed: Vec<Value> = map
        .scans
        .iter()
        .zip(&scans.0)
        .map(|(scan, cloud)| {
            json!({
                "name": cloud.name,
                "map_from_scan": rows(&scan.map_from_scan),
                "component": scan.component,
                "probability": scan.probability,
                "abstain": scan.abstain,
                "held_by": scan.held_by,
                "centre": scan.centre.as_slice(),
                "covariance": scan.covariance.map(<[[f64; 6]; 6]>::from),
                "spread": scan.spread,
                "undetermined": scan.undetermined,
                "residual": scan.residual,
            })
        })
        .collect();
    let edges: Vec<Value> = map
        .edges
        .iter()
        .map(|edge| {
            json!({
                "source": edge.source,
                "target": edge.target,
                "reason": edge.reason,
                "target_from_source": edge.target_from_source.as_ref().map(rows),
                "probability": edge.probability,
                "abstain": edge.abstain,
                "posterior": edge.posterior,
                "verdict": edge.verdict,
                "overlap": edge.overlap,
                "seen_through": edge.seen_through,
                "off_deg": edge.off_deg,
                "off": edge.off,
            })
        })
        .collect();
    json!({
        "scans": placed,
        "components": map.components,
        "edges": edges,
        "rivals": map.rivals,
        "worst_loop": map.worst_loop,
        "residual": map.residual,
        "choice": map.choice,
    })
}
