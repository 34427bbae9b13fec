//! What is said of each scan and edge in the end.

use std::collections::BTreeSet;

use nalgebra::{Matrix6, Vector3};
use srrf_cloud::Rigid;

use crate::consensus::{Consensus, EdgeVerdict, HALF, group_of};
use crate::graph::GraphEdge;
use crate::joint::Joint;
use crate::loops::go_around;
use crate::map::{Map, MapEdge, OpenMotion, PairChoice, PlacedScan, WorstLoop};
use crate::options::AlignOptions;
use crate::pool::{PairPool, TriedPair};
use crate::se3::{displacement, shift};
use crate::surface::ScanSurface;
use crate::trees::spanning_tree;

/// A motion with a standard deviation above this share of the radius is left open.
const OPEN_RADII: f64 = 0.1;

/// Most that a scan has in a component of which parts look alike.
const ALIKE_PROBABILITY: f64 = 0.4;

/// All that was found.
pub struct Finished<'a> {
    pub surfaces: &'a [ScanSurface],
    pub consensus: &'a Consensus,
    pub pool: &'a PairPool,
    pub joint: &'a Joint,
    pub options: &'a AlignOptions,
    pub choice: PairChoice,
}

/// Puts it in words of the input.
pub fn place(all: &Finished<'_>) -> Map {
    let Finished { surfaces, consensus, pool, joint, options, choice } = all;
    let n = surfaces.len();
    let group = group_of(n, &consensus.components);
    let input: Vec<Rigid> = (0..n).map(|i| joint.poses[i].compose(&shift(&-surfaces[i].centre))).collect();
    // Where each component lies: its lowest scan is where its guess says.
    let map_from_component: Vec<Rigid> = consensus
        .components
        .iter()
        .map(|members| {
            let anchor = members[0];
            let wanted = options.initial.get(anchor).copied().flatten().unwrap_or_else(Rigid::identity);
            wanted.compose(&input[anchor].inverse())
        })
        .collect();
    let mut probability = probabilities(n, pool, consensus);
    // Where places look alike, the map may be the wrong one of two.
    let mut doubted = vec![false; consensus.components.len()];
    for edge in consensus.rivals.iter().flat_map(|l| &l.edges) {
        let TriedPair { source, target, .. } = &pool.tried[*edge];
        [source, target].into_iter().for_each(|scan| doubted[group[*scan]] = true);
    }
    (0..n)
        .filter(|i| doubted[group[*i]])
        .for_each(|i| probability[i] = probability[i].min(ALIKE_PROBABILITY));
    let scans = (0..n)
        .map(|i| {
            let to_map = &map_from_component[group[i]];
            let alone = consensus.components[group[i]].len() == 1;
            let anchor = consensus.components[group[i]][0] == i;
            let covariance = joint
                .covariances
                .as_ref()
                .filter(|_| !alone)
                .map(|all| turned(&all[i], &to_map.compose(&joint.poses[i])));
            let centre = Vector3::from(to_map.apply(&joint.poses[i].translation.into()));
            PlacedScan {
                map_from_scan: to_map.compose(&input[i]),
                component: group[i],
                probability: probability[i],
                abstain: alone || probability[i] < HALF,
                held_by: held_by(i, pool, consensus),
                centre,
                spread: covariance.map(|c| spread(&c, surfaces[i].radius)),
                undetermined: covariance
                    .filter(|_| !anchor)
                    .map_or_else(Vec::new, |c| open_motions(&c, surfaces[i].radius)),
                covariance,
                residual: Some(joint.residuals[i]).filter(|r| r.is_finite()),
            }
        })
        .collect();
    let edges = pool.tried.iter().enumerate().map(|(e, pair)| map_edge(e, pair, all, &group)).collect();
    let squares: Vec<f64> = joint.residuals.iter().filter(|r| r.is_finite()).map(|r| r * r).collect();
    let residual = (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt());
    Map {
        scans,
        components: consensus.components.clone(),
        edges,
        rivals: consensus.rivals.iter().map(|l| l.edges.clone()).collect(),
        look_alike: consensus.look_alike,
        worst_loop: worst_loop(surfaces, pool, consensus),
        residual,
        choice: choice.clone(),
    }
}

fn map_edge(number: usize, pair: &TriedPair, all: &Finished<'_>, group: &[usize]) -> MapEdge {
    let together = group[pair.source] == group[pair.target] && pair.answer.target_from_source.is_some();
    let off = together.then(|| pair.edge.error(&all.joint.poses));
    MapEdge {
        source: pair.source,
        target: pair.target,
        reason: pair.reason,
        target_from_source: pair.answer.target_from_source,
        probability: pair.answer.probability,
        abstain: pair.answer.abstain,
        posterior: all.consensus.posterior[number],
        verdict: all.consensus.verdicts[number],
        overlap: pair.overlay.as_ref().map_or([0.0; 2], |o| [o.overlap_source, o.overlap_target]),
        seen_through: pair.overlay.as_ref().and_then(|o| o.seen_through),
        off_deg: off.map(|m| m.angle_to_deg(&Rigid::identity())),
        off: off.map(|m| {
            let about_source =
                pair.edge.target_from_source.inverse().compose(&m).compose(&pair.edge.target_from_source);
            displacement(&about_source, all.surfaces[pair.source].radius)
        }),
    }
}

fn held_by(scan: usize, pool: &PairPool, found: &Consensus) -> Vec<usize> {
    let touches = |pair: &TriedPair| pair.source == scan || pair.target == scan;
    (0..pool.tried.len())
        .filter(|e| touches(&pool.tried[*e]) && found.verdicts[*e] == EdgeVerdict::Holds)
        .collect()
}

/// The probability of the likeliest way from each scan to the lowest of its component: the product of the edges on it. A scan alone
/// has none.
fn probabilities(n: usize, pool: &PairPool, found: &Consensus) -> Vec<f64> {
    let mut near = vec![Vec::new(); n];
    for (e, pair) in pool.tried.iter().enumerate() {
        if found.verdicts[e] == EdgeVerdict::Holds {
            near[pair.source].push((pair.target, found.posterior[e]));
            near[pair.target].push((pair.source, found.posterior[e]));
        }
    }
    let mut best = vec![0.0; n];
    for members in found.components.iter().filter(|m| m.len() > 1) {
        best[members[0]] = 1.0;
        // Ordered by bits: probabilities are not negative.
        let mut queue = BTreeSet::from([(1.0f64.to_bits(), members[0])]);
        while let Some((bits, at)) = queue.pop_last() {
            let so_far = f64::from_bits(bits);
            for &(next, p) in &near[at] {
                if so_far * p > best[next] {
                    queue.remove(&(f64::to_bits(best[next]), next));
                    best[next] = so_far * p;
                    queue.insert((f64::to_bits(best[next]), next));
                }
            }
        }
    }
    for members in found.components.iter().filter(|m| m.len() > 1) {
        // The lowest scan is where it is by definition, and is as sure as the best of its neighbours.
        best[members[0]] = near[members[0]].iter().map(|(_, p)| *p).fold(0.0, f64::max);
    }
    best
}

/// The covariance in the axes of the map.
fn turned(covariance: &Matrix6<f64>, map_from_scan: &Rigid) -> Matrix6<f64> {
    let mut turn = Matrix6::zeros();
    turn.fixed_view_mut::<3, 3>(0, 0).copy_from(&map_from_scan.rotation);
    turn.fixed_view_mut::<3, 3>(3, 3).copy_from(&map_from_scan.rotation);
    turn * covariance * turn.transpose()
}

/// Root mean square motion of points in a ball.
fn spread(covariance: &Matrix6<f64>, radius: f64) -> f64 {
    let turn = covariance.fixed_view::<3, 3>(0, 0).trace();
    let along = covariance.fixed_view::<3, 3>(3, 3).trace();
    (turn * radius * radius * 2.0 / 3.0 + along).max(0.0).sqrt()
}

fn open_motions(covariance: &Matrix6<f64>, radius: f64) -> Vec<OpenMotion> {
    let scale = |i: usize| if i < 3 { radius } else { 1.0 };
    let scaled = Matrix6::from_fn(|i, j| covariance[(i, j)] * scale(i) * scale(j));
    let eigen = scaled.symmetric_eigen();
    let mut open: Vec<OpenMotion> = (0..6)
        .filter(|k| eigen.eigenvalues[*k].max(0.0).sqrt() > OPEN_RADII * radius)
        .map(|k| {
            let deviation = eigen.eigenvalues[k].max(0.0).sqrt();
            let motion = eigen.eigenvectors.column(k) * deviation;
            OpenMotion {
                turn: std::array::from_fn(|i| motion[i] / radius),
                shift: std::array::from_fn(|i| motion[i + 3]),
                deviation,
            }
        })
        .collect();
    open.sort_by(|a, b| b.deviation.total_cmp(&a.deviation));
    open
}

/// Of the triangles of edges that hold, and of the ways back along the likeliest tree of them, the loop that moves the points most.
fn worst_loop(surfaces: &[ScanSurface], pool: &PairPool, found: &Consensus) -> Option<WorstLoop> {
    let edges: Vec<GraphEdge> = pool.tried.iter().map(|t| t.edge.clone()).collect();
    let likely: Vec<f64> = (0..edges.len())
        .map(|e| if found.verdicts[e] == EdgeVerdict::Holds { found.posterior[e] } else { 0.0 })
        .collect();
    let tree = spanning_tree(surfaces.len(), &edges, &likely);
    let mut all = found.loops.clone();
    for (e, edge) in edges.iter().enumerate().filter(|(e, _)| likely[*e] > 0.0) {
        if let Some(way) = tree.way(edge.target, edge.source).filter(|way| *way != [e]) {
            let numbers: Vec<usize> = std::iter::once(e).chain(way).collect();
            all.push(go_around(&edges, &numbers, edge.source));
        }
    }
    all.into_iter()
        .map(|l| {
            let first = &edges[l.edges[0]];
            let radius = surfaces[first.source].radius.max(surfaces[first.target].radius);
            WorstLoop {
                angle_deg: l.error.angle_to_deg(&Rigid::identity()),
                displacement: displacement(&l.error, radius),
                edges: l.edges,
            }
        })
        .max_by(|a, b| a.displacement.total_cmp(&b.displacement))
}
