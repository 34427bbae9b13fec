//! Which edges hold: loops, a spanning tree of the likeliest, and an optimum that truncates what contradicts it.

use std::collections::BTreeSet;

use serde::{Serialize, Serializer};
use srrf_cloud::Rigid;

use crate::belief::beliefs;
use crate::graph::GraphEdge;
use crate::loops::{CLOSES, EdgeLoop, ways_round};
use crate::trees::{Union, components, spanning_tree};
use crate::truncated::{move_to_optimum, truncated};
use crate::trust::{logit, of_logit, shift};

/// An edge below this is rather wrong than right.
pub const HALF: f64 = 0.5;
/// An edge that no loop confirms joins only from here on: a wrong map costs more than two right ones.
const SURE: f64 = 0.9;
/// Where the odds of all edges are lowered by more than this (a logarithm), places look alike.
const LOOK_ALIKE: f64 = -1.0;
/// The odds of all edges are lowered, and the loops asked again, so many times.
const MOST_SHIFTS: usize = 6;
/// ...or until they change by less.
const STILL: f64 = 0.02;

/// What became of an edge. [`std::fmt::Display`] gives the name in results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EdgeVerdict {
    /// It agrees with the map, and holds it.
    Holds,
    /// It contradicts what holds.
    Contradicts,
    /// It may be right, yet its registration abstains (or a loop speaks against it) and nothing confirms it.
    Unconfirmed,
    /// Its registration found no pose, or one in which the points do not lie on each other.
    Nothing,
}

impl std::fmt::Display for EdgeVerdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Holds => "holds",
            Self::Contradicts => "contradicts",
            Self::Unconfirmed => "unconfirmed",
            Self::Nothing => "nothing",
        })
    }
}

/// By its name.
impl Serialize for EdgeVerdict {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Poses that the edges agree on.
#[derive(Debug, Clone)]
pub struct Consensus {
    /// `map_from_node`; the lowest node of each component is at the identity.
    pub poses: Vec<Rigid>,
    /// Nodes that hold together, the largest component first.
    pub components: Vec<Vec<usize>>,
    /// One an edge.
    pub verdicts: Vec<EdgeVerdict>,
    /// Probability of each edge after the loops.
    pub posterior: Vec<f64>,
    /// The loops of edges that hold.
    pub loops: Vec<EdgeLoop>,
    /// Loops that close with two or more edges which contradict the map: wrong edges do not agree by chance, so that either these are
    /// right, or places look alike.
    pub rivals: Vec<EdgeLoop>,
    /// Whether sure pairs turned out wrong so often that none joins by itself, or scans cannot be told apart.
    pub look_alike: bool,
}

/// What is known of the edges, one value an edge.
#[derive(Clone, Copy)]
pub struct EdgeEvidence<'a> {
    /// Probability by the registration; 0 where nothing was measured.
    pub prior: &'a [f64],
    /// The most that an edge has by itself, before sight: the probability by the registration among the other poses that fit as well.
    pub by_itself: &'a [f64],
    /// What else speaks for it, in log odds.
    pub sight: &'a [f64],
    /// Whether the registration abstains.
    pub abstains: &'a [bool],
    /// Whether other poses are as likely, so that loops close in wrong ways too.
    pub tied: &'a [bool],
    /// Whether the user says that the scans overlap.
    pub vouched: &'a [bool],
    /// Whether the scans show the same whole, so that they may be two of a kind.
    pub twins: &'a [bool],
    /// Whether one of its scans is one of two in a building that cannot be told apart.
    pub doubled: &'a [bool],
    /// Short loops of them.
    pub loops: &'a [EdgeLoop],
    /// Whether a loop that closes says nothing.
    pub implied: &'a dyn Fn(&EdgeLoop) -> bool,
}

/// Finds it.
pub fn agree(nodes: usize, edges: &[GraphEdge], known: EdgeEvidence<'_>) -> Consensus {
    let prior = known.prior;
    let with = |lowered: f64| -> Vec<f64> {
        let odds =
            |(p, sight): (&f64, &f64)| if *p > 0.0 { of_logit(logit(*p) + sight + lowered) } else { 0.0 };
        prior.iter().zip(known.sight).map(odds).collect()
    };
    let seen = with(0.0);
    let short = known.loops;
    let (mut lowered, mut all, mut posterior) = (0.0, Vec::new(), Vec::new());
    for _ in 0..MOST_SHIFTS {
        let now = with(lowered);
        let first = beliefs(&now, short);
        let unasked: Vec<bool> = confirmed(edges.len(), &first, short).iter().map(|c| !c).collect();
        all = short.to_vec();
        let mut long = ways_round(nodes, edges, &first, &unasked);
        long.iter_mut().filter(|l| l.closes() == Some(true)).for_each(|l| l.implied = (known.implied)(l));
        all.extend(long);
        posterior = beliefs(&now, &all);
        let next = shift(prior, &posterior);
        if (next - lowered).abs() < STILL {
            break;
        }
        lowered = next;
    }
    // Where no loop closes, the other poses that fit as well count.
    let confirmed = confirmed(edges.len(), &posterior, &all);
    for e in 0..edges.len() {
        if !confirmed[e] && !known.vouched[e] && !known.abstains[e] {
            posterior[e] = posterior[e].min(of_logit(logit(known.by_itself[e]) + known.sight[e]));
        }
    }
    let look_alike = lowered <= LOOK_ALIKE || known.doubled.contains(&true);
    let may_join = joining(edges, &posterior, known, &confirmed, &all, look_alike);
    let joins = likelier_right_than_wrong(nodes, edges, &posterior, may_join, known.vouched);
    let likely: Vec<f64> = posterior.iter().zip(&joins).map(|(p, j)| if *j { *p } else { 0.0 }).collect();
    let mut poses = along_tree(nodes, edges, &likely);
    let weights: Vec<f64> = joins.iter().map(|j| f64::from(u8::from(*j))).collect();
    let kept = truncated(nodes, &mut poses, edges, weights);

    let mut verdicts: Vec<EdgeVerdict> = Vec::with_capacity(edges.len());
    let groups = components(nodes, edges, &kept);
    let group = group_of(nodes, &groups);
    for (number, edge) in edges.iter().enumerate() {
        let together = group[edge.source] == group[edge.target];
        verdicts.push(match (prior[number] > 0.0, kept[number], together) {
            (false, _, _) => EdgeVerdict::Nothing,
            (true, true, _) => EdgeVerdict::Holds,
            (true, false, true) if edge.cost(&poses) <= CLOSES => EdgeVerdict::Holds,
            (true, false, true) => EdgeVerdict::Contradicts,
            (true, false, false) if joins[number] => EdgeVerdict::Contradicts,
            (true, false, false) => EdgeVerdict::Unconfirmed,
        });
    }
    let holds: Vec<bool> = verdicts.iter().map(|v| *v == EdgeVerdict::Holds).collect();
    settle(nodes, &mut poses, edges, &holds, &groups);
    let rivals = rivals(&all, &verdicts, &seen);
    let measured =
        |l: &EdgeLoop| l.chi_squared.is_finite() && !l.implied && l.edges.iter().all(|e| holds[*e]);
    let holding = all.into_iter().filter(measured).collect();
    Consensus { poses, components: groups, verdicts, posterior, loops: holding, rivals, look_alike }
}

/// The loops that close with two or more edges that contradict, each likely by its registration; the others hold or contradict too.
fn rivals(loops: &[EdgeLoop], verdicts: &[EdgeVerdict], prior: &[f64]) -> Vec<EdgeLoop> {
    let contradicts = |e: &usize| verdicts[*e] == EdgeVerdict::Contradicts && prior[*e] >= HALF;
    let speaks = |e: &usize| verdicts[*e] == EdgeVerdict::Holds || contradicts(e);
    loops
        .iter()
        .filter(|l| l.closes() == Some(true) && l.edges.iter().all(speaks))
        .filter(|l| l.edges.iter().filter(|e| contradicts(e)).count() >= 2)
        .cloned()
        .collect()
}

/// For each edge, whether a loop closes with it whose other edges are likely.
fn confirmed(count: usize, likely: &[f64], loops: &[EdgeLoop]) -> Vec<bool> {
    closing(count, loops.iter().filter(|l| l.closes() == Some(true)), |e| likely[e] >= HALF)
}

/// For each edge, whether a loop closes with it by itself, and its other edges are sure: several pairs say the same, yet by one look.
fn repeated(count: usize, likely: &[f64], loops: &[EdgeLoop]) -> Vec<bool> {
    closing(count, loops.iter().filter(|l| l.implied && l.chi_squared <= CLOSES), |e| likely[e] >= SURE)
}

fn closing<'a>(
    count: usize,
    loops: impl Iterator<Item = &'a EdgeLoop>,
    speaks: impl Fn(usize) -> bool,
) -> Vec<bool> {
    let mut of = vec![false; count];
    for l in loops {
        for &edge in &l.edges {
            of[edge] |= l.edges.iter().all(|e| *e == edge || speaks(*e));
        }
    }
    of
}

/// For each edge whether its scans fit nowhere else: no other edge of theirs is clean by sight and yet rather wrong, and none of them
/// has a twin, a scan that shows the same whole: what joins the one would join the other as well.
fn only_there(edges: &[GraphEdge], posterior: &[f64], known: EdgeEvidence<'_>) -> Vec<bool> {
    let mut fits_elsewhere = BTreeSet::new();
    for (e, edge) in edges.iter().enumerate() {
        let rival = known.prior[e] > 0.0 && known.sight[e] >= 0.0 && posterior[e] < HALF;
        if rival || known.twins[e] {
            fits_elsewhere.extend([edge.source, edge.target]);
        }
    }
    let fits = |scan: &usize| fits_elsewhere.contains(scan);
    edges.iter().map(|edge| !fits(&edge.source) && !fits(&edge.target)).collect()
}

/// Which edges may join scans: none of which other poses are as likely, unless the user vouches for it. Where places look alike, a pair
/// that no loop confirms joins only scans that fit nowhere else. One whose registration abstains does so only if scanners saw nothing
/// against it as well, and other pairs say the same.
fn joining(
    edges: &[GraphEdge],
    posterior: &[f64],
    known: EdgeEvidence<'_>,
    confirmed: &[bool],
    loops: &[EdgeLoop],
    look_alike: bool,
) -> Vec<bool> {
    let alone = only_there(edges, posterior, known);
    let repeated = repeated(posterior.len(), posterior, loops);
    (0..posterior.len())
        .map(|e| match () {
            () if known.doubled[e] || known.tied[e] && !known.vouched[e] => false,
            () if confirmed[e] => posterior[e] >= HALF,
            () if known.abstains[e] => {
                posterior[e] >= SURE && known.sight[e] > 0.0 && repeated[e] && alone[e]
            }
            () if known.vouched[e] => posterior[e] >= HALF,
            () => posterior[e] >= SURE && (!look_alike || alone[e]),
        })
        .collect()
}

/// Of the edges that may join, those by which the whole stays likelier right than wrong: along the likeliest tree the chances of an
/// error may add up to a half. Edges that the user vouches for do not count. What is left out makes maps of its own.
fn likelier_right_than_wrong(
    nodes: usize,
    edges: &[GraphEdge],
    posterior: &[f64],
    mut joins: Vec<bool>,
    vouched: &[bool],
) -> Vec<bool> {
    let mut order: Vec<usize> = (0..edges.len()).filter(|e| joins[*e]).collect();
    order.sort_by(|a, b| posterior[*b].total_cmp(&posterior[*a]).then(a.cmp(b)));
    let (mut union, mut risk) = (Union::new(nodes), 0.0);
    for e in order {
        let (a, b) = (union.find(edges[e].source), union.find(edges[e].target));
        let more = if vouched[e] { 0.0 } else { 1.0 - posterior[e] };
        if a != b && risk + more <= HALF {
            risk += more;
            union.join(a, b);
        }
    }
    for (e, joins) in joins.iter_mut().enumerate() {
        *joins &= union.find(edges[e].source) == union.find(edges[e].target);
    }
    joins
}

/// Poses by the likeliest edges, each tree from its lowest node.
pub fn along_tree(nodes: usize, edges: &[GraphEdge], likely: &[f64]) -> Vec<Rigid> {
    let tree = spanning_tree(nodes, edges, likely);
    let mut poses = vec![Rigid::identity(); nodes];
    for &node in &tree.order {
        if let Some((parent, number)) = tree.parent(node) {
            let edge = &edges[number];
            poses[node] = if edge.source == node {
                poses[parent].compose(&edge.target_from_source)
            } else {
                poses[parent].compose(&edge.target_from_source.inverse())
            };
        }
    }
    poses
}

/// The optimum of the edges that hold, each component about its lowest node.
fn settle(nodes: usize, poses: &mut Vec<Rigid>, edges: &[GraphEdge], holds: &[bool], groups: &[Vec<usize>]) {
    let weights: Vec<f64> = holds.iter().map(|h| f64::from(u8::from(*h))).collect();
    move_to_optimum(nodes, poses, edges, &weights);
    for group in groups {
        let back = poses[group[0]].inverse();
        group.iter().for_each(|node| poses[*node] = back.compose(&poses[*node]));
    }
}

/// The number of the component of each node.
pub fn group_of(nodes: usize, groups: &[Vec<usize>]) -> Vec<usize> {
    let mut of = vec![0; nodes];
    for (number, group) in groups.iter().enumerate() {
        group.iter().for_each(|node| of[*node] = number);
    }
    of
}

#[cfg(test)]
mod tests;
