//! [`refine`]: starts in, one refined pose with its evidence out.

use std::fmt;

use serde::Serialize;
use srrf_cloud::{PointCloud, Rigid};

use crate::deformation::{ResidualStructure, residual_structure};
use crate::evidence::{Evidence, evidence};
use crate::matching::support;
use crate::prepared::{Prepared, to_global, to_local};
use crate::robust::{Schedule, Stage, descend};
use crate::soft::soft;
use crate::{Metric, RefineConfig, RefineError};

/// Residuals count as deformation when, along the normals, they correlate with their neighbours' by more
/// than this. Over training shapes 95 of 100 pairs with noise, clutter or repeats are under 0.15, with
/// holes under 0.45 (yet most points coincide); two samplings of one surface overlap with it (medians 0.20 to
/// 0.36); free-form deformation is over 0.38 in 95 of 100, shear over 0.23.
const DEFORMED_CORRELATION: f64 = 0.3;
/// Not so where half of the matches are closer than this, in point spacings: the clouds then share
/// points, and what is left over are holes.
const COINCIDENT: f64 = 0.15;
/// Nor where the refined pose has so much more support than its cautious variant.
const CLEARLY_BETTER: f64 = 0.05;
/// The start is the answer where refinement loses so much support. Soft matches may lose a little, since they
/// do not seek the nearest neighbours that support counts.
const LOST: f64 = 0.01;

/// What was decided about the refined pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The clouds fit rigidly: the refined pose is the answer.
    Rigid,
    /// Neighbouring residuals point the same way, as deformation makes them, and the best fit is then
    /// no better a guess of the motion than a good start: the answer is halfway between the start and
    /// where point to point leads from it.
    Deformed,
    /// Refinement lowered the support, so the answer is the start.
    Unsupported,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rigid => "the clouds fit rigidly",
            Self::Deformed => "the residuals look like deformation: refined by half, point to point",
            Self::Unsupported => "refinement lowered the support of the start",
        })
    }
}

/// A start after its short run; a single start has none.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StartSupport {
    /// Its name.
    pub name: String,
    /// Symmetric robust score after the short run, in [0, 1]: the mean over both clouds of
    /// `s^2 / (s^2 + r^2)`, `r` the distance to the other cloud, for `s` of 1, 0.3 and 0.1 point spacings.
    pub support: f64,
    /// The pose after the short run.
    pub target_from_source: Rigid,
}

/// A refined pose.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Refinement {
    /// The answer: `target ~ R source + t`.
    pub target_from_source: Rigid,
    /// Name of the start that won.
    pub start: String,
    /// Whether the answer is a refined pose (`true`) or the start itself.
    pub kept: bool,
    /// Why.
    pub verdict: Verdict,
    /// Whether the last stage stood still before it ran out of iterations.
    pub converged: bool,
    /// Iterations of all stages after the choice of the start.
    pub iterations: usize,
    /// Support of the answer, as in [`StartSupport::support`].
    pub support: f64,
    /// What speaks for the answer.
    pub evidence: Evidence,
    /// How the residuals of the refined pose hang together.
    pub residuals: ResidualStructure,
    /// The starts in the order given.
    pub starts: Vec<StartSupport>,
}

/// A target made ready, to refine the poses of many sources.
#[derive(Debug)]
pub struct RefineTarget {
    config: RefineConfig,
    prepared: Prepared,
}

impl RefineTarget {
    /// Centres, thins and indexes the target and estimates its normals.
    ///
    /// # Errors
    /// [`RefineError::Config`], and [`RefineError::Target`] for a cloud that determines no rotation.
    pub fn new(target: &PointCloud, config: &RefineConfig) -> Result<Self, RefineError> {
        config.validate()?;
        let prepared = Prepared::new(target, config).map_err(RefineError::Target)?;
        Ok(Self { config: *config, prepared })
    }

    /// The settings.
    pub fn config(&self) -> &RefineConfig {
        &self.config
    }

    /// What speaks for a pose as it is, without refinement.
    ///
    /// # Errors
    /// [`RefineError::Source`] for a cloud that determines no rotation.
    pub fn evidence(&self, source: &PointCloud, pose: &Rigid) -> Result<Evidence, RefineError> {
        let source = Prepared::new(source, &self.config).map_err(RefineError::Source)?;
        Ok(evidence(&source, &self.prepared, pose))
    }

    /// Refines the best of `starts`: named poses that map `source` near the target.
    ///
    /// # Errors
    /// [`RefineError::Source`] for a cloud that determines no rotation, [`RefineError::NoStart`] without
    /// starts, [`RefineError::Start`] for one that is not finite.
    pub fn refine(&self, source: &PointCloud, starts: &[(&str, Rigid)]) -> Result<Refinement, RefineError> {
        let finite = |p: &Rigid| p.rotation.iter().chain(p.translation.iter()).all(|v| v.is_finite());
        if let Some((name, _)) = starts.iter().find(|(_, pose)| !finite(pose)) {
            return Err(RefineError::Start((*name).to_owned()));
        }
        let source = Prepared::new(source, &self.config).map_err(RefineError::Source)?;
        Run { source: &source, target: &self.prepared, config: &self.config }.refine(starts)
    }
}

/// Refines the best of `starts`: named poses that map `source` near `target`.
///
/// Several starts get a short run each, on few points; the best supported one gets the full run: a
/// robust stage (nearest neighbours both ways, Geman-McClure, shrinking scale), coarse to fine for
/// large clouds, then a soft stage for small ones. Then the residuals are looked at, and the answer is
/// the refined pose, its cautious variant or the start ([`Verdict`]).
///
/// The answer does not depend on the number of threads, and on the order of the points only by
/// rounding.
///
/// # Errors
/// [`RefineError`] for clouds, settings or starts that cannot be used.
pub fn refine(
    source: &PointCloud,
    target: &PointCloud,
    starts: &[(&str, Rigid)],
    config: &RefineConfig,
) -> Result<Refinement, RefineError> {
    RefineTarget::new(target, config)?.refine(source, starts)
}

struct Run<'a> {
    source: &'a Prepared,
    target: &'a Prepared,
    config: &'a RefineConfig,
}

impl Run<'_> {
    fn refine(&self, starts: &[(&str, Rigid)]) -> Result<Refinement, RefineError> {
        let local: Vec<Rigid> = starts.iter().map(|(_, p)| to_local(p, self.source, self.target)).collect();
        let short: Vec<(Rigid, f64)> = match &local[..] {
            [only] => vec![(*only, self.support(only))],
            several => several.iter().map(|pose| self.short_run(pose)).collect(),
        };
        // The first of equals wins.
        let best = (0..short.len()).reduce(|a, b| if short[b].1 > short[a].1 { b } else { a });
        let Some(best) = best else { return Err(RefineError::NoStart) };

        let start = local[best];
        let mut stage = self.full_run(&short[best].0);
        let residuals = residual_structure(self.source.coarse(), self.target.coarse(), &stage.pose);
        let mut verdict = Verdict::Rigid;
        let mut support = self.support(&stage.pose);
        let deformed = residuals.normal_correlation > DEFORMED_CORRELATION && residuals.median > COINCIDENT;
        // Neighbours in large clouds sample one smooth surface: their residuals always hang together.
        let small = !self.source.has_coarse() && !self.target.has_coarse();
        if self.config.check_deformation && small && deformed {
            let cautious = self.cautious_run(&start);
            // A pose that brings so much more together is right, whatever the residuals look like.
            if support < self.support(&cautious.pose) + CLEARLY_BETTER {
                verdict = Verdict::Deformed;
                stage = halfway(&start, &cautious);
                support = self.support(&stage.pose);
            }
        }
        let unrefined = self.support(&start);
        if verdict == Verdict::Rigid && support < unrefined - LOST {
            verdict = Verdict::Unsupported;
            stage.pose = start;
            support = unrefined;
        }
        let answer = match verdict {
            Verdict::Unsupported => starts[best].1,
            _ => to_global(&stage.pose, self.source, self.target),
        };
        Ok(Refinement {
            target_from_source: answer,
            start: starts[best].0.to_owned(),
            kept: verdict != Verdict::Unsupported,
            verdict,
            converged: stage.converged,
            iterations: stage.iterations,
            support,
            evidence: evidence(self.source, self.target, &answer),
            residuals,
            starts: starts
                .iter()
                .zip(&short)
                .map(|((name, _), (pose, support))| StartSupport {
                    name: (*name).to_owned(),
                    support: *support,
                    target_from_source: to_global(pose, self.source, self.target),
                })
                .collect(),
        })
    }

    /// A few iterations on the coarse level, and the support there.
    fn short_run(&self, start: &Rigid) -> (Rigid, f64) {
        let (s, t) = (self.source.coarse(), self.target.coarse());
        let schedule = Schedule {
            iterations: self.config.start_iterations,
            first_stride: s.points().len().max(t.points().len()).div_ceil(512),
            ..Schedule::new(s, t, start, self.target.radius, self.config)
        };
        let stage = self.descend_on(false, start, &schedule, self.config.metric);
        (stage.pose, self.support(&stage.pose))
    }

    fn support(&self, pose: &Rigid) -> f64 {
        let (s, t) = (self.source.coarse(), self.target.coarse());
        support(s, t, pose, s.spacing.max(t.spacing))
    }

    /// Coarse, fine, soft.
    fn full_run(&self, start: &Rigid) -> Stage {
        let config = self.config;
        let two_levels = self.source.has_coarse() || self.target.has_coarse();
        let (s, t) = (self.source.coarse(), self.target.coarse());
        let schedule = Schedule::new(s, t, start, self.target.radius, config);
        let mut stage = self.descend_on(false, start, &schedule, config.metric);
        if two_levels {
            let (s, t) = (self.source.fine(), self.target.fine());
            let schedule = Schedule::new(s, t, &stage.pose, self.target.radius, config);
            stage = after(stage, self.descend_on(true, &stage.pose, &schedule, config.metric));
        }
        let (s, t) = (self.source.fine(), self.target.fine());
        if config.soft && s.points().len().max(t.points().len()) <= config.soft_points {
            stage = after(stage, soft(s, t, &stage.pose, self.target.radius, config.tolerance));
        }
        stage
    }

    /// Point to point down to three tenths of the spacing: moves little where there is no exact fit.
    fn cautious_run(&self, start: &Rigid) -> Stage {
        let (s, t) = (self.source.coarse(), self.target.coarse());
        let schedule = Schedule::new(s, t, start, self.target.radius, self.config);
        let schedule = Schedule { end: 0.6 * schedule.end, ..schedule };
        self.descend_on(false, start, &schedule, Metric::PointToPoint)
    }

    fn descend_on(&self, fine: bool, start: &Rigid, schedule: &Schedule, metric: Metric) -> Stage {
        let (s, t) = if fine {
            (self.source.fine(), self.target.fine())
        } else {
            (self.source.coarse(), self.target.coarse())
        };
        descend(s, t, start, self.target.radius, metric, schedule, self.config.tolerance)
    }
}

/// Halfway from `start` to where `stage` ended. Their errors differ, so that the mean has less of either: on sheared
/// and warped training pairs it is closer to the truth than both.
fn halfway(start: &Rigid, stage: &Stage) -> Stage {
    let end = &stage.pose;
    match Rigid::nearest_rotation(&(0.5 * (start.rotation + end.rotation))) {
        Some(rotation) => {
            let translation = 0.5 * (start.translation + end.translation);
            Stage { pose: Rigid { rotation, translation }, ..*stage }
        }
        None => *stage,
    }
}

fn after(first: Stage, then: Stage) -> Stage {
    Stage { iterations: first.iterations + then.iterations, ..then }
}
