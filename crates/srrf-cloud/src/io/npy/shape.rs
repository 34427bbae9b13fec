//! Which shapes of arrays are points.

use super::super::FormatError;
use super::super::scalar::Scalar;
use super::super::width::is_wide;
use super::header::{Descr, NpyKind};

/// A shape without the axes of length 1 behind that of the coordinates.
pub(super) fn squeezed(shape: &[u64]) -> &[u64] {
    let end = shape.iter().rposition(|&axis| axis != 1).map_or(0, |at| at + 1);
    match &shape[..end] {
        inner @ [_, .., 3..=16] => inner,
        _ => shape,
    }
}

/// Whether an array is rows and columns of colours.
pub(super) fn is_picture(shape: &[u64], descr: &Descr) -> bool {
    let bytes = matches!(descr, Descr::Plain(NpyKind { scalar: Scalar::U8, .. }));
    bytes && matches!(shape, [height, width, 3 | 4] if *height > 1 && *width > 1)
}

/// Rows and columns of an array of this shape.
///
/// # Errors
/// What is wrong with the shape, and the way out.
pub(super) fn rows_and_columns(shape: &[u64], asked: bool) -> Result<(u64, u64), FormatError> {
    let shape = squeezed(shape);
    let wrong = |hint: &str| {
        Err(FormatError::Content(format!(
            "the array has shape {shape:?}, [points, 3] or wider is expected{hint}"
        )))
    };
    let transposed = "; it looks transposed: save `array.T`, or say `--columns 1,2,3` if its rows are points";
    let wide = "; it looks transposed, or is a picture: save `array.T`, make a cloud of a depth picture with the camera's \
                numbers (Open3D does), or say `--columns 1,2,3` if its rows are points";
    if shape.is_empty() {
        return wrong("; it is a single number");
    }
    let (Some(&columns), Some(rows)) =
        (shape.last(), shape.iter().rev().skip(1).try_fold(1u64, |n, &axis| n.checked_mul(axis)))
    else {
        return wrong(", which no memory holds");
    };
    match shape {
        [_] | [] => wrong("; is it a flat list of numbers? Save `array.reshape(-1, 3)`"),
        [.., 3 | 4, 4] if shape.len() > 2 && !asked => {
            wrong("; these are poses (matrices of 4 columns), not points; if they are, say `--columns 1,2,3`")
        }
        [3, _] if columns != 3 && columns > 4 && !asked => wrong(transposed),
        [3, 1 | 2] => wrong("; transpose it"),
        &[rows, columns] if is_wide(rows, columns) && !asked => wrong(wide),
        [_, _] if columns >= 3 => Ok((rows, columns)),
        [.., 3, _] | [3, _, _] if columns != 3 => {
            wrong("; it looks transposed: the last axis has to be x, y, z")
        }
        [_, _, ..] if shape.len() > 2 && (3..=16).contains(&columns) => Ok((rows, columns)),
        _ => wrong(""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_of_points() {
        for (shape, rows, columns) in [
            (&[40, 3][..], 40, 3),
            (&[40, 3, 1], 40, 3),
            (&[1, 40, 3, 1, 1], 40, 3),
            (&[5, 8, 4], 40, 4),
            (&[1000, 36], 1000, 36),
            (&[1, 3], 1, 3),
        ] {
            assert_eq!(rows_and_columns(shape, false), Ok((rows, columns)), "{shape:?}");
        }
        for (shape, words) in [
            (&[][..], "a single number"),
            (&[120], "array.reshape(-1, 3)"),
            (&[3, 40], "array.T"),
            (&[6, 40], "array.T"),
            (&[480, 640], "depth picture"),
            (&[640, 480], "depth picture"),
            (&[5, 3, 4], "these are poses"),
            (&[5, 4, 4], "these are poses"),
            (&[3, 5, 8], "the last axis"),
        ] {
            let error = rows_and_columns(shape, false).unwrap_err().to_string();
            assert!(error.contains(words), "{shape:?}: {error}");
        }
        assert_eq!(rows_and_columns(&[480, 640], true), Ok((480, 640)), "as asked");
    }
}
