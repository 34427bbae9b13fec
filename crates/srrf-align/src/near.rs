//! Scans that lie near each other in a map.

use rayon::prelude::*;
use srrf_cloud::Rigid;

use crate::surface::ScanSurface;

/// Points of a scan that say whether two scans overlap.
const OVERLAP_ASKED: usize = 150;
/// Neighbours in the map of which overlap is computed.
const NEIGHBOURS: usize = 40;

/// The pairs of `members` that overlap by at least `least` in these poses of the centred scans: `(a, b, share)`, `a < b`.
pub fn overlapping(
    surfaces: &[ScanSurface],
    poses: &[Rigid],
    members: &[usize],
    least: f64,
) -> Vec<(usize, usize, f64)> {
    close_by(surfaces, poses, members)
        .into_par_iter()
        .map(|(a, b)| {
            let b_from_a = poses[b].inverse().compose(&poses[a]);
            (a, b, surfaces[b].overlap(&surfaces[a], &b_from_a, OVERLAP_ASKED))
        })
        .filter(|pair| pair.2 >= least)
        .collect()
}

/// The pairs of `members` that are within reach of each other, of the nearest of each: `a < b`.
pub fn close_by(surfaces: &[ScanSurface], poses: &[Rigid], members: &[usize]) -> Vec<(usize, usize)> {
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for &a in members {
        let mut near: Vec<(f64, usize)> = members
            .iter()
            .filter(|b| **b != a)
            .map(|&b| ((poses[a].translation - poses[b].translation).norm(), b))
            .filter(|(apart, b)| *apart <= surfaces[a].reach + surfaces[*b].reach)
            .collect();
        near.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        near.truncate(NEIGHBOURS);
        pairs.extend(near.into_iter().map(|(_, b)| (a.min(b), a.max(b))));
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}
