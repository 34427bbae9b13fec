//! One-to-one matches of an assignment: the Hungarian method.

use burn::tensor::{Tensor, TensorData};
use srrf_model::ops::{CopyError, rows, to_host};

/// A node whose row or column sums to less has no match.
const LEAST_SUM: f64 = 0.5;

/// The match of each source point by the Hungarian method, and its weight: the assignment's entry, 0 for
/// nodes without a match (all count where fewer than 3 would). Weights sum to 1 in each cloud.
///
/// # Shapes
/// - `assignment`: `[batch, n, m]`, `target_points`: `[batch, m, 3]`
/// - output: `[batch, n, 3]` and `[batch, n, 1]`
pub(super) fn one_to_one(
    assignment: &Tensor<3>,
    target_points: &Tensor<3>,
) -> Result<(Tensor<3>, Tensor<3>), CopyError> {
    let [batch, n, m] = assignment.dims();
    let values: Vec<f64> = to_host(assignment)?;
    let (mut chosen, mut weights) = (Vec::with_capacity(batch * n), Vec::with_capacity(batch * n));
    for (cloud, s) in values.chunks_exact((n * m).max(1)).enumerate() {
        let columns = hungarian(s, n, m);
        let row_sum = |i: usize| s[i * m..(i + 1) * m].iter().sum::<f64>();
        let column_sum = |j: usize| (0..n).map(|i| s[i * m + j]).sum::<f64>();
        let matched = |i: usize| {
            let j = columns[i]?;
            (row_sum(i) >= LEAST_SUM && column_sum(j) >= LEAST_SUM).then_some(s[i * m + j])
        };
        let mut found: Vec<f64> = (0..n).map(|i| matched(i).unwrap_or(0.0)).collect();
        if found.iter().filter(|w| **w > 0.0).count() < 3 {
            found = (0..n).map(|i| columns[i].map_or(0.0, |j| s[i * m + j].max(1e-12))).collect();
        }
        let sum: f64 = found.iter().sum();
        weights.extend(found.iter().map(|w| w / sum.max(f64::MIN_POSITIVE)));
        chosen.extend(columns.iter().map(|j| (cloud * m + j.unwrap_or(0)) as i64));
    }
    let points = rows(target_points.clone().reshape([batch * m, 3]), &chosen).reshape([batch, n, 3]);
    let device = assignment.device().without_autodiff();
    let weights = TensorData::new(weights, [batch, n, 1]);
    Ok((points, Tensor::from_data(weights, (&device, assignment.dtype()))))
}

/// The assignment of rows to columns with the largest sum of `scores` (`n x m`, row-major): the column
/// of each row, none for rows that are too many. Shortest augmenting paths, `O(n^2 m)`.
fn hungarian(scores: &[f64], n: usize, m: usize) -> Vec<Option<usize>> {
    if n > m {
        let transposed: Vec<f64> = (0..n * m).map(|i| scores[(i % n) * m + i / n]).collect();
        let mut columns = vec![None; n];
        for (column, row) in hungarian(&transposed, m, n).into_iter().enumerate() {
            if let Some(row) = row {
                columns[row] = Some(column);
            }
        }
        return columns;
    }
    // Rows and columns count from 1; column 0 stands for "none".
    let (mut row_price, mut column_price) = (vec![0.0; n + 1], vec![0.0; m + 1]);
    let mut row_of = vec![0_usize; m + 1];
    for row in 1..=n {
        row_of[0] = row;
        let (mut least, mut from, mut done) =
            (vec![f64::INFINITY; m + 1], vec![0_usize; m + 1], vec![false; m + 1]);
        let mut column = 0;
        while row_of[column] != 0 {
            done[column] = true;
            let i = row_of[column];
            let (mut step, mut next) = (f64::INFINITY, 0);
            for j in 1..=m {
                if done[j] {
                    continue;
                }
                let cost = -scores[(i - 1) * m + j - 1] - row_price[i] - column_price[j];
                if cost < least[j] {
                    (least[j], from[j]) = (cost, column);
                }
                if least[j] < step {
                    (step, next) = (least[j], j);
                }
            }
            if next == 0 {
                return vec![None; n]; // scores that are not numbers
            }
            for j in 0..=m {
                if done[j] {
                    row_price[row_of[j]] += step;
                    column_price[j] -= step;
                } else {
                    least[j] -= step;
                }
            }
            column = next;
        }
        while column != 0 {
            let before = from[column];
            row_of[column] = row_of[before];
            column = before;
        }
    }
    let mut columns = vec![None; n];
    for (j, &row) in row_of.iter().enumerate().skip(1) {
        if row > 0 {
            columns[row - 1] = Some(j - 1);
        }
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scores(count: usize) -> Vec<f64> {
        (0..count).map(|i| ((i * i) as f64 * 0.713).sin()).collect()
    }

    #[test]
    fn the_hungarian_method_finds_the_best_of_all() {
        fn best(s: &[f64], m: usize, row: usize, used: &mut Vec<usize>) -> f64 {
            if row * m == s.len() {
                return 0.0;
            }
            let mut top = f64::NEG_INFINITY;
            for j in 0..m {
                if !used.contains(&j) {
                    used.push(j);
                    top = top.max(s[row * m + j] + best(s, m, row + 1, used));
                    used.pop();
                }
            }
            top
        }
        let (n, m) = (5, 6);
        for shift in 0..9 {
            let s = &scores(n * m + shift)[shift..];
            let columns = hungarian(s, n, m);
            let sum: f64 = columns.iter().enumerate().map(|(i, j)| s[i * m + j.unwrap()]).sum();
            assert!((sum - best(s, m, 0, &mut vec![])).abs() < 1e-12);
            // The same assignment from the other side.
            let transposed: Vec<f64> = (0..n * m).map(|i| s[(i % n) * m + i / n]).collect();
            let rows = hungarian(&transposed, m, n);
            assert_eq!(rows.iter().filter(|r| r.is_none()).count(), 1);
            for (j, i) in rows.iter().enumerate() {
                assert!(i.is_none_or(|i| columns[i] == Some(j)));
            }
        }
        assert_eq!(hungarian(&[f64::NAN; 4], 2, 2), [None, None]);
    }
}
