//! Nearest neighbours from each cloud to the other, and sums over them.

use nalgebra::Vector3;
use rayon::prelude::*;
use srrf_cloud::Rigid;

use crate::prepared::CloudLevel;
use crate::solve::{Match, NormalEquations};

/// Points of one task: sums are taken chunk by chunk and added in order, so that the answer does
/// not depend on the number of threads.
const CHUNK: usize = 1024;

/// Matches that are farther apart than this, in spacings, have no plane in common.
const ON_PLANE: f64 = 3.0;

/// Runs `work` on the chunks of `0..n`, beside each other if there are many, and gives the
/// results in order.
fn chunked<T: Send>(n: usize, work: impl Fn(std::ops::Range<usize>) -> T + Sync) -> Vec<T> {
    let chunk = |c: usize| work(c * CHUNK..((c + 1) * CHUNK).min(n));
    let chunks = n.div_ceil(CHUNK);
    if chunks <= 4 {
        (0..chunks).map(chunk).collect()
    } else {
        (0..chunks).into_par_iter().map(chunk).collect()
    }
}

/// Which points look for a match.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// Each source point, among the target's.
    Source,
    /// Each target point, among the source's.
    Target,
}

/// The match of the `i`-th point of a side, after its index in the other cloud.
pub(crate) fn nearest(
    source: &CloudLevel,
    target: &CloudLevel,
    pose: &Rigid,
    inverse: &Rigid,
    side: Side,
    i: usize,
) -> (usize, Match) {
    match side {
        Side::Source => {
            let (j, _) = target.index.nearest(&pose.apply(&source.points()[i]));
            (j, from_source(source, target, pose, i, j))
        }
        Side::Target => {
            let (j, _) = source.index.nearest(&inverse.apply(&target.points()[i]));
            (j, from_target(source, target, pose, i, j))
        }
    }
}

/// The matches of a side, in the order of its points, each after its index in the other cloud.
pub(crate) fn side_matches(
    source: &CloudLevel,
    target: &CloudLevel,
    pose: &Rigid,
    side: Side,
) -> Vec<(usize, Match)> {
    let n = if side == Side::Source { source.points().len() } else { target.points().len() };
    let inverse = pose.inverse();
    let parts = chunked(n, |range| {
        range.map(|i| nearest(source, target, pose, &inverse, side, i)).collect::<Vec<_>>()
    });
    parts.concat()
}

/// Which points of the other cloud the points of both sides are matched with, every `stride`-th point of a side.
pub(crate) struct Partners {
    pub stride: usize,
    of_source: Vec<usize>,
    of_target: Vec<usize>,
}

impl Partners {
    /// Looks for the nearest points.
    pub fn find(source: &CloudLevel, target: &CloudLevel, pose: &Rigid, stride: usize) -> Self {
        let inverse = pose.inverse();
        let [of_source, of_target] = [Side::Source, Side::Target].map(|side| {
            let n = if side == Side::Source { source.points().len() } else { target.points().len() };
            chunked(n.div_ceil(stride), |range| {
                range.map(|i| nearest(source, target, pose, &inverse, side, i * stride).0).collect::<Vec<_>>()
            })
            .concat()
        });
        Self { stride, of_source, of_target }
    }
}

/// Normal equations over these matches. `weigh` gives the metric `(a, b)` of a match, or `None` to leave it out.
pub(crate) fn equations(
    source: &CloudLevel,
    target: &CloudLevel,
    pose: &Rigid,
    partners: &Partners,
    weigh: impl Fn(&Match) -> Option<(f64, f64)> + Sync,
) -> NormalEquations {
    let stride = partners.stride;
    let mut sums = NormalEquations::default();
    let mut add_all = |n: usize, found: &(dyn Fn(usize) -> Match + Sync)| {
        let parts = chunked(n, |range| {
            let mut part = NormalEquations::default();
            for i in range {
                let found = found(i);
                if let Some((a, b)) = weigh(&found) {
                    part.add(&found, a, b);
                }
            }
            part
        });
        parts.iter().for_each(|part| sums.merge(part));
    };
    add_all(partners.of_source.len(), &|i| {
        from_source(source, target, pose, i * stride, partners.of_source[i])
    });
    add_all(partners.of_target.len(), &|i| {
        from_target(source, target, pose, i * stride, partners.of_target[i])
    });
    sums
}

/// The match of source point `i` with target point `j`.
fn from_source(source: &CloudLevel, target: &CloudLevel, pose: &Rigid, i: usize, j: usize) -> Match {
    let moved = pose.apply(&source.points()[i]).into();
    Match { moved, fixed: target.points()[j].into(), normal: target.normals[j] }
}

/// The match of target point `i` with source point `j`.
fn from_target(source: &CloudLevel, target: &CloudLevel, pose: &Rigid, i: usize, j: usize) -> Match {
    let moved = pose.apply(&source.points()[j]).into();
    Match { moved, fixed: target.points()[i].into(), normal: pose.rotation * source.normals[j] }
}

/// The matches of both sides, source first, as [`side_matches`] gives them.
pub(crate) type BothSides = [Vec<(usize, Match)>; 2];

/// The matches of both sides.
pub(crate) fn both_sides(source: &CloudLevel, target: &CloudLevel, pose: &Rigid) -> BothSides {
    [Side::Source, Side::Target].map(|side| side_matches(source, target, pose, side))
}

/// Squared distances of matches.
fn squared_distances(matches: &BothSides) -> [Vec<f64>; 2] {
    let squared = |(_, m): &(usize, Match)| (m.moved - m.fixed).norm_squared();
    matches.each_ref().map(|side| side.iter().map(squared).collect())
}

/// Median distance over the matches of both sides.
pub(crate) fn median_distance(source: &CloudLevel, target: &CloudLevel, pose: &Rigid) -> f64 {
    let [mut all, more] = squared_distances(&both_sides(source, target, pose));
    all.extend(more);
    let middle = all.len() / 2;
    all.select_nth_unstable_by(middle, f64::total_cmp).1.sqrt()
}

/// How well a pose is supported, by [`support_of`] the distances of its matches.
pub(crate) fn support(matches: &BothSides, spacing: f64) -> f64 {
    let [from_source, from_target] = squared_distances(matches);
    support_of(&from_source, &from_target, spacing)
}

/// Support in [0, 1] by the distances along the normals, `s^2 / (s^2 + r^2)` with `s` half a `spacing`, the mean over both clouds: two
/// samplings of one surface share its planes and not their points. Beyond [`ON_PLANE`] spacings a plane says nothing, and the
/// distance itself counts.
pub(crate) fn plane_support(matches: &BothSides, spacing: f64) -> f64 {
    let scale = (0.5 * spacing).powi(2);
    let near = (ON_PLANE * spacing).powi(2);
    let of = |(_, m): &(usize, Match)| {
        let apart = m.moved - m.fixed;
        let squared = apart.norm_squared();
        let residual = if squared < near { apart.dot(&m.normal).powi(2) } else { squared };
        scale / (scale + residual)
    };
    let [from_source, from_target] =
        matches.each_ref().map(|side| side.iter().map(of).sum::<f64>() / side.len() as f64);
    0.5 * (from_source + from_target)
}

/// Support in [0, 1] of squared distances to the nearest point of the other cloud: the mean over both clouds of
/// `s^2 / (s^2 + r^2)`, over three scales `s` of `spacing`: 1, 0.3 and 0.1. Both clouds count alike, whatever their sizes.
pub(crate) fn support_of(from_source: &[f64], from_target: &[f64], spacing: f64) -> f64 {
    let scales = [1.0, 0.3, 0.1].map(|s| (s * spacing) * (s * spacing));
    let mean = |squared: &[f64]| {
        let sum: f64 = squared.iter().map(|r| scales.iter().map(|s| s / (s + r)).sum::<f64>() / 3.0).sum();
        sum / squared.len() as f64
    };
    0.5 * (mean(from_source) + mean(from_target))
}

/// How far `next` moves the cloud of this radius against `pose`.
pub(crate) fn motion(pose: &Rigid, next: &Rigid, radius: f64) -> f64 {
    let shift: Vector3<f64> = next.translation - pose.translation;
    shift.norm() + (next.rotation - pose.rotation).norm() * radius
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};
    use srrf_cloud::PointCloud;

    use super::*;
    use crate::prepared::RefineCloud;

    /// Points of a saddle, by chance.
    fn saddle(seed: u64) -> RefineCloud {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let points = (0..600).map(|_| {
            let [x, y]: [f64; 2] = rng.random();
            [x, y, 0.4 * (x - 0.5) * (y - 0.4)]
        });
        RefineCloud::of(&PointCloud::new(points.collect()).unwrap())
    }

    #[test]
    fn two_samplings_share_planes_and_not_points() {
        let (one, other) = (saddle(1), saddle(2));
        let at = |up: f64| {
            let lifted = Rigid { translation: Vector3::new(0.0, 0.0, up), ..Rigid::identity() };
            let pose = one.frame_to(&other).pose(&lifted);
            let (s, t) = (one.coarse(), other.coarse());
            let matches = both_sides(s, t, &pose);
            [support, plane_support].map(|of| of(&matches, s.spacing.max(t.spacing)))
        };
        let spacing = one.coarse().spacing;
        let [points, planes] = at(0.0);
        assert!(planes > 0.95 && points < 0.6, "{points} {planes}");
        // Off the surface the planes say so.
        assert!(at(2.0 * spacing)[1] < 0.1, "{:?}", at(2.0 * spacing));
        // Far away there are no planes to lie on.
        assert!(at(40.0 * spacing)[1] < 0.01);
    }
}
