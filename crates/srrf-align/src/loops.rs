//! Loops of measured motions, which should come back to where they began; and what the loops say about their edges.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Matrix6;
use srrf_cloud::Rigid;

use crate::graph::GraphEdge;
use crate::se3::{adjoint, log};
use crate::trees::spanning_tree;

/// Quantile 0.99 of chi squared with six degrees of freedom: a loop within it closes.
pub const CLOSES: f64 = 16.81;
/// A loop beyond this multiple of [`CLOSES`] does not close; between the two it says nothing.
const APART: f64 = 3.0;
/// Longest loop that is asked: errors add up.
const LONGEST: usize = 8;
/// Most triangles that one edge is asked in.
const TRIANGLES_PER_EDGE: usize = 24;

/// A loop of edges.
#[derive(Debug, Clone, PartialEq)]
pub struct EdgeLoop {
    /// Numbers of its edges, in order.
    pub edges: Vec<usize>,
    /// What going around comes to, about the mean of the scan where it begins; the identity if it closes.
    pub error: Rigid,
    /// Squared Mahalanobis distance of that from the identity.
    pub chi_squared: f64,
    /// Whether it closes by itself, and so says nothing.
    pub implied: bool,
}

impl EdgeLoop {
    /// One that does not close, whatever its motion: scanners saw through what it lays on each other.
    pub fn contradicted(edges: Vec<usize>) -> Self {
        Self { edges, error: Rigid::identity(), chi_squared: f64::INFINITY, implied: false }
    }

    /// Whether it closes; `None` where that is not clear.
    pub fn closes(&self) -> Option<bool> {
        if self.implied {
            return None;
        }
        match self.chi_squared {
            c if c <= CLOSES => Some(true),
            c if c > APART * CLOSES => Some(false),
            _ => None,
        }
    }
}

/// Going along an edge from a node: the motion into the frame of the other end, and its covariance there.
fn step(edge: &GraphEdge, from: usize) -> (usize, Rigid, Matrix6<f64>) {
    let covariance = edge.information.try_inverse().unwrap_or_else(|| 1e12 * Matrix6::identity());
    if edge.source == from {
        (edge.target, edge.target_from_source, covariance)
    } else {
        // exp(x) Z inverted is Z^-1 exp(-x) = exp(-Ad(Z^-1) x) Z^-1.
        let back = edge.target_from_source.inverse();
        let carried = adjoint(&back) * covariance * adjoint(&back).transpose();
        (edge.source, back, carried)
    }
}

/// Goes around.
pub fn go_around(edges: &[GraphEdge], numbers: &[usize], start: usize) -> EdgeLoop {
    let (mut at, mut motion, mut covariance) = (start, Rigid::identity(), Matrix6::zeros());
    for &number in numbers {
        let (next, along, spread) = step(&edges[number], at);
        let carry = adjoint(&along);
        covariance = carry * covariance * carry.transpose() + spread;
        motion = along.compose(&motion);
        at = next;
    }
    let twist = log(&motion);
    let chi_squared = match covariance.cholesky() {
        Some(factors) => twist.dot(&factors.solve(&twist)),
        None => f64::INFINITY,
    };
    EdgeLoop { edges: numbers.to_vec(), error: motion, chi_squared, implied: false }
}

/// The triangles of the graph, and pairs that were measured twice. Edges whose `likely` is 0 are none.
pub fn triangles(nodes: usize, edges: &[GraphEdge], likely: &[f64]) -> Vec<EdgeLoop> {
    let mut between: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
    let mut near = vec![BTreeSet::new(); nodes];
    for (number, edge) in edges.iter().enumerate().filter(|(number, _)| likely[*number] > 0.0) {
        let (a, b) = (edge.source.min(edge.target), edge.source.max(edge.target));
        between.entry((a, b)).or_default().push(number);
        near[a].insert(b);
        near[b].insert(a);
    }
    let edge_of = |a: usize, b: usize| between.get(&(a.min(b), a.max(b))).and_then(|e| e.first()).copied();
    let mut seen = vec![0; edges.len()];
    let mut found = Vec::new();
    for (&(a, b), numbers) in &between {
        for pair in numbers.windows(2) {
            found.push(go_around(edges, pair, edges[pair[0]].source));
        }
        for &c in near[a].intersection(&near[b]).filter(|&&c| c > b) {
            let (Some(ab), Some(bc), Some(ca)) = (edge_of(a, b), edge_of(b, c), edge_of(c, a)) else {
                continue;
            };
            if [ab, bc, ca].iter().any(|e| seen[*e] < TRIANGLES_PER_EDGE) {
                [ab, bc, ca].iter().for_each(|e| seen[*e] += 1);
                found.push(go_around(edges, &[ab, bc, ca], a));
            }
        }
    }
    found
}

/// For the edges that are `asked` and outside a spanning tree of the likeliest edges, the way round by the tree, if it is short. Many
/// long loops share an edge, and would say the same thing again and again: ask only edges of which triangles say nothing.
pub fn ways_round(nodes: usize, edges: &[GraphEdge], likely: &[f64], asked: &[bool]) -> Vec<EdgeLoop> {
    let tree = spanning_tree(nodes, edges, likely);
    let mut found = Vec::new();
    for (number, edge) in
        edges.iter().enumerate().filter(|(number, _)| asked[*number] && likely[*number] > 0.0)
    {
        if let Some(way) = tree.way(edge.target, edge.source)
            && (3..LONGEST).contains(&way.len())
        {
            let numbers: Vec<usize> = std::iter::once(number).chain(way).collect();
            found.push(go_around(edges, &numbers, edge.source));
        }
    }
    found
}

#[cfg(test)]
pub mod tests {
    use nalgebra::Vector6;

    use super::*;
    use crate::se3::exp;

    /// Poses around a circle.
    pub fn ring(n: usize) -> Vec<Rigid> {
        (0..n)
            .map(|i| {
                let turn = std::f64::consts::TAU * i as f64 / n as f64;
                exp(&Vector6::new(0.0, 0.0, turn, 0.0, 0.0, 0.0)).compose(&exp(&Vector6::new(
                    0.1 * turn.sin(),
                    0.0,
                    0.0,
                    4.0,
                    0.0,
                    0.0,
                )))
            })
            .collect()
    }

    /// The exact edge between two poses, with a standard deviation of 0.05 each way.
    pub fn exact(poses: &[Rigid], source: usize, target: usize) -> GraphEdge {
        GraphEdge {
            source,
            target,
            target_from_source: poses[target].inverse().compose(&poses[source]),
            information: 400.0 * Matrix6::identity(),
        }
    }

    #[test]
    fn loops_close_whichever_way_their_edges_point() {
        let poses = ring(7);
        let mut edges: Vec<GraphEdge> = (0..7).map(|i| exact(&poses, i, (i + 1) % 7)).collect();
        edges.extend([exact(&poses, 2, 0), exact(&poses, 5, 3), exact(&poses, 0, 4)]);
        let all = |edges: &[GraphEdge]| {
            let mut found = triangles(7, edges, &[1.0; 10]);
            found.extend(ways_round(7, edges, &[1.0; 10], &[true; 10]));
            found
        };
        let found = all(&edges);
        assert!(found.len() >= 4, "{}", found.len());
        assert!(found.iter().all(|l| l.chi_squared < 1e-9 && l.closes() == Some(true)));
        // One wrong edge spoils the loops that it is in, and no others.
        edges[7].target_from_source.translation.x += 2.0;
        for l in all(&edges) {
            assert_eq!(l.closes(), Some(!l.edges.contains(&7)), "{l:?}");
        }
    }

    #[test]
    fn two_measurements_of_one_pair_are_compared() {
        let poses = ring(5);
        let mut twice = vec![exact(&poses, 0, 1), exact(&poses, 1, 0)];
        assert_eq!(triangles(5, &twice, &[1.0; 2])[0].closes(), Some(true));
        twice[1].target_from_source.translation.y += 2.0;
        let found = triangles(5, &twice, &[1.0; 2]);
        assert_eq!((found.len(), found[0].closes()), (1, Some(false)));
    }
}
