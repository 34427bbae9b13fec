//! [`FreeMotion`]: which of the six motions of a rigid pose the fit leaves open.

use nalgebra::{DMatrix, Matrix6, Vector3, Vector6};
use rayon::prelude::*;
use serde::Serialize;
use srrf_cloud::Rigid;

use crate::chance::trials;
use crate::matching::{Partners, equations};
use crate::probe::{Probe, SCALES, Shares, divergence};
use crate::twist::{MotionKind, Twist};

/// Moved poses whose shares are less likely than `exp(-MARGIN)` under those of the pose fit worse.
const MARGIN: f64 = 5.0;
/// Points that count on their own, of those that do by [`trials`]: neighbours share their luck.
const INDEPENDENT: f64 = 0.5;
/// A motion by this share of the overlap's radius is the least that matters: 5 degrees.
const MATTERS: f64 = 0.09;
/// ... but not less than so many spacings, within which points that coincide pull back.
const LEAST_SPACINGS: f64 = 1.5;
/// Farther than so many radii nothing is tried.
const FARTHEST: f64 = 2.0;
/// Matches within so many spacings count for the directions.
const NEAR: f64 = 2.0;
/// A direction in a space of motions is a slide where its rotation is smaller than this.
const NO_TURN: f64 = 0.35;

/// A motion that the fit leaves open: moved along it, the clouds fit as well.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FreeMotion {
    /// The motion, after the pose, in the target frame.
    pub twist: Twist,
    /// Its kind.
    pub kind: MotionKind,
    /// How far it may go, in steps of the twist: from (at most 0).
    pub from: f64,
    /// To (at least 0).
    pub to: f64,
    /// Whether it goes on for as far as was tried.
    pub unbounded: bool,
    /// Share of this range that lies within 5 degrees and a tenth of the radius of the pose.
    pub certain_share: f64,
}

/// What the fit determines.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Freedom {
    /// The motions that it leaves open.
    pub open: Vec<FreeMotion>,
    /// How much worse the pose fits when moved as far as matters, in the direction in which that is least: a difference of
    /// log-likelihoods.
    pub least_margin: f64,
}

impl Freedom {
    /// Share of all that is open that lies near the pose: 1 where nothing is.
    pub fn certain_share(&self) -> f64 {
        self.open.iter().map(|motion| motion.certain_share).product()
    }

    /// [`Self::certain_share`] of the unbounded motions alone.
    pub fn unbounded_share(&self) -> f64 {
        self.open.iter().filter(|motion| motion.unbounded).map(|motion| motion.certain_share).product()
    }
}

/// How much the shares of a pose speak against those of another one, whose points are as many.
pub(crate) fn margin(found: &Shares, moved: &Shares, trials: [f64; 2]) -> f64 {
    let one = |side: usize, scale: usize| {
        // One point by chance, where none was seen.
        let expected = moved[side][scale].max(1.0 / trials[side].max(2.0)).min(1.0 - 1e-9);
        INDEPENDENT * trials[side] * divergence(found[side][scale], expected)
    };
    let all = (0..2).flat_map(|side| (0..SCALES.len()).map(move |scale| one(side, scale)));
    all.fold(0.0, f64::max)
}

/// Measures `pose`.
pub(crate) fn freedom(probe: &Probe<'_>, pose: &Rigid) -> Freedom {
    let (centre, radius) = probe.overlap(pose);
    if !(radius > 0.0 && radius.is_finite()) {
        return Freedom { open: Vec::new(), least_margin: 0.0 };
    }
    let walk = Stroll {
        probe,
        pose,
        found: probe.shares_within(pose).0,
        trials: trials(probe, pose),
        first: (MATTERS * radius).max(LEAST_SPACINGS * probe.source.spacing.max(probe.target.spacing)),
        matters: MATTERS * radius,
        farthest: FARTHEST * radius,
    };
    let directions = directions(probe, pose, &centre, radius);
    let margins: Vec<f64> =
        directions.par_iter().map(|d| walk.nearest_margin(&Twist::scaled(d, radius, centre))).collect();
    let open: Vec<Vector6<f64>> =
        directions.iter().zip(&margins).filter(|(_, m)| **m < MARGIN).map(|(d, _)| *d).collect();
    let open = plain(&open).into_iter().map(|d| walk.range(&Twist::scaled(&d, radius, centre), radius));
    Freedom { open: open.collect(), least_margin: margins.iter().copied().fold(f64::INFINITY, f64::min) }
}

/// Six directions, rotation times `radius` first, about `centre`: the axes of the information along the normals.
fn directions(probe: &Probe<'_>, pose: &Rigid, centre: &Vector3<f64>, radius: f64) -> Vec<Vector6<f64>> {
    let near = (NEAR * probe.source.spacing.max(probe.target.spacing)).powi(2);
    let stride = probe.source.points().len().max(probe.target.points().len()).div_ceil(1024);
    let partners = Partners::find(probe.source, probe.target, pose, stride);
    let sums = equations(probe.source, probe.target, pose, &partners, |m| {
        ((m.moved - m.fixed).norm_squared() <= near).then_some((0.0, 1.0))
    });
    // A turn about c is the turn about the origin and the shift -omega x c = [c]x omega.
    let mut change = Matrix6::identity();
    change.fixed_view_mut::<3, 3>(3, 0).copy_from(&centre.cross_matrix());
    let about = change.transpose() * sums.hessian * change;
    let scale = Vector6::from_fn(|i, _| if i < 3 { 1.0 / radius } else { 1.0 });
    let scaled = Matrix6::from_fn(|i, j| about[(i, j)] * scale[i] * scale[j]);
    if !scaled.iter().all(|v| v.is_finite()) {
        return (0..6).map(|i| Vector6::ith(i, 1.0)).collect();
    }
    scaled.symmetric_eigen().eigenvectors.column_iter().map(|c| c.into_owned()).collect()
}

/// The same space of motions by plain ones: slides as far as there are, then turns without them.
fn plain(open: &[Vector6<f64>]) -> Vec<Vector6<f64>> {
    if open.is_empty() {
        return Vec::new();
    }
    let space = DMatrix::from_fn(6, open.len(), |i, j| open[j][i]);
    let turns = space.rows(0, 3).into_owned();
    // Right singular vectors order the space by how much its motions turn.
    let squares = (turns.transpose() * &turns).symmetric_eigen();
    let mut order: Vec<usize> = (0..open.len()).collect();
    order.sort_by(|a, b| squares.eigenvalues[*a].total_cmp(&squares.eigenvalues[*b]));
    order
        .into_iter()
        .map(|k| {
            let mixed = &space * squares.eigenvectors.column(k);
            let mut plain = Vector6::from_fn(|i, _| mixed[i]);
            if squares.eigenvalues[k].max(0.0).sqrt() < NO_TURN {
                plain.fixed_rows_mut::<3>(0).fill(0.0);
            }
            plain.try_normalize(0.0).unwrap_or(plain)
        })
        .collect()
}

struct Stroll<'a> {
    probe: &'a Probe<'a>,
    pose: &'a Rigid,
    found: Shares,
    trials: [f64; 2],
    first: f64,
    matters: f64,
    farthest: f64,
}

impl Stroll<'_> {
    fn margin_at(&self, twist: &Twist, step: f64) -> f64 {
        let (moved, within) = self.probe.shares_within(&twist.at(step).compose(self.pose));
        margin(&self.found, &moved, [0, 1].map(|side| self.trials[side] * within[side]))
    }

    /// How much worse it fits when moved as far as matters, or up to four times as far, either way: the least of all.
    fn nearest_margin(&self, twist: &Twist) -> f64 {
        [1.0, -1.0, 2.0, -2.0, 4.0, -4.0]
            .iter()
            .map(|by| by * self.first)
            .filter(|step| step.abs() <= self.farthest.max(self.first))
            .map(|step| self.margin_at(twist, step))
            .fold(f64::INFINITY, f64::min)
    }

    /// How far it may go either way.
    fn range(&self, twist: &Twist, radius: f64) -> FreeMotion {
        let way = |sign: f64| {
            let (mut reached, mut step) = (0.0, self.first);
            while step <= self.farthest {
                if self.margin_at(twist, sign * step) < MARGIN {
                    reached = step;
                }
                step *= 1.25;
            }
            reached
        };
        let (back, forth) = rayon::join(|| way(-1.0), || way(1.0));
        let kind = twist.kind(radius);
        let unbounded = back.min(forth) * 1.25 > self.farthest;
        let width = (back + forth).max(self.matters);
        FreeMotion {
            twist: *twist,
            kind,
            from: -back,
            to: forth,
            unbounded,
            certain_share: (2.0 * self.matters / width).min(1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};
    use srrf_cloud::PointCloud;

    use super::*;
    use crate::prepared::RefineCloud;

    fn sampled(seed: u64, n: usize, at: impl Fn(f64, f64) -> [f64; 3]) -> RefineCloud {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        RefineCloud::of(&PointCloud::new((0..n).map(|_| at(rng.random(), rng.random())).collect()).unwrap())
    }

    /// Kinds of what is open between two samplings that lie on each other, and the motions.
    fn open(n: usize, at: impl Fn(f64, f64) -> [f64; 3]) -> (Vec<MotionKind>, Vec<FreeMotion>) {
        let (s, t) = (sampled(1, n, &at), sampled(2, n, &at));
        let pose = s.frame_to(&t).pose(&Rigid::identity());
        let found = freedom(&Probe::new(&s, &t), &pose);
        (found.open.iter().map(|m| m.kind).collect(), found.open)
    }

    const TAU: f64 = std::f64::consts::TAU;

    #[test]
    fn a_plane_slides_two_ways_and_turns_about_its_normal() {
        let (kinds, motions) = open(1500, |u, v| [3.0 * u, 3.0 * v, 0.0]);
        assert_eq!(kinds, [MotionKind::Slide, MotionKind::Slide, MotionKind::Turn]);
        for slide in &motions[..2] {
            let direction = slide.twist.direction(MotionKind::Slide);
            assert!(direction.z.abs() < 0.1 && slide.certain_share < 0.7, "{slide:?}");
        }
        assert!(motions[2].twist.direction(MotionKind::Turn).z.abs() > 0.99, "{motions:?}");
    }

    #[test]
    fn a_tube_turns_about_its_axis_and_a_ball_about_anything() {
        let (kinds, motions) = open(1500, |u, v| [(TAU * v).cos(), (TAU * v).sin(), 4.0 * u]);
        let turn = motions.iter().find(|m| m.kind == MotionKind::Turn).unwrap();
        assert!(turn.twist.direction(MotionKind::Turn).z.abs() > 0.99, "{kinds:?} {motions:?}");
        assert!(turn.unbounded && turn.certain_share < 0.1, "{turn:?}");
        let (kinds, _) = open(1500, |u, v| {
            let (z, r) = (2.0 * u - 1.0, (1.0 - (2.0 * u - 1.0).powi(2)).sqrt());
            [r * (TAU * v).cos(), r * (TAU * v).sin(), z]
        });
        assert_eq!(kinds, [MotionKind::Turn; 3]);
    }

    #[test]
    fn a_helix_screws() {
        let (kinds, motions) = open(1500, |u, v| {
            let turn = 6.0 * TAU * u;
            let (r, z) = (1.0 + 0.15 * (TAU * v).cos(), 6.0 * u + 0.15 * (TAU * v).sin());
            [r * turn.cos(), r * turn.sin(), z]
        });
        assert!(kinds.contains(&MotionKind::Screw), "{motions:?}");
        let screw = motions.iter().find(|m| m.kind == MotionKind::Screw).unwrap();
        assert!(screw.twist.direction(MotionKind::Screw).z.abs() > 0.98, "{screw:?}");
        assert!((screw.twist.pitch().abs() - 1.0 / TAU).abs() < 0.03, "{}", screw.twist.pitch());
    }

    #[test]
    fn a_corner_of_a_room_is_determined() {
        let (kinds, _) = open(1500, |u, v| {
            let (wall, u) = ((3.0 * u) as usize, (3.0 * u).fract());
            let mut p = [2.0 * u, 2.0 * v, 0.0];
            p.rotate_right(wall);
            // A box in the corner breaks the symmetry of its three walls.
            if wall == 0 && p[0] < 0.7 && p[1] < 1.1 { [p[0], p[1], 0.6] } else { p }
        });
        assert_eq!(kinds, []);
    }
}
