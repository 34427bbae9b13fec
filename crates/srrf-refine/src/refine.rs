//! [`Refinement`]: the best of several starts, refined, with the evidence for it.

use std::fmt;

use rayon::prelude::*;
use serde::Serialize;
use srrf_cloud::Rigid;

use crate::affine::{AffineFit, affine_fit};
use crate::deformation::{ResidualStructure, residual_structure};
use crate::evidence::{Evidence, evidence};
use crate::matching::{BothSides, both_sides, plane_support, support};
use crate::prepared::{Prepared, to_global, to_local};
use crate::robust::{Schedule, Stage, descend};
use crate::soft::soft;
use crate::{Deformed, Metric, Ranking, RefineConfig, RefineError};

/// Residuals count as deformation when they correlate with those of their neighbours in the same cloud by more than the first
/// number, and along the normals with those of their neighbours in the other cloud by more than the second. Each test alone takes
/// partial views for bent ones (`docs/experiments.md`). Where the start is no worse an answer than a halfway pose, the numbers are
/// lower: strong bends have little structure left within reach of a match.
const DEFORMED_START: (f64, f64) = (0.13, 0.04);
const DEFORMED_HALFWAY: (f64, f64) = (0.15, 0.09);
/// So does an affine map that moves the points by more than this, in point spacings, away from any rigid motion, and has more
/// support than the pose by more than the second number. Partial views of rigid shapes gain less (`docs/experiments.md`).
const SHEARED_BEND: f64 = 0.75;
const SHEARED_GAIN: f64 = 0.03;
/// Where the refinement turns by more than the first number away from the start of a method that knows shapes, a gain of the second is
/// enough: a sheared box fits as well in a wrong pose as a noisy one in the right one, but where a turn repairs the start, no affine
/// map is better.
const WANDERED_DEG: f64 = 20.0;
const WANDERED_GAIN: f64 = 0.01;
/// Not so where half of the matches are closer than this, in point spacings: the clouds then share
/// points, and what is left over are holes.
const COINCIDENT: f64 = 0.15;
/// Nor where the refined pose has so much more support than its cautious variant.
const CLEARLY_BETTER: f64 = 0.05;
/// Starts within this angle are guesses of one pose; the first of them, by the caller's order, stands for all.
const SAME_DEG: f64 = 15.0;
/// The start is the answer where refinement loses so much support. Soft matches may lose a little, since they
/// do not seek the nearest neighbours that support counts.
const LOST: f64 = 0.01;

/// What was decided about the refined pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The clouds fit rigidly: the refined pose is the answer.
    Rigid,
    /// Neighbouring residuals point the same way, as deformation makes them, or an affine map fits better; the best fit is then
    /// no better a guess of the motion than a good start: the answer is what [`crate::RefineConfig::deformed`] says.
    Deformed,
    /// Refinement lowered the support, so the answer is the start.
    Unsupported,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rigid => "the clouds fit rigidly",
            Self::Deformed => "the residuals look like deformation: no exact fit",
            Self::Unsupported => "refinement lowered the support of the start",
        })
    }
}

/// A start after its short run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StartSupport {
    /// Its name.
    pub name: String,
    /// The pose as it was given.
    pub given: Rigid,
    /// Symmetric robust score after the short run, in [0, 1]: the mean over both clouds of
    /// `s^2 / (s^2 + r^2)`, `r` the distance to the other cloud, for `s` of 1, 0.3 and 0.1 point spacings.
    pub support: f64,
    /// What it is compared by, in [0, 1]: `support`, or what [`Ranking`] says.
    pub rank: f64,
    /// The pose after the short run.
    pub target_from_source: Rigid,
}

impl StartSupport {
    /// Number of the best of `starts`, the first of equals; `None` where there are none.
    pub fn best(starts: &[Self]) -> Option<usize> {
        (0..starts.len()).reduce(|a, b| if starts[b].rank > starts[a].rank { b } else { a })
    }
}

/// A refined pose.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Refinement {
    /// The answer: `target ~ R source + t`.
    pub target_from_source: Rigid,
    /// Name of the start that the answer comes from: the best supported one, but where the clouds look deformed.
    pub start: String,
    /// Whether the answer is a refined pose (`true`) or a start as it was given.
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
    /// What an affine map fits better than the refined pose, where that was asked: of small clouds whose residuals do
    /// not look like deformation, nor as if most points were in both clouds, with [`Deformed::Start`].
    pub affine: Option<AffineFit>,
    /// The starts in the order given.
    pub starts: Vec<StartSupport>,
}

/// One source, one target.
pub(crate) struct Run<'a> {
    pub source: &'a Prepared,
    pub target: &'a Prepared,
    pub config: &'a RefineConfig,
}

impl Run<'_> {
    /// Short runs of all starts, or just the support of a single one.
    pub fn shortlist(&self, starts: &[(&str, Rigid)]) -> Vec<StartSupport> {
        let run = |(name, given): &(&str, Rigid), short: bool| {
            let local = to_local(given, self.source, self.target);
            let pose = if short { self.short_run(&local) } else { local };
            let target_from_source = if short { to_global(&pose, self.source, self.target) } else { *given };
            let (matches, spacing) = self.coarse_matches(&pose);
            let support = support(&matches, spacing);
            let rank = match self.config.ranking {
                Ranking::Points => support,
                Ranking::Planes => plane_support(&matches, spacing),
            };
            StartSupport { name: (*name).to_owned(), given: *given, support, rank, target_from_source }
        };
        match starts {
            [only] => vec![run(only, false)],
            several => several.par_iter().map(|start| run(start, true)).collect(),
        }
    }

    /// The full run of the best of `starts`, and what to make of it.
    pub fn finish(&self, starts: &[StartSupport]) -> Result<Refinement, RefineError> {
        let best = &starts[StartSupport::best(starts).ok_or(RefineError::NoStart)?];

        let start = to_local(&best.given, self.source, self.target);
        let mut stage = self.full_run(&to_local(&best.target_from_source, self.source, self.target));
        let residuals = residual_structure(self.source.coarse(), self.target.coarse(), &stage.pose);
        let mut verdict = Verdict::Rigid;
        let mut from = best;
        let mut support = self.support(&stage.pose);
        let knows_shapes = self.config.deformed == Deformed::Start;
        let wandered = knows_shapes
            && best.given.angle_to_deg(&to_global(&stage.pose, self.source, self.target)) > WANDERED_DEG;
        // Neighbours in large clouds sample one smooth surface: their residuals always hang together.
        let small = !self.source.has_coarse() && !self.target.has_coarse();
        let asked = self.config.check_deformation && small && residuals.median > COINCIDENT;
        let (near, across) = if knows_shapes { DEFORMED_START } else { DEFORMED_HALFWAY };
        let bent = residuals.correlation > near && residuals.across_correlation > across;
        let affine = (asked && knows_shapes && !bent)
            .then(|| affine_fit(self.source.coarse(), self.target.coarse(), &stage.pose, support));
        let gain = if wandered { WANDERED_GAIN } else { SHEARED_GAIN };
        let sheared = affine.is_some_and(|fit| fit.bend > SHEARED_BEND && fit.gain > gain);
        if asked && (bent || sheared) {
            let cautious = self.cautious_run(&start);
            // A pose that brings so much more together is right, whatever the residuals look like.
            if wandered || sheared || support < self.support(&cautious.pose) + CLEARLY_BETTER {
                verdict = Verdict::Deformed;
                let near = |s: &&StartSupport| s.given.angle_to_deg(&best.given) < SAME_DEG;
                from = match self.config.deformed {
                    // No support tells the starts apart where the clouds are bent.
                    Deformed::Start => &starts[0],
                    Deformed::Halfway => starts.iter().find(near).unwrap_or(best),
                };
                let given = to_local(&from.given, self.source, self.target);
                stage = match self.config.deformed {
                    Deformed::Start => Stage { pose: given, ..cautious },
                    Deformed::Halfway => halfway(&given, &cautious),
                };
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
            Verdict::Unsupported => from.given,
            Verdict::Deformed if self.config.deformed == Deformed::Start => from.given,
            _ => to_global(&stage.pose, self.source, self.target),
        };
        Ok(Refinement {
            target_from_source: answer,
            start: from.name.clone(),
            kept: answer != from.given,
            verdict,
            converged: stage.converged,
            iterations: stage.iterations,
            support,
            evidence: evidence(self.source, self.target, &answer),
            residuals,
            affine,
            starts: starts.to_vec(),
        })
    }

    /// A few iterations on the coarse level.
    fn short_run(&self, start: &Rigid) -> Rigid {
        let (s, t) = (self.source.coarse(), self.target.coarse());
        let schedule = Schedule {
            iterations: self.config.start_iterations,
            first_stride: s.points().len().max(t.points().len()).div_ceil(512),
            ..Schedule::new(s, t, start, self.target.radius, self.config)
        };
        self.descend_on(false, start, &schedule, self.config.metric).pose
    }

    fn support(&self, pose: &Rigid) -> f64 {
        let (matches, spacing) = self.coarse_matches(pose);
        support(&matches, spacing)
    }

    /// The matches of both sides on the coarse level, and the spacing there.
    fn coarse_matches(&self, pose: &Rigid) -> (BothSides, f64) {
        let (s, t) = (self.source.coarse(), self.target.coarse());
        (both_sides(s, t, pose), s.spacing.max(t.spacing))
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
