//! [`Refinement`]: the best of several starts, refined, with the evidence for it.

use rayon::prelude::*;
use serde::Serialize;
use srrf_cloud::Rigid;

use crate::affine::{AffineFit, affine_fit};
use crate::deformation::{ResidualStructure, residual_structure};
use crate::evidence::{Evidence, evidence};
use crate::matching::{BothSides, both_sides, plane_support, support};
use crate::prepared::{CloudLevel, RefineCloud};
use crate::robust::{Descent, ScaleSchedule, descend};
use crate::soft::soft;
use crate::verdict::{self, Verdict};
use crate::{Deformed, Metric, Ranking, RefineConfig, RefineError};

/// Points of each cloud that a first look at a start asks.
const GLANCE_POINTS: usize = 400;

/// A start after its short run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StartSupport {
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
    /// Number of the start that the answer comes from: the best supported one, but where the clouds look deformed.
    pub start: usize,
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
pub(crate) struct RefineRun<'a> {
    pub source: &'a RefineCloud,
    pub target: &'a RefineCloud,
    pub config: &'a RefineConfig,
}

impl RefineRun<'_> {
    /// Short runs of all starts, or just the support of a single one.
    pub fn shortlist(&self, starts: &[Rigid]) -> Vec<StartSupport> {
        let run = |given: &Rigid, short: bool| {
            let local = self.local(given);
            let pose = if short { self.short_run(&local) } else { local };
            let target_from_source = if short { self.global(&pose) } else { *given };
            let (support, rank) = self.support_and_rank(&pose);
            StartSupport { given: *given, support, rank, target_from_source }
        };
        match starts {
            [only] => vec![run(only, false)],
            several => several.par_iter().map(|start| run(start, true)).collect(),
        }
    }

    /// How much a start brings together as it is, in [0, 1]: the mean over some points of both clouds of `s^2 / (s^2 + r^2)`, for
    /// `s` of two point spacings, since a start is not exact.
    pub fn glance(&self, start: &Rigid) -> f64 {
        let (s, t) = (self.source.coarse(), self.target.coarse());
        let scale = 2.0 * s.spacing.max(t.spacing);
        let stride = s.points().len().max(t.points().len()).div_ceil(GLANCE_POINTS);
        let pose = self.local(start);
        let inverse = pose.inverse();
        let mean = |points: &[[f64; 3]], other: &CloudLevel, pose: &Rigid| {
            let near = |p: &[f64; 3]| scale * scale / (scale * scale + other.index.nearest(&pose.apply(p)).1);
            points.iter().step_by(stride).map(near).sum::<f64>() / points.len().div_ceil(stride) as f64
        };
        0.5 * (mean(s.points(), t, &pose) + mean(t.points(), s, &inverse))
    }

    /// Support of a pose between the centred clouds, and what it is compared by.
    fn support_and_rank(&self, pose: &Rigid) -> (f64, f64) {
        let (matches, spacing) = self.coarse_matches(pose);
        let support = support(&matches, spacing);
        let rank = match self.config.ranking {
            Ranking::Points => support,
            Ranking::Planes => plane_support(&matches, spacing),
        };
        (support, rank)
    }

    /// What a pose between the centred clouds is compared by.
    pub(crate) fn rank(&self, pose: &Rigid) -> f64 {
        self.support_and_rank(pose).1
    }

    /// More iterations on the coarse level, from near the end.
    pub(crate) fn medium_run(&self, start: &Rigid, iterations: usize) -> Rigid {
        let (s, t) = (self.source.coarse(), self.target.coarse());
        let schedule = ScaleSchedule::new(s, t, start, self.target.radius, self.config);
        let schedule = ScaleSchedule { start: 2.0 * schedule.end, iterations, ..schedule };
        self.descend_on(false, start, &schedule, self.config.metric).pose
    }

    /// The full run of the best of `starts`, and what to make of it.
    pub fn finish(&self, starts: &[StartSupport]) -> Result<Refinement, RefineError> {
        let best = StartSupport::best(starts).ok_or(RefineError::NoStart)?;
        let full = self.full_run(&self.local(&starts[best].target_from_source));
        let looks = self.look(&starts[best], &full.pose);

        let cautious = looks.deformed().then(|| self.cautious_run(&self.local(&starts[best].given)));
        let reached = match cautious {
            Some(cautious) if !self.stands(&looks, &cautious.pose) => self.deformed(starts, best, cautious),
            _ => self.rigid(&starts[best].given, best, full, looks.support),
        };
        Ok(Refinement {
            target_from_source: reached.answer,
            start: reached.start,
            kept: reached.answer != starts[reached.start].given,
            verdict: reached.verdict,
            converged: reached.descent.converged,
            iterations: reached.descent.iterations,
            support: reached.support,
            evidence: evidence(self.source, self.target, &reached.answer),
            residuals: looks.residuals,
            affine: looks.affine,
            starts: starts.to_vec(),
        })
    }

    /// Looks at the residuals of the pose that the full run of `start` reached, and for an affine map that fits better.
    fn look(&self, start: &StartSupport, pose: &Rigid) -> Looks {
        let (config, support) = (self.config, self.support(pose));
        let residuals = residual_structure(self.source.coarse(), self.target.coarse(), pose);
        // Neighbours in large clouds sample one smooth surface: their residuals always hang together.
        let small = !self.source.has_coarse() && !self.target.has_coarse();
        let asked = config.check_deformation && small && verdict::are_two_samplings(&residuals);
        let bent = asked && verdict::look_bent(&residuals, config.deformed);
        let wandered = verdict::wandered(&start.given, &self.global(pose), config.deformed);
        let affine = (asked && !bent && config.deformed == Deformed::Start)
            .then(|| affine_fit(self.source.coarse(), self.target.coarse(), pose, support));
        let sheared = affine.is_some_and(|fit| verdict::look_sheared(&fit, wandered));
        Looks { support, residuals, affine, bent, sheared, wandered }
    }

    /// Whether the refined pose stands although the clouds look deformed in it: it brings so much more together than its cautious
    /// variant. A pose that wandered, or that an affine map betters, does not.
    fn stands(&self, looks: &Looks, cautious: &Rigid) -> bool {
        !looks.wandered && !looks.sheared && verdict::clearly_better(looks.support, self.support(cautious))
    }

    /// The answer where the clouds look deformed: no support tells the starts apart then.
    fn deformed(&self, starts: &[StartSupport], best: usize, cautious: Descent) -> Reached {
        let from = match self.config.deformed {
            Deformed::Start => 0,
            Deformed::Halfway => {
                let near = |s: &StartSupport| verdict::same_guess(&s.given, &starts[best].given);
                starts.iter().position(near).unwrap_or(best)
            }
        };
        let given = self.local(&starts[from].given);
        let (descent, answer) = match self.config.deformed {
            Deformed::Start => (Descent { pose: given, ..cautious }, starts[from].given),
            Deformed::Halfway => {
                let halfway = halfway(&given, &cautious);
                (halfway, self.global(&halfway.pose))
            }
        };
        Reached {
            verdict: Verdict::Deformed,
            start: from,
            support: self.support(&descent.pose),
            answer,
            descent,
        }
    }

    /// The answer where they do not: the refined pose, or the start where that has more support.
    fn rigid(&self, given: &Rigid, best: usize, full: Descent, support: f64) -> Reached {
        let of_start = self.support(&self.local(given));
        let (verdict, support, answer) = if verdict::lost_support(support, of_start) {
            (Verdict::Unsupported, of_start, *given)
        } else {
            (Verdict::Rigid, support, self.global(&full.pose))
        };
        Reached { verdict, start: best, support, answer, descent: full }
    }

    /// A pose between the inputs as one between the centred clouds.
    pub(crate) fn local(&self, pose: &Rigid) -> Rigid {
        self.source.frame_to(self.target).pose(pose)
    }

    /// The way back from [`RefineRun::local`].
    pub(crate) fn global(&self, pose: &Rigid) -> Rigid {
        self.source.frame_to(self.target).undo_pose(pose)
    }

    /// A few iterations on the coarse level.
    pub(crate) fn short_run(&self, start: &Rigid) -> Rigid {
        let (s, t) = (self.source.coarse(), self.target.coarse());
        let schedule = ScaleSchedule {
            iterations: self.config.start_iterations,
            first_stride: s.points().len().max(t.points().len()).div_ceil(512),
            ..ScaleSchedule::new(s, t, start, self.target.radius, self.config)
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
    fn full_run(&self, start: &Rigid) -> Descent {
        let config = self.config;
        let two_levels = self.source.has_coarse() || self.target.has_coarse();
        let (s, t) = (self.source.coarse(), self.target.coarse());
        let mut schedule = ScaleSchedule::new(s, t, start, self.target.radius, config);
        if two_levels {
            schedule = schedule.loosened(s.spacing.max(t.spacing), 0.05, 0.01);
        }
        let mut stage = self.descend_on(false, start, &schedule, config.metric);
        if two_levels {
            let (s, t) = (self.source.fine(), self.target.fine());
            let schedule = ScaleSchedule {
                first_stride: s.points().len().max(t.points().len()).div_ceil(4096),
                ..ScaleSchedule::new(s, t, &stage.pose, self.target.radius, config)
            }
            .loosened(s.spacing.max(t.spacing), 0.01, 5e-4);
            stage = after(stage, self.descend_on(true, &stage.pose, &schedule, config.metric));
        }
        let (s, t) = (self.source.fine(), self.target.fine());
        if config.soft && s.points().len().max(t.points().len()) <= config.soft_points {
            stage = after(stage, soft(s, t, &stage.pose, self.target.radius, config.tolerance));
        }
        stage
    }

    /// Point to point down to three tenths of the spacing: moves little where there is no exact fit.
    fn cautious_run(&self, start: &Rigid) -> Descent {
        let (s, t) = (self.source.coarse(), self.target.coarse());
        let schedule = ScaleSchedule::new(s, t, start, self.target.radius, self.config);
        let schedule = ScaleSchedule { end: 0.6 * schedule.end, ..schedule };
        self.descend_on(false, start, &schedule, Metric::PointToPoint)
    }

    fn descend_on(&self, fine: bool, start: &Rigid, schedule: &ScaleSchedule, metric: Metric) -> Descent {
        let (s, t) = if fine {
            (self.source.fine(), self.target.fine())
        } else {
            (self.source.coarse(), self.target.coarse())
        };
        descend(s, t, start, self.target.radius, metric, schedule)
    }
}

/// What the refined pose looks like.
struct Looks {
    support: f64,
    residuals: ResidualStructure,
    affine: Option<AffineFit>,
    bent: bool,
    sheared: bool,
    wandered: bool,
}

impl Looks {
    fn deformed(&self) -> bool {
        self.bent || self.sheared
    }
}

/// What was decided.
struct Reached {
    verdict: Verdict,
    /// Number of the start that the answer comes from.
    start: usize,
    support: f64,
    answer: Rigid,
    descent: Descent,
}

/// Halfway from `start` to where `stage` ended. Their errors differ, so that the mean has less of either: on sheared
/// and warped training pairs it is closer to the truth than both.
fn halfway(start: &Rigid, stage: &Descent) -> Descent {
    let end = &stage.pose;
    match Rigid::nearest_rotation(&(0.5 * (start.rotation + end.rotation))) {
        Some(rotation) => {
            let translation = 0.5 * (start.translation + end.translation);
            Descent { pose: Rigid { rotation, translation }, ..*stage }
        }
        None => *stage,
    }
}

fn after(first: Descent, then: Descent) -> Descent {
    Descent { iterations: first.iterations + then.iterations, ..then }
}
