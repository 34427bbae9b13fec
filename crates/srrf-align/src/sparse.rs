//! [`BlockSystem`]: sparse symmetric equations in blocks of six unknowns, solved by a block Cholesky factorisation in an order of
//! least degree; and the blocks of the inverse that covariances want.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Cholesky, Matrix6, Vector6};

/// `A x = b` with blocks of six; only the blocks that are not zero are kept.
#[derive(Debug, Clone)]
pub struct BlockSystem {
    diagonal: Vec<Matrix6<f64>>,
    /// By (larger, smaller) number: the block of that row and column.
    below: BTreeMap<(usize, usize), Matrix6<f64>>,
    /// `b`.
    pub right: Vec<Vector6<f64>>,
}

/// `P A P^T = L L^T`.
#[derive(Debug)]
pub struct BlockCholesky {
    /// Block that is eliminated at each place.
    order: Vec<usize>,
    /// Place of each block.
    place: Vec<usize>,
    /// `L_jj`, by place.
    diagonal: Vec<Matrix6<f64>>,
    /// The blocks of `L` under each of these: (place, block), places ascending.
    columns: Vec<Vec<(usize, Matrix6<f64>)>>,
}

impl BlockSystem {
    /// `n` blocks, all zero.
    pub fn new(n: usize) -> Self {
        Self { diagonal: vec![Matrix6::zeros(); n], below: BTreeMap::new(), right: vec![Vector6::zeros(); n] }
    }

    /// Adds to the block in `row` and `column`, and its transpose to the mirrored one.
    pub fn add(&mut self, row: usize, column: usize, block: &Matrix6<f64>) {
        match row.cmp(&column) {
            std::cmp::Ordering::Equal => self.diagonal[row] += block,
            std::cmp::Ordering::Greater => *self.below.entry((row, column)).or_default() += block,
            std::cmp::Ordering::Less => *self.below.entry((column, row)).or_default() += block.transpose(),
        }
    }

    /// Makes a block stay where it is: its row and column become those of the identity, its right side zero.
    pub fn hold(&mut self, block: usize) {
        self.below.retain(|(row, column), _| *row != block && *column != block);
        self.diagonal[block] = Matrix6::identity();
        self.right[block] = Vector6::zeros();
    }

    /// The factors of `A + damping diag(A)`; `None` where that is not positive definite.
    pub fn factor(&self, damping: f64) -> Option<BlockCholesky> {
        let n = self.diagonal.len();
        let mut adjacent = vec![BTreeSet::new(); n];
        for &(row, column) in self.below.keys() {
            adjacent[row].insert(column);
            adjacent[column].insert(row);
        }
        let order = least_degree(adjacent);
        let mut place = vec![0; n];
        order.iter().enumerate().for_each(|(at, &block)| place[block] = at);
        // Columns by place, each with the blocks below its diagonal.
        let mut rest: Vec<BTreeMap<usize, Matrix6<f64>>> = vec![BTreeMap::new(); n];
        let mut pivot: Vec<Matrix6<f64>> = order
            .iter()
            .map(|&b| self.diagonal[b] + damping * Matrix6::from_diagonal(&self.diagonal[b].diagonal()))
            .collect();
        for (&(row, column), block) in &self.below {
            let (a, b) = (place[row], place[column]);
            if a > b {
                rest[b].insert(a, *block)
            } else {
                rest[a].insert(b, block.transpose())
            };
        }
        let mut diagonal = Vec::with_capacity(n);
        let mut columns = Vec::with_capacity(n);
        for at in 0..n {
            let lower = Cholesky::new(pivot[at])?.l();
            let inverse = lower.try_inverse()?;
            if !inverse.iter().all(|v| v.is_finite()) {
                return None;
            }
            let column: Vec<(usize, Matrix6<f64>)> = std::mem::take(&mut rest[at])
                .into_iter()
                .map(|(row, block)| (row, block * inverse.transpose()))
                .collect();
            for (i, (row, block)) in column.iter().enumerate() {
                pivot[*row] -= block * block.transpose();
                for (lower_row, lower_block) in &column[i + 1..] {
                    *rest[*row].entry(*lower_row).or_default() -= lower_block * block.transpose();
                }
            }
            diagonal.push(lower);
            columns.push(column);
        }
        Some(BlockCholesky { order, place, diagonal, columns })
    }
}

/// An order in which eliminating fills in little: always the block with the fewest neighbours, the lowest of equals.
fn least_degree(mut adjacent: Vec<BTreeSet<usize>>) -> Vec<usize> {
    let mut queue: BTreeSet<(usize, usize)> =
        adjacent.iter().enumerate().map(|(b, a)| (a.len(), b)).collect();
    let mut order = Vec::with_capacity(adjacent.len());
    while let Some((_, block)) = queue.pop_first() {
        order.push(block);
        let neighbours: Vec<usize> = std::mem::take(&mut adjacent[block]).into_iter().collect();
        for &one in &neighbours {
            queue.remove(&(adjacent[one].len(), one));
            adjacent[one].remove(&block);
            adjacent[one].extend(neighbours.iter().filter(|&&other| other != one));
            queue.insert((adjacent[one].len(), one));
        }
    }
    order
}

impl BlockCholesky {
    /// `x`, one block an unknown; `None` where it is not finite.
    pub fn solve(&self, right: &[Vector6<f64>]) -> Option<Vec<Vector6<f64>>> {
        let mut x: Vec<Vector6<f64>> = self.order.iter().map(|&block| right[block]).collect();
        for at in 0..x.len() {
            if !self.diagonal[at].solve_lower_triangular_mut(&mut x[at]) {
                return None;
            }
            let known = x[at];
            self.columns[at].iter().for_each(|(row, block)| x[*row] -= block * known);
        }
        for at in (0..x.len()).rev() {
            for (row, block) in &self.columns[at] {
                let part = block.transpose() * x[*row];
                x[at] -= part;
            }
            if !self.diagonal[at].tr_solve_lower_triangular_mut(&mut x[at]) {
                return None;
            }
        }
        let found: Vec<Vector6<f64>> = self.place.iter().map(|&at| x[at]).collect();
        found.iter().all(|v| v.iter().all(|c| c.is_finite())).then_some(found)
    }

    /// The blocks on the diagonal of `A^-1`, one an unknown.
    ///
    /// By Takahashi's recurrence, which needs no block of the inverse outside the pattern of `L`. Source: Takahashi, Fagan and
    /// Chen, "Formation of a sparse bus impedance matrix", 1973.
    pub fn inverse_diagonal(&self) -> Option<Vec<Matrix6<f64>>> {
        let n = self.order.len();
        let mut on: Vec<Matrix6<f64>> = vec![Matrix6::zeros(); n];
        let mut below: Vec<BTreeMap<usize, Matrix6<f64>>> = vec![BTreeMap::new(); n];
        for at in (0..n).rev() {
            let inverse = self.diagonal[at].try_inverse()?;
            let scaled: Vec<(usize, Matrix6<f64>)> =
                self.columns[at].iter().map(|(row, block)| (*row, block * inverse)).collect();
            let mut own = inverse.transpose() * inverse;
            for &(row, _) in &scaled {
                let mut sum = Matrix6::zeros();
                for (other, block) in &scaled {
                    // The pattern of L holds every pair of rows of a column.
                    let between = match row.cmp(other) {
                        std::cmp::Ordering::Equal => on[row],
                        std::cmp::Ordering::Greater => *below[*other].get(&row)?,
                        std::cmp::Ordering::Less => below[row].get(other)?.transpose(),
                    };
                    sum -= between * block;
                }
                below[at].insert(row, sum);
            }
            for (row, block) in &scaled {
                own -= below[at].get(row)?.transpose() * block;
            }
            on[at] = 0.5 * (own + own.transpose());
        }
        Some(self.place.iter().map(|&at| on[at]).collect())
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// A ring with chords, and the same densely.
    fn example(n: usize) -> (BlockSystem, DMatrix<f64>) {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut system = BlockSystem::new(n);
        let mut dense = DMatrix::zeros(6 * n, 6 * n);
        let mut pairs: Vec<(usize, usize)> = (0..n).map(|i| (i, (i + 1) % n)).collect();
        pairs.extend([(0, 5), (3, 8), (2, 9)]);
        for (i, j) in pairs {
            let a = Matrix6::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let b = Matrix6::from_fn(|_, _| rng.random_range(-1.0..1.0));
            for (r, c, block) in
                [(i, i, a.transpose() * a), (j, j, b.transpose() * b), (i, j, a.transpose() * b)]
            {
                system.add(r, c, &block);
                let mut view = dense.view_mut((6 * r, 6 * c), (6, 6));
                view += block;
                if r != c {
                    let mut mirrored = dense.view_mut((6 * c, 6 * r), (6, 6));
                    mirrored += block.transpose();
                }
            }
        }
        for i in 0..n {
            system.right[i] = Vector6::from_fn(|_, _| rng.random_range(-1.0..1.0));
            system.add(i, i, &(0.1 * Matrix6::identity()));
            let mut view = dense.view_mut((6 * i, 6 * i), (6, 6));
            view += 0.1 * Matrix6::identity();
        }
        (system, dense)
    }

    #[test]
    fn solves_as_a_dense_solver_does() {
        let (system, mut dense) = example(11);
        let right = DVector::from_iterator(66, system.right.iter().flat_map(|v| v.iter().copied()));
        let expected = dense.clone().cholesky().unwrap().solve(&right);
        let found = system.factor(0.0).unwrap().solve(&system.right).unwrap();
        for (i, value) in found.iter().flat_map(|v| v.iter()).enumerate() {
            assert!((value - expected[i]).abs() < 1e-9, "{i}: {value} {}", expected[i]);
        }
        let diagonal = DMatrix::from_diagonal(&dense.diagonal());
        dense += 0.5 * diagonal;
        let damped = system.factor(0.5).unwrap().solve(&system.right).unwrap();
        assert!((damped[7][2] - dense.cholesky().unwrap().solve(&right)[44]).abs() < 1e-9);
    }

    #[test]
    fn the_inverse_has_the_blocks_of_the_dense_one() {
        let (system, dense) = example(11);
        let inverse = dense.try_inverse().unwrap();
        let blocks = system.factor(0.0).unwrap().inverse_diagonal().unwrap();
        for (i, block) in blocks.iter().enumerate() {
            let expected = inverse.view((6 * i, 6 * i), (6, 6));
            assert!((block - expected).norm() < 1e-8 * expected.norm(), "{i}");
        }
    }

    #[test]
    fn a_held_block_stays_and_no_solution_is_none() {
        let (mut system, _) = example(11);
        system.hold(4);
        assert_eq!(system.factor(0.0).unwrap().solve(&system.right).unwrap()[4], Vector6::zeros());
        assert!(BlockSystem::new(3).factor(0.0).is_none());
    }

    #[test]
    fn a_chain_fills_nothing_in() {
        let n = 40;
        let mut system = BlockSystem::new(n);
        for i in 0..n {
            system.add(i, i, &(3.0 * Matrix6::identity()));
            if i > 0 {
                system.add(i, i - 1, &-Matrix6::identity());
            }
        }
        let factors = system.factor(0.0).unwrap();
        assert_eq!(factors.columns.iter().map(Vec::len).sum::<usize>(), n - 1);
    }
}
