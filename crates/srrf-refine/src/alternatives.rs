//! [`Alternative`]: poses that may fit as well as the answer.

use nalgebra::{DMatrix, DVector, Rotation3, UnitQuaternion, Vector3, Vector6};
use rayon::prelude::*;
use serde::Serialize;
use srrf_cloud::Rigid;

use crate::chance::trials;
use crate::elsewhere::elsewhere;
use crate::freedom::{FreeMotion, Freedom, margin};
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
/// The logarithm of a weight grows by so much with that of the rank. On meshes that look alike from several sides, seen or sampled
/// badly, a pose with a rival of 0.97 of its rank is right in two cases of three, one with a rival of 0.9 in nine of ten.
const BY_RANK: f64 = 30.0;
/// Logarithms of weights are kept within these.
const LOG_WEIGHTS: [f64; 2] = [-20.0, 6.0];
/// A motion is part of an open one where no more than this share of it points elsewhere.
const ASIDE: f64 = 0.35;
/// An open motion goes on up to this factor beyond where it was seen to end: the next step that was tried is 1.25 times as far.
const BEYOND: f64 = 1.25;

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

/// Poses that were reached from elsewhere, and how they compare with the one that they challenge; between the centred clouds.
#[derive(Debug, Clone)]
pub struct Challengers {
    of: Rigid,
    reached: Vec<Alternative>,
}

impl Challengers {
    /// Those of `local`, between the centred clouds: among `turned`, by shifts where points lie on points, and by turns about the middle
    /// of the overlap.
    pub(crate) fn new(run: &RefineRun<'_>, local: &Rigid, turned: Vec<Rigid>) -> Self {
        let arena = Arena::new(run, local);
        let mut starts = turned;
        starts.extend(shifts(&arena.probe, local));
        starts.extend(elsewhere(&arena.probe, local, &arena.centre, arena.radius));
        Self { of: *local, reached: arena.reach(&starts) }
    }

    /// These, and what `rivals` come to, which are between the inputs; without those that only move along what is open anyway. Best first.
    pub(crate) fn alternatives(
        &self,
        run: &RefineRun<'_>,
        freedom: &Freedom,
        rivals: &[Rigid],
    ) -> Vec<Alternative> {
        let arena = Arena::new(run, &self.of);
        let away = |local: &Rigid| arena.displaced(local).norm() > APART * arena.radius;
        let rivals: Vec<Rigid> = rivals.iter().map(|r| run.local(r)).filter(away).take(RIVALS).collect();
        let reached = [self.reached.clone(), arena.reach(&rivals)].concat();
        let mut kept = arena.apart(&reached, freedom);
        for one in &mut kept {
            one.target_from_source = run.global(&one.target_from_source);
        }
        kept
    }
}

/// A pose that others are compared with.
struct Arena<'a> {
    run: &'a RefineRun<'a>,
    pose: Rigid,
    probe: Probe<'a>,
    centre: Vector3<f64>,
    radius: f64,
    found: Shares,
    trials: [f64; 2],
    rank: f64,
}

impl<'a> Arena<'a> {
    fn new(run: &'a RefineRun<'a>, pose: &Rigid) -> Self {
        let probe = Probe::new(run.source, run.target);
        let (centre, radius) = probe.overlap(pose);
        let (found, trials) = (probe.shares(pose), trials(&probe, pose));
        Self { run, pose: *pose, centre, radius, found, trials, rank: run.rank(pose).max(1e-3), probe }
    }

    fn displaced(&self, other: &Rigid) -> Vector6<f64> {
        motion(&self.pose, other, &self.centre, self.radius)
    }

    /// Where the starts end, and how that compares.
    fn reach(&self, starts: &[Rigid]) -> Vec<Alternative> {
        let reach = |start: &Rigid| {
            let short = self.run.short_run(start);
            let rough = self.run.rank(&short) / self.rank;
            if rough < SUPPORTED {
                return Alternative { target_from_source: short, rank: rough, log_weight: LOG_WEIGHTS[0] };
            }
            let end = self.run.medium_run(&short, ITERATIONS);
            let shares = self.probe.shares(&end);
            let beyond =
                |better: &Shares, worse: &Shares| (margin(better, worse, self.trials) - NOISE).max(0.0);
            let rank = self.run.rank(&end) / self.rank;
            let by_shares = beyond(&shares, &self.found) - beyond(&self.found, &shares);
            let log_weight = by_shares + BY_RANK * rank.max(f64::MIN_POSITIVE).ln();
            let log_weight = log_weight.clamp(LOG_WEIGHTS[0], LOG_WEIGHTS[1]);
            Alternative { target_from_source: end, rank, log_weight }
        };
        starts.par_iter().map(reach).collect()
    }

    /// Those that are other poses, each once.
    fn apart(&self, reached: &[Alternative], freedom: &Freedom) -> Vec<Alternative> {
        let span = Span::new(freedom, self.radius);
        let mut kept: Vec<Alternative> = Vec::new();
        let mut order: Vec<&Alternative> = reached.iter().collect();
        order.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight).then(b.rank.total_cmp(&a.rank)));
        let least = APART * self.radius;
        for one in order {
            let moved = self.displaced(&one.target_from_source);
            let same = |other: &Alternative| {
                let between =
                    motion(&other.target_from_source, &one.target_from_source, &self.centre, self.radius);
                between.norm() <= least || span.holds(&between)
            };
            if moved.norm() > least && !span.holds(&moved) && !kept.iter().any(same) {
                kept.push(*one);
            }
        }
        kept
    }
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
    // By the quaternion: of two poses that are one, the trace may be above 3, which has no arc cosine.
    let rotation = Rotation3::from_matrix_unchecked(between.rotation);
    let turn = UnitQuaternion::from_rotation_matrix(&rotation).scaled_axis() * radius;
    let shift = Vector3::from(between.apply(&(*centre).into())) - centre;
    Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
}

/// The motions that are open, as far as they are.
struct Span<'a> {
    open: &'a [FreeMotion],
    /// One column each.
    columns: DMatrix<f64>,
    /// Of the columns, transposed.
    inverse: DMatrix<f64>,
}

impl<'a> Span<'a> {
    fn new(freedom: &'a Freedom, radius: f64) -> Self {
        let open = &freedom.open;
        let columns = DMatrix::from_fn(6, open.len(), |i, j| {
            let twist = &open[j].twist;
            if i < 3 { twist.rotation[i] * radius } else { twist.translation[i - 3] }
        });
        // An empty matrix has no singular values to ask for.
        let none = || DMatrix::zeros(open.len(), 6);
        let inverse = if open.is_empty() {
            none()
        } else {
            columns.clone().pseudo_inverse(1e-9).unwrap_or_else(|_| none())
        };
        Self { open, columns, inverse }
    }

    /// Whether a motion is one of them: none of it points elsewhere, and it goes no farther than they do. The pose on the other side of a
    /// body, half a turn about an axis about which a few degrees are open, is another one.
    fn holds(&self, motion: &Vector6<f64>) -> bool {
        if self.open.is_empty() {
            return false;
        }
        let motion = DVector::from_iterator(6, motion.iter().copied());
        let steps = &self.inverse * &motion;
        let rest = &motion - &self.columns * &steps;
        let within = |(open, step): (&FreeMotion, &f64)| {
            open.unbounded || (BEYOND * open.from..=BEYOND * open.to).contains(step)
        };
        rest.norm() <= ASIDE * motion.norm() && self.open.iter().zip(steps.iter()).all(within)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twist::{MotionKind, Twist};

    #[test]
    fn one_pose_is_no_two() {
        // Compositions with the inverse round to traces on either side of 3.
        for i in 0..200 {
            let angles = [0.37 * f64::from(i), 1.0 + 0.11 * f64::from(i), 2.0 - 0.23 * f64::from(i)];
            let rotation = *Rotation3::from_euler_angles(angles[0], angles[1], angles[2]).matrix();
            let pose = Rigid { rotation, translation: Vector3::new(1.0, 2.0, 3.0) };
            let moved = motion(&pose, &pose, &Vector3::new(0.2, 0.1, -0.4), 1.5).norm();
            assert!(moved < 1e-6, "{i}: {moved}");
        }
    }

    #[test]
    fn half_a_turn_is_another_pose_where_only_a_few_degrees_are_open() {
        let open = |from: f64, to: f64, unbounded| FreeMotion {
            twist: Twist::scaled(&Vector6::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0), 2.0, Vector3::zeros()),
            kind: MotionKind::Turn,
            from,
            to,
            unbounded,
            certain_share: 0.1,
        };
        let holds = |motion: FreeMotion, degrees: f64| {
            let freedom = Freedom { open: vec![motion], least_margin: 1.0 };
            let turned = Vector6::new(0.0, 0.0, 2.0 * degrees.to_radians(), 0.0, 0.0, 0.0);
            Span::new(&freedom, 2.0).holds(&turned)
        };
        // A step moves by its length: 0.35 are 10 degrees at a radius of 2.
        assert!(holds(open(-0.35, 0.35, false), 9.0) && holds(open(-0.35, 0.35, false), -12.0));
        assert!(!holds(open(-0.35, 0.35, false), 180.0) && !holds(open(-0.1, 0.35, false), -9.0));
        assert!(holds(open(-4.0, 4.0, true), 180.0));
        let aside = Vector6::new(0.0, 0.1, 0.1, 0.0, 0.0, 0.0);
        let freedom = Freedom { open: vec![open(-4.0, 4.0, true)], least_margin: 1.0 };
        assert!(!Span::new(&freedom, 2.0).holds(&aside));
        assert!(!Span::new(&Freedom { open: Vec::new(), least_margin: 1.0 }, 2.0).holds(&aside));
    }
}
