//! Whether rows of many numbers, of which nothing says what they are, can be points.

use super::FormatError;

/// Columns of a point, at most, where there are few rows.
const FEW: u64 = 16;
/// Rows for each column, at least, where there are more: pictures have fewer.
const ROWS: u64 = 8;
/// Fewest rows in which the same step is no chance.
const STEPS: usize = 8;

/// Whether a table is too wide for its height: a picture, or points as columns.
pub(super) fn is_wide(rows: u64, columns: u64) -> bool {
    rows > 0 && columns > FEW && rows < columns.saturating_mul(ROWS)
}

/// Refuses a first column that grows by the same step in each row, where more columns follow than x, y and z: it is
/// the number of the row, or a time.
///
/// # Errors
/// [`FormatError::Unclear`].
pub(super) fn check_first_column(points: &[[f64; 3]]) -> Result<(), FormatError> {
    let [first, .., last] = points else { return Ok(()) };
    let (begin, step) = (first[0], (last[0] - first[0]) / (points.len() - 1) as f64);
    // Times of today have no more than three digits behind their steps.
    let in_step =
        |(row, point): (usize, &[f64; 3])| (point[0] - (begin + step * row as f64)).abs() <= 1e-3 * step;
    if points.len() < STEPS || step <= 0.0 || !points.iter().enumerate().all(in_step) {
        return Ok(());
    }
    Err(FormatError::unclear(
        format!(
            "the first column grows by {step} in each row, as the number of a row or a time does, and more than three columns \
             follow each other without names: which are x, y and z, such as 2,3,4"
        ),
        "--columns",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_tables_are_no_points() {
        for (rows, columns, wide) in
            [(3, 17, true), (480, 640, true), (640, 480, true), (40, 16, false), (1000, 36, false)]
        {
            assert_eq!(is_wide(rows, columns), wide, "{rows} x {columns}");
        }
    }

    #[test]
    fn a_column_that_counts_is_no_coordinate() {
        let of = |x: &dyn Fn(usize) -> f64, rows: usize| {
            check_first_column(&(0..rows).map(|row| [x(row), 0.5, 2.0]).collect::<Vec<_>>()).is_ok()
        };
        assert!(!of(&|row| row as f64, 8) && !of(&|row| 1.7e9 + 0.1 * row as f64, 40));
        assert!(of(&|row| row as f64, 7), "few rows say nothing");
        assert!(of(&|row| (row / 2) as f64, 40) && of(&|row| (row * row) as f64, 40) && of(&|_| 1.0, 40));
    }
}
