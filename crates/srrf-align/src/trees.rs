//! Spanning trees and connected components of a graph of edges.

use std::collections::VecDeque;

use crate::graph::GraphEdge;

/// A spanning forest: for each node the edge to its parent.
#[derive(Debug, Clone)]
pub struct Forest {
    /// (parent, edge), `None` at roots.
    parent: Vec<Option<(usize, usize)>>,
    /// Nodes, parents first.
    pub order: Vec<usize>,
    depth: Vec<usize>,
}

/// The forest of the likeliest edges (Kruskal); of equals the first. Edges whose `likely` is not above 0 are no edges. The root of
/// each tree is its lowest node.
pub fn spanning_tree(nodes: usize, edges: &[GraphEdge], likely: &[f64]) -> Forest {
    let mut order: Vec<usize> = (0..edges.len()).filter(|e| likely[*e] > 0.0).collect();
    order.sort_by(|a, b| likely[*b].total_cmp(&likely[*a]).then(a.cmp(b)));
    let mut union = Union::new(nodes);
    let mut near = vec![Vec::new(); nodes];
    for number in order {
        let (a, b) = (edges[number].source, edges[number].target);
        if union.join(a, b) {
            near[a].push((b, number));
            near[b].push((a, number));
        }
    }
    let mut forest = Forest { parent: vec![None; nodes], order: Vec::new(), depth: vec![0; nodes] };
    let mut seen = vec![false; nodes];
    for root in 0..nodes {
        let mut queue = VecDeque::from([root]);
        while let Some(at) = queue.pop_front() {
            if std::mem::replace(&mut seen[at], true) {
                continue;
            }
            forest.order.push(at);
            for &(next, number) in near[at].iter().filter(|(next, _)| !seen[*next]) {
                forest.parent[next] = Some((at, number));
                forest.depth[next] = forest.depth[at] + 1;
                queue.push_back(next);
            }
        }
    }
    forest
}

impl Forest {
    /// The edge to the parent and the parent.
    pub fn parent(&self, node: usize) -> Option<(usize, usize)> {
        self.parent[node]
    }

    /// The edges from one node to another; `None` in different trees.
    pub fn way(&self, from: usize, to: usize) -> Option<Vec<usize>> {
        let (mut a, mut b) = (from, to);
        let (mut up, mut down) = (Vec::new(), Vec::new());
        while a != b {
            let (node, list) =
                if self.depth[a] >= self.depth[b] { (&mut a, &mut up) } else { (&mut b, &mut down) };
            let (next, edge) = self.parent[*node]?;
            list.push(edge);
            *node = next;
        }
        down.reverse();
        up.extend(down);
        Some(up)
    }
}

/// Sets that are joined (union by the lowest number).
#[derive(Debug, Clone)]
pub struct Union(Vec<usize>);

impl Union {
    /// `n` sets of one.
    pub fn new(n: usize) -> Self {
        Self((0..n).collect())
    }

    /// The lowest member of a set.
    pub fn find(&mut self, node: usize) -> usize {
        let mut root = node;
        while self.0[root] != root {
            root = self.0[root];
        }
        let mut at = node;
        while self.0[at] != root {
            at = std::mem::replace(&mut self.0[at], root);
        }
        root
    }

    /// Joins two sets; false where they were one.
    pub fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b)] = a.min(b);
        a != b
    }
}

/// The connected components over the edges that are `kept`: members ascending, the largest component first, of equals that with the
/// lowest member.
pub fn components(nodes: usize, edges: &[GraphEdge], kept: &[bool]) -> Vec<Vec<usize>> {
    let mut union = Union::new(nodes);
    for (edge, _) in edges.iter().zip(kept).filter(|(_, kept)| **kept) {
        union.join(edge.source, edge.target);
    }
    let mut groups: Vec<Vec<usize>> = vec![Vec::new(); nodes];
    (0..nodes).for_each(|node| {
        let root = union.find(node);
        groups[root].push(node);
    });
    groups.retain(|g| !g.is_empty());
    groups.sort_by_key(|g| (usize::MAX - g.len(), g[0]));
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loops::tests::{exact, ring};

    #[test]
    fn the_likeliest_edges_make_the_tree_and_ways_go_along_it() {
        let poses = ring(6);
        let edges = [(0, 1), (2, 1), (0, 2), (3, 2), (4, 5)].map(|(a, b)| exact(&poses, a, b));
        let forest = spanning_tree(6, &edges, &[0.5, 0.9, 0.7, 0.8, 0.6]);
        assert_eq!(forest.parent(0), None);
        assert_eq!((forest.parent(2), forest.parent(1)), (Some((0, 2)), Some((2, 1))));
        assert_eq!((forest.way(1, 3), forest.way(3, 0)), (Some(vec![1, 3]), Some(vec![3, 2])));
        assert_eq!((forest.way(1, 4), forest.way(5, 5)), (None, Some(vec![])));
        let without = spanning_tree(6, &edges, &[0.5, 0.9, 0.7, 0.0, 0.6]);
        assert_eq!(without.way(3, 0), None);
    }

    #[test]
    fn components_come_by_size() {
        let poses = ring(6);
        let edges = [(4, 5), (0, 3), (3, 1)].map(|(a, b)| exact(&poses, a, b));
        assert_eq!(components(6, &edges, &[true; 3]), [vec![0, 1, 3], vec![4, 5], vec![2]]);
        assert_eq!(components(6, &edges, &[true, false, false])[0], [4, 5]);
    }
}
