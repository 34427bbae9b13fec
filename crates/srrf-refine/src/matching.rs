//! Nearest neighbours from each cloud to the other, and sums over them.

use nalgebra::Vector3;
use rayon::prelude::*;
use srrf_cloud::Rigid;

use crate::prepared::Level;
use crate::solve::{Match, NormalEquations};

/// Points of one task: sums are taken chunk by chunk and added in order, so that the answer does
/// not depend on the number of threads.
const CHUNK: usize = 1024;

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
    source: &Level,
    target: &Level,
    pose: &Rigid,
    inverse: &Rigid,
    side: Side,
    i: usize,
) -> (usize, Match) {
    match side {
        Side::Source => {
            let moved = pose.apply(&source.points()[i]);
            let (j, _) = target.index.nearest(&moved);
            (j, Match { moved: moved.into(), fixed: target.points()[j].into(), normal: target.normals[j] })
        }
        Side::Target => {
            let fixed = target.points()[i];
            let (j, _) = source.index.nearest(&inverse.apply(&fixed));
            let moved = pose.apply(&source.points()[j]);
            (j, Match { moved: moved.into(), fixed: fixed.into(), normal: pose.rotation * source.normals[j] })
        }
    }
}

/// The matches of a side, in the order of its points, each after its index in the other cloud.
pub(crate) fn side_matches(source: &Level, target: &Level, pose: &Rigid, side: Side) -> Vec<(usize, Match)> {
    let n = if side == Side::Source { source.points().len() } else { target.points().len() };
    let inverse = pose.inverse();
    let parts = chunked(n, |range| {
        range.map(|i| nearest(source, target, pose, &inverse, side, i)).collect::<Vec<_>>()
    });
    parts.concat()
}

/// Normal equations over the matches of every `stride`-th point of both sides. `weigh` gives the
/// metric `(a, b)` of a match, or `None` to leave it out.
pub(crate) fn equations(
    source: &Level,
    target: &Level,
    pose: &Rigid,
    stride: usize,
    weigh: impl Fn(&Match) -> Option<(f64, f64)> + Sync,
) -> NormalEquations {
    let inverse = pose.inverse();
    let mut sums = NormalEquations::default();
    for (side, n) in [(Side::Source, source.points().len()), (Side::Target, target.points().len())] {
        let parts = chunked(n.div_ceil(stride), |range| {
            let mut part = NormalEquations::default();
            for i in range {
                let (_, found) = nearest(source, target, pose, &inverse, side, i * stride);
                if let Some((a, b)) = weigh(&found) {
                    part.add(&found, a, b);
                }
            }
            part
        });
        parts.iter().for_each(|part| sums.merge(part));
    }
    sums
}

/// Squared distances of the matches of both sides, source first.
pub(crate) fn squared_distances(source: &Level, target: &Level, pose: &Rigid) -> [Vec<f64>; 2] {
    [Side::Source, Side::Target].map(|side| {
        side_matches(source, target, pose, side)
            .iter()
            .map(|(_, m)| (m.moved - m.fixed).norm_squared())
            .collect()
    })
}

/// Median distance over the matches of both sides.
pub(crate) fn median_distance(source: &Level, target: &Level, pose: &Rigid) -> f64 {
    let [mut all, more] = squared_distances(source, target, pose);
    all.extend(more);
    let middle = all.len() / 2;
    all.select_nth_unstable_by(middle, f64::total_cmp).1.sqrt()
}

/// How well a pose is supported, by [`support_of`] the distances of its matches.
pub(crate) fn support(source: &Level, target: &Level, pose: &Rigid, spacing: f64) -> f64 {
    let [from_source, from_target] = squared_distances(source, target, pose);
    support_of(&from_source, &from_target, spacing)
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
