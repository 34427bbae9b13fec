//! What registered pairs agree on once what the scanners saw through is held against it.

use rayon::prelude::*;

use crate::consensus::{Consensus, EdgeEvidence, EdgeVerdict, agree};
use crate::graph::GraphEdge;
use crate::implied::is_implied;
use crate::loops::{EdgeLoop, triangles};
use crate::near::close_by;
use crate::options::PairReason;
use crate::pool::PairPool;
use crate::surface::ScanSurface;
use crate::trees::spanning_tree;
use crate::trust::Sight;

/// A pair that is so much likelier wrong by sight (log odds) says that the way between its scans is wrong.
const BLOCKS: f64 = -5.0;
/// Two scans that share so much of both show the same.
const TWINS: f64 = 0.78;
/// Points of each scan that are asked.
const ASKED: usize = 4000;
/// Longer ways say little about their edges.
const LONGEST_WAY: usize = 10;
/// So many times a map is mended by what scanners saw.
const SIGHT_ROUNDS: usize = 8;

/// What the pairs so far agree on, and what scanners saw of it.
pub fn consensus_of(surfaces: &[ScanSurface], pool: &PairPool) -> Consensus {
    let edges: Vec<_> = pool.tried.iter().map(|t| t.edge.clone()).collect();
    let prior: Vec<f64> = pool.tried.iter().map(|t| t.prior).collect();
    let by_itself: Vec<f64> = pool.tried.iter().map(|t| t.answer.probability).collect();
    let tied: Vec<bool> = pool.tried.iter().map(|t| t.tied).collect();
    let abstains: Vec<bool> = pool.tried.iter().map(|t| t.answer.abstain).collect();
    let vouched: Vec<bool> =
        pool.tried.iter().map(|t| matches!(t.reason, PairReason::Sequence | PairReason::Guess)).collect();
    let share: Vec<Option<f64>> =
        pool.tried.iter().map(|t| t.overlay.as_ref().and_then(|o| o.seen_through)).collect();
    let sight = Sight::learned(&prior, &share);
    let by_sight: Vec<f64> = share.iter().map(|s| s.map_or(0.0, |s| sight.log_ratio(s))).collect();
    let twins: Vec<bool> = pool
        .tried
        .iter()
        .zip(&by_sight)
        .map(|(t, sight)| {
            let shared = t.overlay.as_ref().map_or(0.0, |o| o.overlap_source.min(o.overlap_target));
            t.prior > 0.0 && shared >= TWINS && *sight > BLOCKS
        })
        .collect();
    let doubled = doubled(surfaces, &edges, &twins, &vouched);
    let mut loops = triangles(surfaces.len(), &edges, &prior);
    loops
        .par_iter_mut()
        .filter(|l| l.closes() == Some(true))
        .for_each(|l| l.implied = is_implied(surfaces, &edges, l));
    loops.extend(conflicts(surfaces, &edges, &prior, sight));
    let mut round = 0;
    loop {
        let known = EdgeEvidence {
            prior: &prior,
            by_itself: &by_itself,
            tied: &tied,
            sight: &by_sight,
            abstains: &abstains,
            vouched: &vouched,
            twins: &twins,
            doubled: &doubled,
            loops: &loops,
            implied: &|l| is_implied(surfaces, &edges, l),
        };
        let mut found = agree(surfaces.len(), &edges, known);
        let mut more = seen_through(surfaces, &edges, &found, sight);
        more.retain(|l| loops.iter().all(|b| b.edges != l.edges));
        if more.is_empty() {
            return found;
        }
        if round == SIGHT_ROUNDS {
            // Whatever is still seen through leaves its map in doubt.
            found.rivals.extend(more);
            return found;
        }
        loops.extend(more);
        round += 1;
    }
}

/// For each edge whether one of its scans has a twin in a building that was taken from the same place, and nobody says that they belong
/// together. Nobody sets up twice in one place; the walls of two places may be the same, and all around them too: what joins the one
/// would join the other as well, loops included.
fn doubled(surfaces: &[ScanSurface], edges: &[GraphEdge], twins: &[bool], vouched: &[bool]) -> Vec<bool> {
    let one_stand =
        |e: &GraphEdge| surfaces[e.target].shares_stand(&surfaces[e.source], &e.target_from_source);
    let mut has_twin = vec![false; surfaces.len()];
    for (e, edge) in edges.iter().enumerate() {
        if twins[e] && !vouched[e] && one_stand(edge) {
            has_twin[edge.source] = true;
            has_twin[edge.target] = true;
        }
    }
    edges.iter().zip(vouched).map(|(e, v)| !v && (has_twin[e.source] || has_twin[e.target])).collect()
}

/// Two pairs of one scan that would lay their other scans on each other so that one saw through the other: not both are right.
fn conflicts(surfaces: &[ScanSurface], edges: &[GraphEdge], prior: &[f64], sight: Sight) -> Vec<EdgeLoop> {
    let mut at: Vec<Vec<usize>> = vec![Vec::new(); surfaces.len()];
    for (number, edge) in edges.iter().enumerate().filter(|(number, _)| prior[*number] > 0.0) {
        at[edge.source].push(number);
        at[edge.target].push(number);
    }
    let ways: Vec<(usize, usize, usize)> = at
        .iter()
        .enumerate()
        .filter(|(scan, _)| surfaces[*scan].has_sight())
        .flat_map(|(scan, of)| {
            of.iter().enumerate().flat_map(move |(i, x)| of[..i].iter().map(move |y| (scan, *x, *y)))
        })
        .collect();
    ways.into_par_iter()
        .filter_map(|(scan, x, y)| {
            // The motion into the frame of the scan that both share.
            let from = |number: usize| {
                let edge = &edges[number];
                if edge.target == scan {
                    (edge.source, edge.target_from_source)
                } else {
                    (edge.target, edge.target_from_source.inverse())
                }
            };
            let ((a, scan_from_a), (b, scan_from_b)) = (from(x), from(y));
            let b_from_a = scan_from_b.inverse().compose(&scan_from_a);
            let apart = b_from_a.translation.norm() > surfaces[a].reach + surfaces[b].reach;
            if a == b || apart {
                return None;
            }
            let share = surfaces[b].seen_through(&surfaces[a], &b_from_a, ASKED)?;
            (sight.log_ratio(share) < BLOCKS).then(|| EdgeLoop::contradicted(vec![x, y]))
        })
        .collect()
}

/// The ways along the map between scans of which one saw through the other: something on them is wrong.
fn seen_through(
    surfaces: &[ScanSurface],
    edges: &[GraphEdge],
    found: &Consensus,
    sight: Sight,
) -> Vec<EdgeLoop> {
    if surfaces.iter().all(|s| !s.has_sight()) {
        return Vec::new();
    }
    let likely: Vec<f64> = (0..edges.len())
        .map(|e| if found.verdicts[e] == EdgeVerdict::Holds { found.posterior[e] } else { 0.0 })
        .collect();
    let tree = spanning_tree(surfaces.len(), edges, &likely);
    let mut pairs = Vec::new();
    for group in found.components.iter().filter(|g| g.len() > 2) {
        pairs.extend(close_by(surfaces, &found.poses, group));
    }
    pairs
        .into_par_iter()
        .filter_map(|(a, b)| {
            let way = tree.way(a, b).filter(|way| (2..=LONGEST_WAY).contains(&way.len()))?;
            let b_from_a = found.poses[b].inverse().compose(&found.poses[a]);
            let share = surfaces[b].seen_through(&surfaces[a], &b_from_a, ASKED)?;
            (sight.log_ratio(share) < BLOCKS).then(|| EdgeLoop::contradicted(way))
        })
        .collect()
}
