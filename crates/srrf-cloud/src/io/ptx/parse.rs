//! The text of a PTX file: for each scan a header of ten lines, then a line a point.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::super::FormatError;
use super::super::scan::{ByteLines, Line, number, quote};
use crate::Rigid;

/// How far the matrix of a scan may be from a rotation: headers are written with few digits.
const TOLERANCE: f64 = 1e-3;

/// The header of a scan.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PtxHeader {
    /// Scan lines, and points in each of them.
    pub columns: usize,
    pub rows: usize,
    /// Maps points of the scan into the coordinates of the file.
    pub file_from_scan: Rigid,
    /// Where the four lines of the matrix are in the file.
    pub place: Range<usize>,
}

/// A point of a scan, in the coordinates of the scanner.
pub(super) struct PtxRow {
    /// x, y, z, and intensity or colours as far as there are any; up to seven numbers.
    pub values: [f64; 7],
    pub count: usize,
}

impl PtxRow {
    /// The point; `None` where the beam did not come back, which is written as zeros.
    pub fn point(&self) -> Option<[f64; 3]> {
        let [x, y, z, ..] = self.values;
        (x != 0.0 || y != 0.0 || z != 0.0).then_some([x, y, z])
    }
}

/// Goes through the scans of a file. `header` gets the index of each scan (from 0) and says whether
/// `row` is to be called for its points; the others are passed over unread.
///
/// # Errors
/// [`FormatError`] with the line.
pub(super) fn parse<E: From<FormatError>>(
    bytes: &[u8],
    mut header: impl FnMut(usize, &PtxHeader) -> Result<bool, E>,
    mut row: impl FnMut(&PtxRow) -> Result<(), E>,
) -> Result<usize, E> {
    let text = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
    let skipped = bytes.len() - text.len();
    let mut lines = ByteLines::new(text).filter(|line| !line.text.trim_ascii().is_empty());
    let mut scans = 0;
    while let Some(first) = lines.next() {
        let scan = scan_header(first, &mut lines, skipped)?;
        let wanted = header(scans, &scan)?;
        scans += 1;
        let points = scan.columns.checked_mul(scan.rows);
        let points = points.ok_or_else(|| first.error("more points than any file holds"))?;
        for index in 0..points {
            let line = lines.next().ok_or_else(|| {
                let announced = format!("{points} points of scan {scans}");
                FormatError::truncated(announced, index.to_string())
            })?;
            if wanted {
                row(&ptx_row(&line)?)?;
            }
        }
    }
    Ok(scans)
}

fn ptx_row(line: &Line) -> Result<PtxRow, FormatError> {
    let mut row = PtxRow { values: [0.0; 7], count: 0 };
    for (_, word) in line.words().take(7) {
        row.values[row.count] = number(word).map_err(|problem| line.error(problem))?;
        row.count += 1;
    }
    if row.count < 3 {
        return Err(line.error(format!("{} numbers where x, y, z and the intensity are expected", row.count)));
    }
    Ok(row)
}

fn scan_header<'a>(
    first: Line<'a>,
    lines: &mut impl Iterator<Item = Line<'a>>,
    skipped: usize,
) -> Result<PtxHeader, FormatError> {
    let mut next = || {
        lines
            .next()
            .ok_or_else(|| FormatError::truncated("the ten lines of a scan's header", "the end of the file"))
    };
    let columns = count(&first, "the number of columns")?;
    let rows = count(&next()?, "the number of rows")?;
    // The scanner's position and axes, which the matrix holds too.
    for _ in 0..4 {
        numbers::<3>(&next()?)?;
    }
    let mut matrix = [[0.0; 4]; 4];
    let mut place = 0..0;
    let mut last = first;
    for (index, line) in matrix.iter_mut().enumerate() {
        last = next()?;
        *line = numbers::<4>(&last)?;
        place.start = if index == 0 { last.start + skipped } else { place.start };
        place.end = last.start + skipped + last.text.len();
    }
    // Points are rows here, so that the matrix stands on its side.
    let rotation = Matrix3::from_fn(|row, column| matrix[column][row]);
    let translation = Vector3::new(matrix[3][0], matrix[3][1], matrix[3][2]);
    let off = (rotation * rotation.transpose() - Matrix3::identity()).abs().max();
    let projective = (0..3).any(|row| matrix[row][3] != 0.0) || matrix[3][3] != 1.0;
    let finite = translation.iter().chain(rotation.iter()).all(|value| value.is_finite());
    if !(off <= TOLERANCE && rotation.determinant() > 0.0 && finite) || projective {
        let hint = if (0..3).any(|row| matrix[row][3] != 0.0) {
            "; its translation belongs in the last line, not in the last column"
        } else {
            ""
        };
        return Err(last.error(format!("the matrix of the scan is no rotation with a translation{hint}")));
    }
    Ok(PtxHeader { columns, rows, file_from_scan: Rigid { rotation, translation }, place })
}

fn count(line: &Line, what: &str) -> Result<usize, FormatError> {
    let text = line.text.trim_ascii();
    std::str::from_utf8(text)
        .ok()
        .and_then(|text| text.parse().ok())
        .ok_or_else(|| line.error(format!("{} where {what} of a scan is expected", quote(text))))
}

fn numbers<const N: usize>(line: &Line) -> Result<[f64; N], FormatError> {
    let mut values = [0.0; N];
    let mut found = 0;
    for (_, word) in line.words() {
        if found == N {
            return Err(line.error(format!("more than the {N} numbers of a scan's header")));
        }
        values[found] = number(word).map_err(|problem| line.error(problem))?;
        found += 1;
    }
    if found < N {
        return Err(line.error(format!("{found} numbers where {N} of a scan's header are expected")));
    }
    Ok(values)
}
