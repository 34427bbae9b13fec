//! Poses that are given as clouds: trajectories and matrices.

use super::FormatError;

/// How far lengths may be from 1 and products from 0, as four decimals give them.
const TOLERANCE: f64 = 2e-3;

/// Refuses rows of numbers that are poses and no points: a 4 x 4 or 3 x 4 matrix, one matrix in each row (KITTI), or
/// a place and a unit quaternion in each row (TUM). `rows` are looked at until one is a point; `None` is a row that
/// holds more than numbers.
///
/// # Errors
/// [`FormatError::Unclear`], which says what they look like.
pub(super) fn poses_not_points(
    rows: impl Iterator<Item = Option<Vec<f64>>>,
    count: usize,
) -> Result<(), FormatError> {
    let mut rows = rows.peekable();
    let width = match rows.peek() {
        Some(Some(row)) => row.len(),
        _ => return Ok(()),
    };
    let what = match (count, width) {
        (3 | 4, 4) => {
            let matrix: Vec<f64> = rows.map_while(|row| row.filter(|row| row.len() == 4)).flatten().collect();
            let transposed = || (0..16).map(|at| matrix[4 * (at % 4) + at / 4]).collect::<Vec<f64>>();
            (is_rigid(&matrix) || (matrix.len() == 16 && is_rigid(&transposed())))
                .then_some("a pose (a matrix of 4 columns), not a cloud")
        }
        (6.., 4) => are_matrices(rows, count)
            .then_some("poses (matrices of 4 columns, one under the other), not a cloud"),
        (5.., 3) if count.is_multiple_of(5) => are_numbered_matrices(rows)
            .then_some("poses (matrices with their numbers, as a .log has them), not a cloud"),
        (_, 12 | 16) => rows
            .all(|row| row.is_some_and(|row| is_rigid(&row)))
            .then_some("poses (a matrix in each row, as KITTI has them), not a cloud"),
        (2.., 7) => rows
            .all(|row| row.is_some_and(|row| row.len() == 7 && is_unit(&row[3..])))
            .then_some("a trajectory (place and quaternion in each row), not a cloud"),
        (2.., 8) => rows
            .all(|row| row.is_some_and(|row| row.len() == 8 && is_unit(&row[4..])))
            .then_some("a trajectory (time, place and quaternion in each row, as TUM has them), not a cloud"),
        _ => None,
    };
    what.map_or(Ok(()), |what| {
        Err(FormatError::unclear(
            format!("this looks like {what}; if three of its columns are points all the same, such as 2,3,4"),
            "--columns",
        ))
    })
}

/// Whether all rows have 4 numbers and are rigid motions of 4 or of 3 rows, one under the other.
fn are_matrices(rows: impl Iterator<Item = Option<Vec<f64>>>, count: usize) -> bool {
    let mut rows = rows.map_while(|row| row.filter(|row| row.len() == 4));
    let mut block: Vec<f64> = rows.by_ref().take(4).flatten().collect();
    let height = match () {
        () if count.is_multiple_of(4) && is_rigid(&block) => 4,
        () if count.is_multiple_of(3) && block.len() == 16 && is_rigid(&block[..12]) => 3,
        () => return false,
    };
    block.drain(..4 * height);
    let mut seen = 4;
    for row in rows {
        seen += 1;
        block.extend(row);
        if block.len() == 4 * height {
            if !is_rigid(&block) {
                return false;
            }
            block.clear();
        }
    }
    seen == count && block.is_empty()
}

/// Whether three numbers and a rigid motion of 4 rows come in turn.
fn are_numbered_matrices(mut rows: impl Iterator<Item = Option<Vec<f64>>>) -> bool {
    loop {
        match rows.next() {
            None => return true,
            Some(Some(numbers)) if numbers.len() == 3 => {}
            Some(_) => return false,
        }
        let matrix: Vec<f64> =
            rows.by_ref().take(4).flatten().filter(|row| row.len() == 4).flatten().collect();
        if matrix.len() != 16 || !is_rigid(&matrix) {
            return false;
        }
    }
}

fn is_unit(numbers: &[f64]) -> bool {
    (numbers.iter().map(|v| v * v).sum::<f64>().sqrt() - 1.0).abs() < TOLERANCE
}

/// 12 or 16 numbers, rows of 4, of a rigid motion.
fn is_rigid(m: &[f64]) -> bool {
    let close = |a: f64, b: f64| (a - b).abs() < TOLERANCE;
    let bottom =
        m.len() == 12 || (m.len() == 16 && m[12..15].iter().all(|v| close(*v, 0.0)) && close(m[15], 1.0));
    bottom
        && (0..3).all(|i| {
            is_unit(&m[4 * i..4 * i + 3])
                && (0..i).all(|j| close((0..3).map(|c| m[4 * i + c] * m[4 * j + c]).sum(), 0.0))
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str) -> Result<(), FormatError> {
        let rows: Vec<Vec<f64>> =
            text.lines().map(|line| line.split(' ').map(|word| word.parse().unwrap()).collect()).collect();
        let count = rows.len();
        poses_not_points(rows.into_iter().map(Some), count)
    }

    #[test]
    fn poses_are_told_from_points() {
        for (text, word) in [
            ("0 -1 0 5\n1 0 0 6\n0 0 1 7\n0 0 0 1", "matrix"),
            ("0 -1 0 5\n1 0 0 6\n0 0 1 7", "matrix"),
            ("0 1 0 0\n-1 0 0 0\n0 0 1 0\n5 6 7 1", "matrix"),
            (
                "0 -1 0 5\n1 0 0 6\n0 0 1 7\n0 0 0 1\n1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1",
                "one under the other",
            ),
            ("0 -1 0 5\n1 0 0 6\n0 0 1 7\n1 0 0 5\n0 1 0 6\n0 0 1 7", "one under the other"),
            ("0 0 1\n0 -1 0 5\n1 0 0 6\n0 0 1 7\n0 0 0 1", "with their numbers"),
            ("1 0 0 5 0 1 0 6 0 0 1 7\n0 -1 0 5 1 0 0 6 0 0 1 7", "KITTI"),
            ("1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1", "matrix in each row"),
            ("10.1 1 2 3 0 0 0 1\n10.2 1 2 4 0 0.6 0 0.8", "TUM"),
            ("1 2 3 0 0 0 1\n1 2 4 0 0.6 0 0.8", "trajectory"),
        ] {
            let error = check(text).unwrap_err().to_string();
            assert!(error.contains(word) && error.ends_with("`--columns`"), "{error}");
        }
        for text in [
            "1 2 3 4\n5 6 7 8\n9 1 2 3\n0 0 0 1",
            "0 -1 0 5\n1 0 0 6\n0 0 1 7\n0 0 0 1\n1 2 3 4\n5 6 7 8\n9 1 2 3\n4 5 6 7",
            "0 0 1\n0 0 2\n0 0 3\n0 0 4\n0 1 5",
            "1 2 3 0.5 0.5 0.5 9 9\n1 2 3 0 0 0 1 1",
            "1 2 3 0 0 1",
            "1 2 3 255 255 255 12\n4 5 6 1 1 1 1",
        ] {
            assert_eq!(check(text), Ok(()), "{text}");
        }
    }
}
