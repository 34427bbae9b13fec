//! [`RefineTarget`] and [`RefineSource`]: clouds made ready, and [`refine`] for one pair.

use std::sync::OnceLock;

use nalgebra::Matrix3;
use rayon::prelude::*;
use srrf_cloud::{PointCloud, Rigid, Solid};

use crate::alternatives::{Alternative, Challengers};
use crate::assess::{Assessment, assess};
use crate::evidence::{Evidence, evidence};
use crate::prepared::RefineCloud;
use crate::refine::{RefineRun, Refinement, StartSupport};
use crate::symmetry::symmetries;
use crate::{RefineConfig, RefineError};

/// A source of less than this share of the target's radius is a body in a scene.
const SMALLER: f64 = 0.8;

/// A target made ready, to refine the poses of many sources.
#[derive(Debug)]
pub struct RefineTarget {
    config: RefineConfig,
    prepared: RefineCloud,
    /// Rotations about the mean that may map it onto itself, once they were asked for.
    symmetries: OnceLock<Vec<Matrix3<f64>>>,
}

/// A source made ready by [`RefineTarget::source`], to refine many of its poses.
#[derive(Debug)]
pub struct RefineSource {
    prepared: RefineCloud,
}

impl RefineTarget {
    /// Centres, thins and indexes the target and estimates its normals.
    ///
    /// # Errors
    /// [`RefineError::Config`], and [`RefineError::Target`] for a cloud that spans more than the largest number.
    pub fn new(target: Solid<'_>, config: &RefineConfig) -> Result<Self, RefineError> {
        config.validate()?;
        let prepared = RefineCloud::new(target, config).map_err(RefineError::Target)?;
        Ok(Self { config: *config, prepared, symmetries: OnceLock::new() })
    }

    /// The settings.
    pub fn config(&self) -> &RefineConfig {
        &self.config
    }

    /// Makes a source ready in the same way.
    ///
    /// # Errors
    /// [`RefineError::Source`] for a cloud that spans more than the largest number.
    pub fn source(&self, source: Solid<'_>) -> Result<RefineSource, RefineError> {
        let prepared = RefineCloud::new(source, &self.config).map_err(RefineError::Source)?;
        Ok(RefineSource { prepared })
    }

    /// What speaks for a pose as it is, without refinement.
    pub fn evidence(&self, source: &RefineSource, pose: &Rigid) -> Evidence {
        evidence(&source.prepared, &self.prepared, pose)
    }

    /// Whether a pose agrees by more than chance, and what it leaves open.
    pub fn assess(&self, source: &RefineSource, pose: &Rigid) -> Assessment {
        assess(&source.prepared, &self.prepared, pose, &self.config)
    }

    /// Poses that challenge one: by symmetries of the smaller cloud, by shifts of lattices, and by turns about the middle of the overlap.
    pub fn challengers(&self, source: &RefineSource, pose: &Rigid) -> Challengers {
        let run = self.run(source);
        // The smaller cloud is the body; both have their mean at the origin.
        let moved = run.local(pose);
        let turn = |rotation: &Matrix3<f64>| Rigid { rotation: *rotation, ..Rigid::identity() };
        let turned: Vec<Rigid> = if source.prepared.radius < SMALLER * self.prepared.radius {
            symmetries(source.prepared.coarse(), source.prepared.radius)
                .iter()
                .map(|r| moved.compose(&turn(r)))
                .collect()
        } else {
            let known =
                self.symmetries.get_or_init(|| symmetries(self.prepared.coarse(), self.prepared.radius));
            known.iter().map(|r| turn(r).compose(&moved)).collect()
        };
        Challengers::new(&run, &moved, turned)
    }

    /// Other poses that may fit as well: among those that challenge a pose, and among `rivals`. Those that only move along what
    /// `assessed`, the assessment of the pose, leaves open are left out. Best first.
    pub fn alternatives(
        &self,
        source: &RefineSource,
        challengers: &Challengers,
        assessed: &Assessment,
        rivals: &[Rigid],
    ) -> Vec<Alternative> {
        challengers.alternatives(&self.run(source), &assessed.freedom, rivals)
    }

    /// Refines the best of `starts`: poses that map the source near the target.
    ///
    /// # Errors
    /// As [`RefineTarget::source`]; [`RefineError::NoStart`] without starts, [`RefineError::Start`] for one that is
    /// not finite.
    pub fn refine(&self, source: Solid<'_>, starts: &[Rigid]) -> Result<Refinement, RefineError> {
        let source = self.source(source)?;
        self.finish(&source, &self.shortlist(&source, starts)?)
    }

    /// The first half of [`RefineTarget::refine`]: a short run of each start, or just the support of a single one.
    /// Lists may be joined, so that starts can come in rounds.
    ///
    /// # Errors
    /// [`RefineError::Start`] for a start that is not finite.
    pub fn shortlist(
        &self,
        source: &RefineSource,
        starts: &[Rigid],
    ) -> Result<Vec<StartSupport>, RefineError> {
        all_finite(starts)?;
        Ok(self.run(source).shortlist(starts))
    }

    /// Numbers of the `most` starts that bring most of both clouds together as they are, at a first look at few points; in their
    /// order, all where there are no more. It is far cheaper than a short run.
    ///
    /// # Errors
    /// [`RefineError::Start`] for a start that is not finite.
    pub fn screen(
        &self,
        source: &RefineSource,
        starts: &[Rigid],
        most: usize,
    ) -> Result<Vec<usize>, RefineError> {
        all_finite(starts)?;
        let run = self.run(source);
        let scores: Vec<f64> = starts.par_iter().map(|start| run.glance(start)).collect();
        let mut best: Vec<usize> = (0..starts.len()).collect();
        best.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]));
        best.truncate(most);
        best.sort_unstable();
        Ok(best)
    }

    /// The second half of [`RefineTarget::refine`]: the full run of the best of the shortlist.
    ///
    /// # Errors
    /// [`RefineError::NoStart`] for an empty list.
    pub fn finish(&self, source: &RefineSource, starts: &[StartSupport]) -> Result<Refinement, RefineError> {
        self.run(source).finish(starts)
    }

    fn run<'a>(&'a self, source: &'a RefineSource) -> RefineRun<'a> {
        RefineRun { source: &source.prepared, target: &self.prepared, config: &self.config }
    }
}

fn all_finite(starts: &[Rigid]) -> Result<(), RefineError> {
    let finite = |p: &Rigid| p.rotation.iter().chain(p.translation.iter()).all(|v| v.is_finite());
    match starts.iter().position(|pose| !finite(pose)) {
        Some(number) => Err(RefineError::Start(number)),
        None => Ok(()),
    }
}

/// Refines the best of `starts`: poses that map `source` near `target`.
///
/// Several starts get a short run each, on few points; the best supported one gets the full run: a
/// robust stage (nearest neighbours both ways, Geman-McClure, shrinking scale), coarse to fine for
/// large clouds, then a soft stage for small ones. Then the residuals are looked at, and the answer is
/// the refined pose, its cautious variant or the start ([`crate::Verdict`]).
///
/// The answer does not depend on the number of threads, and on the order of the points only by
/// rounding.
///
/// # Errors
/// [`RefineError`] for clouds, settings or starts that cannot be used.
pub fn refine(
    source: &PointCloud,
    target: &PointCloud,
    starts: &[Rigid],
    config: &RefineConfig,
) -> Result<Refinement, RefineError> {
    let target = Solid::new(target).map_err(RefineError::Target)?;
    let source = Solid::new(source).map_err(RefineError::Source)?;
    RefineTarget::new(target, config)?.refine(source, starts)
}
