//! Which edges hold: loops, a spanning tree of the likeliest, and an optimum that truncates what contradicts it.

use serde::{Serialize, Serializer};
use srrf_cloud::Rigid;

use crate::belief::beliefs;
use crate::graph::{GraphEdge, optimise};
use crate::loops::{CLOSES, EdgeLoop, triangles, ways_round};
use crate::trees::{components, spanning_tree};

/// An edge below this is rather wrong than right.
pub const HALF: f64 = 0.5;
/// An edge that a loop speaks against, and none for, joins only above this.
const SURE: f64 = 0.8;
/// How fast the loss is made less convex, as in the paper.
const HARDER: f64 = 1.4;
const MOST_HARDENINGS: usize = 60;

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
}

/// Finds it. `prior` is the probability of each edge by its registration; `abstains` says where that is too little.
pub fn agree(nodes: usize, edges: &[GraphEdge], prior: &[f64], abstains: &[bool]) -> Consensus {
    let mut all = triangles(nodes, edges, prior);
    let first = beliefs(prior, &all);
    let unasked: Vec<bool> =
        heard(edges.len(), &first, &all).iter().map(|(supported, _)| !supported).collect();
    all.extend(ways_round(nodes, edges, &first, &unasked));
    let posterior = beliefs(prior, &all);
    let joins = joining(edges.len(), &posterior, abstains, &all);
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
    let rivals = rivals(&all, &verdicts, prior);
    let holding = all.into_iter().filter(|l| l.edges.iter().all(|e| holds[*e])).collect();
    Consensus { poses, components: groups, verdicts, posterior, loops: holding, rivals }
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

/// For each edge, whether a loop of likely edges closes with it, and whether one does not.
fn heard(count: usize, likely: &[f64], loops: &[EdgeLoop]) -> Vec<(bool, bool)> {
    let mut of = vec![(false, false); count];
    for l in loops {
        for &edge in &l.edges {
            let others_right = l.edges.iter().all(|e| *e == edge || likely[*e] >= HALF);
            match l.closes() {
                Some(true) if others_right => of[edge].0 = true,
                Some(false) if others_right => of[edge].1 = true,
                _ => {}
            }
        }
    }
    of
}

/// Which edges may join scans.
fn joining(count: usize, posterior: &[f64], abstains: &[bool], loops: &[EdgeLoop]) -> Vec<bool> {
    heard(count, posterior, loops)
        .into_iter()
        .enumerate()
        .map(|(e, (supported, spoken_against))| {
            let enough = if spoken_against && !supported { SURE } else { HALF };
            posterior[e] >= enough && (supported || !abstains[e])
        })
        .collect()
}

/// Poses by the likeliest edges, each tree from its lowest node.
fn along_tree(nodes: usize, edges: &[GraphEdge], likely: &[f64]) -> Vec<Rigid> {
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

/// The optimum with a truncated quadratic loss by graduated non-convexity, and which edges are within the truncation. Source: Yang,
/// Antonante, Tzoumas and Carlone, "Graduated non-convexity for robust spatial perception", 2020.
fn truncated(nodes: usize, poses: &mut Vec<Rigid>, edges: &[GraphEdge], start: Vec<f64>) -> Vec<bool> {
    let used: Vec<usize> = (0..edges.len()).filter(|e| start[*e] > 0.0).collect();
    let mut weights = start;
    let worst = |poses: &[Rigid]| used.iter().map(|e| edges[*e].cost(poses)).fold(0.0, f64::max);
    let first = worst(poses);
    let mut control = CLOSES / (2.0 * first - CLOSES);
    if first > CLOSES && control > 0.0 {
        for _ in 0..MOST_HARDENINGS {
            let mut undecided = false;
            for &e in &used {
                let cost = edges[e].cost(poses);
                weights[e] = if cost >= (control + 1.0) / control * CLOSES {
                    0.0
                } else if cost <= control / (control + 1.0) * CLOSES {
                    1.0
                } else {
                    undecided = true;
                    (CLOSES * control * (control + 1.0) / cost).sqrt() - control
                };
            }
            move_to_optimum(nodes, poses, edges, &weights);
            if !undecided {
                break;
            }
            control *= HARDER;
        }
    } else {
        move_to_optimum(nodes, poses, edges, &weights);
    }
    (0..edges.len()).map(|e| weights[e] > HALF && edges[e].cost(poses) <= CLOSES).collect()
}

fn move_to_optimum(nodes: usize, poses: &mut Vec<Rigid>, edges: &[GraphEdge], weights: &[f64]) {
    let used: Vec<bool> = weights.iter().map(|w| *w > 1e-6).collect();
    let held: Vec<usize> = components(nodes, edges, &used).iter().map(|g| g[0]).collect();
    // Where there is no solution the poses stay where the tree put them.
    let _ = optimise(poses, edges, weights, &held);
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
mod tests {
    use super::*;
    use crate::loops::tests::{exact, ring};
    use crate::se3::{displacement, exp};

    fn off(poses: &[Rigid], truth: &[Rigid]) -> f64 {
        let aligned = |i: usize| truth[0].inverse().compose(&truth[i]).inverse().compose(&poses[i]);
        (0..poses.len()).map(|i| displacement(&aligned(i), 1.0)).fold(0.0, f64::max)
    }

    /// A ring of 36 with each next and next but one, and wrong edges, 30 in a hundred, that look as good as the right ones.
    #[test]
    fn wrong_edges_are_found_and_named() {
        let truth = ring(36);
        let mut edges: Vec<GraphEdge> =
            (0..36).flat_map(|i| [exact(&truth, i, (i + 1) % 36), exact(&truth, (i + 2) % 36, i)]).collect();
        let right = edges.len();
        for k in 0..31 {
            let s = k as f64;
            let mut wrong = exact(&truth, (7 * k) % 36, (7 * k + 11 + k % 5) % 36);
            wrong.target_from_source = exp(&nalgebra::Vector6::new(
                s.sin(),
                (1.3 * s).cos(),
                (2.1 * s).sin(),
                s.cos(),
                2.0,
                -s.sin(),
            ))
            .compose(&wrong.target_from_source);
            edges.push(wrong);
        }
        let prior = vec![0.95; edges.len()];
        let found = agree(36, &edges, &prior, &vec![false; edges.len()]);
        assert_eq!(found.components.len(), 1);
        for (number, verdict) in found.verdicts.iter().enumerate() {
            let expected = if number < right { EdgeVerdict::Holds } else { EdgeVerdict::Contradicts };
            assert_eq!(*verdict, expected, "edge {number}");
        }
        assert!(off(&found.poses, &truth) < 1e-6, "{}", off(&found.poses, &truth));
        assert!(found.rivals.is_empty(), "wrong edges agree with none: {:?}", found.rivals);
    }

    /// Node 4 is held by two nodes here, and by two others elsewhere.
    #[test]
    fn what_contradicts_and_agrees_with_itself_is_never_silent() {
        let truth = ring(5);
        let mut edges: Vec<GraphEdge> =
            [(0, 1), (0, 2), (1, 2), (0, 3), (1, 3), (2, 3), (4, 2), (4, 3), (4, 0), (4, 1)]
                .map(|(a, b)| exact(&truth, a, b))
                .to_vec();
        let mut other = truth.clone();
        other[4] = exp(&nalgebra::Vector6::new(0.0, 0.0, 0.3, 5.0, 1.0, 0.0)).compose(&other[4]);
        edges[8] = exact(&other, 4, 0);
        edges[9] = exact(&other, 4, 1);
        for sure in [[0.95, 0.95], [0.98, 0.9]] {
            let mut prior = vec![0.95; 10];
            prior[6..8].fill(sure[0]);
            prior[8..].fill(sure[1]);
            let found = agree(5, &edges, &prior, &[false; 10]);
            assert!(found.components[0].len() == 4 || !found.rivals.is_empty(), "{found:?}");
        }
    }

    #[test]
    fn an_edge_that_abstains_joins_nothing_alone_and_with_a_loop_it_does() {
        let truth = ring(6);
        let mut edges: Vec<GraphEdge> =
            [(0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (3, 5)].map(|(a, b)| exact(&truth, a, b)).to_vec();
        let sure = [0.95; 6];
        edges.push(exact(&truth, 2, 3));
        let abstains = |n: usize| [vec![false; 6], vec![true; n]].concat();
        let found = agree(6, &edges, &[&sure[..], &[0.4]].concat(), &abstains(1));
        assert_eq!(found.components, [vec![0, 1, 2], vec![3, 4, 5]]);
        assert_eq!(found.verdicts[6], EdgeVerdict::Unconfirmed);
        // A second one that agrees: each closes a loop for the other.
        edges.push(exact(&truth, 1, 3));
        let found = agree(6, &edges, &[&sure[..], &[0.4, 0.4]].concat(), &abstains(2));
        assert_eq!(found.components.len(), 1);
        assert!(found.verdicts.iter().all(|v| *v == EdgeVerdict::Holds) && off(&found.poses, &truth) < 1e-6);
        // One that disagrees: neither.
        edges[7].target_from_source.translation.x += 3.0;
        let found = agree(6, &edges, &[&sure[..], &[0.4, 0.4]].concat(), &abstains(2));
        assert_eq!(found.components.len(), 2);
    }

    #[test]
    fn three_edges_of_which_one_is_wrong_join_nobody() {
        let truth = ring(3);
        let mut edges = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| exact(&truth, a, b));
        edges[1].target_from_source.translation.z += 5.0;
        let found = agree(3, &edges, &[0.9; 3], &[false; 3]);
        assert_eq!(found.components.len(), 3, "{found:?}");
        // The same with one edge that is much less sure.
        let found = agree(3, &edges, &[0.95, 0.55, 0.95], &[false; 3]);
        assert_eq!(found.components.len(), 1, "{found:?}");
        assert_eq!(found.verdicts[1], EdgeVerdict::Contradicts);
    }

    #[test]
    fn nothing_measured_is_no_edge() {
        let truth = ring(2);
        let found = agree(2, &[exact(&truth, 0, 1)], &[0.0], &[true]);
        assert_eq!((found.components.len(), found.verdicts[0]), (2, EdgeVerdict::Nothing));
    }
}
