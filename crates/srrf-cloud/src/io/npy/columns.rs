//! Arrays as columns of one value a point.

use super::header::{Descr, NpyHeader, NpyKind};
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
