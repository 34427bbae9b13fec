//! Arrays as columns of one value a point.

use super::header::{Descr, NpyHeader, NpyKind};
use crate::io::scalar::Scalar;
use crate::io::{AttributeValues, FormatError};

/// Columns of an array that are taken at most.
const MOST: u64 = 64;

/// The columns of an array of shape `[rows]` or `[rows, n]`; none for any other shape.
pub(in super::super) fn columns(bytes: &[u8], rows: usize) -> Result<Vec<AttributeValues>, FormatError> {
    let header = NpyHeader::parse(bytes)?;
    let (Descr::Plain(kind), count) = (&header.descr, count(&header.shape, rows)) else {
        return Ok(Vec::new());
    };
    let body = &bytes[header.body..];
    let size = kind.scalar.size();
    if count == 0 || body.len() != rows.saturating_mul(count).saturating_mul(size) {
        return Ok(Vec::new());
    }
    let column = |column: usize| {
        let (begin, step) = if header.fortran { (column * rows, 1) } else { (column, count) };
        kind.scalar.column(body, kind.big_endian, (0..rows).map(|row| (begin + row * step) * size))
    };
    Ok((0..count).map(column).collect())
}

fn count(shape: &[u64], rows: usize) -> usize {
    match *shape {
        [n] if n == rows as u64 => 1,
        [n, columns] if n == rows as u64 && columns <= MOST => columns as usize,
        _ => 0,
    }
}

/// The bytes of an array of columns of one type: of shape `[rows]` for one, of `[rows, n]` for several.
pub(in super::super) fn array_of(columns: &[&AttributeValues]) -> Vec<u8> {
    let Some(first) = columns.first() else { return Vec::new() };
    let rows = first.len();
    let kind = NpyKind { scalar: first.scalar(), big_endian: false };
    let shape = if columns.len() == 1 { vec![rows as u64] } else { vec![rows as u64, columns.len() as u64] };
    let mut bytes = NpyHeader::bytes(&Descr::Plain(kind), false, &shape);
    for row in 0..rows {
        columns.iter().for_each(|column| column.put(row, &mut bytes));
    }
    bytes
}

/// Whether the array at the begin of `bytes` holds single numbers.
pub(in super::super) fn holds_numbers(bytes: &[u8]) -> bool {
    NpyHeader::parse(bytes).is_ok_and(|header| matches!(header.descr, Descr::Plain(_)) && !header.booleans)
}

/// The type of the numbers of an array.
///
/// # Errors
/// [`FormatError::Content`] for an array of fields.
pub(in super::super) fn kind_of(bytes: &[u8]) -> Result<Scalar, FormatError> {
    match NpyHeader::parse(bytes)?.descr {
        Descr::Plain(kind) => Ok(kind.scalar),
        Descr::Fields(_) => Err(FormatError::Content("an array of fields is no coordinate".into())),
    }
}

/// The bytes of an array of this shape, in C order.
pub(in super::super) fn array_of_shape(
    shape: &[usize],
    kind: Scalar,
    values: impl Iterator<Item = f64>,
) -> Vec<u8> {
    let shape: Vec<u64> = shape.iter().map(|&axis| axis as u64).collect();
    let mut bytes =
        NpyHeader::bytes(&Descr::Plain(NpyKind { scalar: kind, big_endian: false }), false, &shape);
    values.for_each(|value| kind.put(value, false, &mut bytes));
    bytes
}
