//! [`CompatibilityGraph`]: which matches can be right together.

use rayon::prelude::*;

/// Matches as nodes, with an edge where a rigid motion can carry both: the two source points are as far from each other as the two
/// target points. Held as one bit a pair: 2 MB for 4,000 matches.
#[derive(Debug)]
pub(crate) struct CompatibilityGraph {
    /// Words of a row.
    words: usize,
    rows: Vec<u64>,
}

/// An edge and the number of nodes that are neighbours of both ends: second-order compatibility (Chen et al. 2022, SC2-PCR). Wrong
/// matches agree with some right ones by chance; two that agree by chance hardly have common neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Edge {
    pub ends: [u32; 2],
    pub common: u32,
}

impl CompatibilityGraph {
    /// `source[i]` is matched with `target[i]`. Lengths may differ by `tolerance`; edges shorter than that say nothing.
    pub fn new(source: &[[f64; 3]], target: &[[f64; 3]], tolerance: f64) -> Self {
        let (n, words) = (source.len(), source.len().div_ceil(64));
        // Relative to the first point, so that single precision, of which a register holds twice as many, keeps the digits.
        let planes = |points: &[[f64; 3]]| -> [Vec<f32>; 3] {
            std::array::from_fn(|c| points.iter().map(|p| (p[c] - points[0][c]) as f32).collect())
        };
        let (source, target, tolerance) = (planes(source), planes(target), tolerance as f32);
        let mut rows = vec![0; n * words];
        rows.par_chunks_mut(words.max(1)).enumerate().for_each(|(i, row)| {
            let length = |of: &[Vec<f32>; 3], j: usize| {
                let squared = |c: usize| (of[c][i] - of[c][j]) * (of[c][i] - of[c][j]);
                (squared(0) + squared(1) + squared(2)).sqrt()
            };
            for (w, word) in row.iter_mut().enumerate() {
                let mut bits = [false; 64];
                let first = w * 64;
                for (b, bit) in bits.iter_mut().enumerate().take(n - first) {
                    let (in_source, in_target) = (length(&source, first + b), length(&target, first + b));
                    let long = (in_source > tolerance) & (in_target > tolerance);
                    *bit = long & ((in_source - in_target).abs() <= tolerance);
                }
                *word = bits.iter().rev().fold(0, |word, bit| (word << 1) | u64::from(*bit));
            }
        });
        Self { words, rows }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.rows.len() / self.words.max(1)
    }

    /// The neighbours of a node, a bit each.
    pub fn row(&self, i: usize) -> &[u64] {
        &self.rows[i * self.words..(i + 1) * self.words]
    }

    /// The edges with most common neighbours, best first: at most `of_each` of a node with later nodes, at most `most` in all.
    pub fn best_edges(&self, of_each: usize, most: usize) -> Vec<Edge> {
        let better = |a: &Edge, b: &Edge| b.common.cmp(&a.common).then(a.ends.cmp(&b.ends));
        let of_node = |i: usize| {
            let row = self.row(i);
            let mut best: Vec<Edge> = Vec::with_capacity(of_each + 1);
            for j in members(row).filter(|j| *j > i) {
                let edge = Edge { ends: [i as u32, j as u32], common: shared(row, self.row(j)) };
                if edge.common > 0 && (best.len() < of_each || edge.common > best[best.len() - 1].common) {
                    let place = best.partition_point(|b| b.common >= edge.common);
                    best.insert(place, edge);
                    best.truncate(of_each);
                }
            }
            best
        };
        let mut edges: Vec<Edge> = (0..self.len()).into_par_iter().flat_map_iter(of_node).collect();
        edges.sort_unstable_by(better);
        edges.truncate(most);
        edges
    }

    /// A set of nodes around an edge of which nearly all are neighbours of each other: the ends, the common neighbour that shares most
    /// of the others with them, and those.
    pub fn around(&self, edge: &Edge) -> Vec<usize> {
        let [i, j] = edge.ends.map(|end| end as usize);
        let common: Vec<u64> = self.row(i).iter().zip(self.row(j)).map(|(a, b)| a & b).collect();
        let third = members(&common)
            .map(|z| (shared(&common, self.row(z)), z))
            .max_by_key(|(n, z)| (*n, usize::MAX - z));
        let mut set = vec![i, j];
        if let Some((_, z)) = third {
            set.push(z);
            let of_all: Vec<u64> = common.iter().zip(self.row(z)).map(|(a, b)| a & b).collect();
            set.extend(members(&of_all));
        }
        set
    }
}

/// Number of bits that both have.
fn shared(a: &[u64], b: &[u64]) -> u32 {
    a.iter().zip(b).map(|(a, b)| (a & b).count_ones()).sum()
}

/// Places of the bits of a row.
fn members(row: &[u64]) -> impl Iterator<Item = usize> + '_ {
    row.iter().enumerate().flat_map(|(w, word)| {
        let mut rest = *word;
        std::iter::from_fn(move || {
            let bit = rest.trailing_zeros() as usize;
            rest &= rest.wrapping_sub(1);
            (bit < 64).then_some(64 * w + bit)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on a line, `target` moved by 3 but for the last, which is off.
    fn line(n: usize) -> CompatibilityGraph {
        let source: Vec<[f64; 3]> = (0..n).map(|i| [i as f64, 0.0, 0.0]).collect();
        let mut target: Vec<[f64; 3]> = source.iter().map(|p| [p[0] + 3.0, 0.0, 0.0]).collect();
        target[n - 1] = [0.0, 500.0, 0.0];
        CompatibilityGraph::new(&source, &target, 0.1)
    }

    #[test]
    fn right_matches_are_neighbours_and_a_wrong_one_is_alone() {
        let graph = line(131);
        assert_eq!(graph.len(), 131);
        for i in 0..130 {
            assert_eq!(
                members(graph.row(i)).collect::<Vec<_>>(),
                (0..130).filter(|j| *j != i).collect::<Vec<_>>()
            );
        }
        assert_eq!(members(graph.row(130)).count(), 0);
    }

    #[test]
    fn edges_count_common_neighbours_and_sets_hold_them() {
        let graph = line(131);
        let edges = graph.best_edges(2, 50);
        assert_eq!(edges.len(), 50);
        assert_eq!(edges[0], Edge { ends: [0, 1], common: 128 });
        assert!(edges.iter().all(|e| e.common == 128 && e.ends[0] < e.ends[1]));
        let mut set = graph.around(&edges[7]);
        set.sort_unstable();
        assert_eq!(set, (0..130).collect::<Vec<_>>());
    }

    #[test]
    fn nothing_and_one_match_have_no_edges() {
        assert!(CompatibilityGraph::new(&[], &[], 0.1).best_edges(3, 9).is_empty());
        assert!(CompatibilityGraph::new(&[[0.0; 3]], &[[1.0; 3]], 0.1).best_edges(3, 9).is_empty());
    }
}
