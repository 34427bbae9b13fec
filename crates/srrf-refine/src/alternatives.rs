//! [`Alternative`]: poses that may fit as well as the answer.

use nalgebra::{DMatrix, DVector, Rotation3, Vector3, Vector6};
use rayon::prelude::*;
use serde::Serialize;
use srrf_cloud::Rigid;

use crate::chance::trials;
use crate::freedom::{Freedom, margin};
use crate::probe::{Probe, Shares};
use crate::refine::RefineRun;

/// Iterations of a candidate.
const ITERATIONS: usize = 12;
/// Candidates that support less than this share of the answer's rank are not refined any further.
const SUPPORTED: f64 = 0.8;
/// Neighbours of a point that the clouds may be shifted by, where points lie on points.
const SHIFTS: usize = 18;
/// Share of the points that lie on points (within an eighth of a spacing) from which on shifts are tried.
const ON_POINTS: f64 = 0.5;
/// Rivals from elsewhere that are looked at.
const RIVALS: usize = 16;
/// Poses nearer than this, in radii moved, are one.
const APART: f64 = 0.09;
/// Two samplings of one body differ by up to this much between poses that fit as well.
const NOISE: f64 = 4.0;
/// Logarithms of weights are kept within these.
const LOG_WEIGHTS: [f64; 2] = [-20.0, 6.0];
/// A motion is part of an open one where no more than this share of it points elsewhere.
const ELSEWHERE: f64 = 0.35;

/// Another pose, and how it compares.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Alternative {
    /// The pose.
    pub target_from_source: Rigid,
    /// Its rank over that of the answer, as in [`crate::StartSupport::rank`].
    pub rank: f64,
    /// Logarithm of its weight, where the answer has 0.
    pub log_weight: f64,
}

/// Looks for poses that fit as well as `local`, between the centred clouds: among `turned`, by shifts where points lie on points, and
/// among `rivals`, which like the answers are between the inputs. Those that only move along what is open anyway are left out. Best
/// first.
pub(crate) fn alternatives(
    run: &RefineRun<'_>,
    local: &Rigid,
    turned: Vec<Rigid>,
    freedom: &Freedom,
    rivals: &[Rigid],
) -> Vec<Alternative> {
    let local = *local;
    let probe = Probe::new(run.source, run.target);
    let (centre, radius) = probe.overlap(&local);
    let (found, trials) = (probe.shares(&local), trials(&probe, &local));
    let rank = run.rank(&local).max(1e-3);
    let displaced = |other: &Rigid| motion(&local, other, &centre, radius);

    let mut starts = turned;
    starts.extend(shifts(&probe, &local));
    starts.extend(
        rivals.iter().map(|r| run.local(r)).filter(|r| displaced(r).norm() > APART * radius).take(RIVALS),
    );
    let reached: Vec<Alternative> = starts
        .par_iter()
        .map(|start| {
            let short = run.short_run(start);
            let rough = run.rank(&short) / rank;
            if rough < SUPPORTED {
                return Alternative { target_from_source: short, rank: rough, log_weight: LOG_WEIGHTS[0] };
            }
            let end = run.medium_run(&short, ITERATIONS);
            let shares = probe.shares(&end);
            let beyond = |better: &Shares, worse: &Shares| (margin(better, worse, trials) - NOISE).max(0.0);
            let log_weight = beyond(&shares, &found) - beyond(&found, &shares);
            Alternative {
                target_from_source: end,
                rank: run.rank(&end) / rank,
                log_weight: log_weight.clamp(LOG_WEIGHTS[0], LOG_WEIGHTS[1]),
            }
        })
        .collect();

    let span = Span::new(freedom, radius);
    let mut kept: Vec<Alternative> = Vec::new();
    let mut order: Vec<&Alternative> = reached.iter().collect();
    order.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight).then(b.rank.total_cmp(&a.rank)));
    for one in order {
        let moved = displaced(&one.target_from_source);
        let same = |other: &Alternative| {
            let between = motion(&other.target_from_source, &one.target_from_source, &centre, radius);
            between.norm() <= APART * radius || span.holds(&between)
        };
        if moved.norm() > APART * radius && !span.holds(&moved) && !kept.iter().any(same) {
            kept.push(*one);
        }
    }
    for one in &mut kept {
        one.target_from_source = run.global(&one.target_from_source);
    }
    kept
}

/// The pose shifted from a point in the middle of the overlap to its neighbours, where points lie on points.
fn shifts(probe: &Probe<'_>, pose: &Rigid) -> Vec<Rigid> {
    if probe.shares(pose)[0][4] < ON_POINTS {
        return Vec::new();
    }
    let (centre, _) = probe.overlap(pose);
    let index = &probe.target.index;
    let from = Vector3::from(index.points()[index.nearest(&centre.into()).0]);
    index
        .k_nearest(&from.into(), SHIFTS + 1)
        .into_iter()
        .filter(|(_, squared)| *squared > 0.0)
        .map(|(number, _)| {
            let by = Vector3::from(index.points()[number]) - from;
            Rigid { translation: pose.translation + by, ..*pose }
        })
        .collect()
}

/// The motion from one pose to another, about `centre`: the rotation vector times `radius`, then the shift of the centre.
fn motion(from: &Rigid, to: &Rigid, centre: &Vector3<f64>, radius: f64) -> Vector6<f64> {
    let between = to.compose(&from.inverse());
    let turn = Rotation3::from_matrix_unchecked(between.rotation).scaled_axis() * radius;
    let shift = Vector3::from(between.apply(&(*centre).into())) - centre;
    Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
}

/// The motions that are open.
struct Span(Option<DMatrix<f64>>);

impl Span {
    fn new(freedom: &Freedom, radius: f64) -> Self {
        let open = &freedom.open;
        if open.is_empty() {
            return Self(None);
        }
        let columns = DMatrix::from_fn(6, open.len(), |i, j| {
            let twist = &open[j].twist;
            if i < 3 { twist.rotation[i] * radius } else { twist.translation[i - 3] }
        });
        Self(Some(columns.qr().q()))
    }

    /// Whether a motion is one of them.
    fn holds(&self, motion: &Vector6<f64>) -> bool {
        let Some(basis) = &self.0 else { return false };
        let motion = DVector::from_iterator(6, motion.iter().copied());
        let rest = &motion - basis * (basis.transpose() * &motion);
        rest.norm() <= ELSEWHERE * motion.norm()
    }
}
