//! The rows behind the header of a PLY file.

use super::super::{Contents, FormatError, Note, ReadOptions};
use super::cursor::{Cursor, cut_short, no_vertices};
use super::faces::Faces;
use super::foreign;
use super::header::{Element, PlyEncoding};

/// What a PLY file holds.
pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
    let header = foreign::open(bytes)?;
    let end = header.needed();
    let vertices = header.elements.iter().find(|element| element.name == "vertex").ok_or_else(no_vertices)?;
    let mut cursor = Cursor { bytes, at: header.body, encoding: header.encoding };
    let mut contents = Contents::default();
    for (index, element) in header.elements.iter().enumerate().take(end) {
        if element.name == "vertex" {
            contents.points = points(&mut cursor, element, index + 1 == header.elements.len(), options)?;
        } else if let Some(list) = element.face_list() {
            let held = bytes.len() + size_of_val(&contents.points[..]);
            contents
                .faces
                .extend(Faces { element, list, vertices: vertices.count, held }.read(&mut cursor, options)?);
        } else {
            cursor.skip_element(element)?;
        }
    }
    let axes = axes(vertices)?;
    contents.notes = foreign::passed_over(&header).into_iter().map(|what| Note::Ignored { what }).collect();
    contents.single = axes.iter().all(|&axis| vertices.properties[axis].scalar.is_single());
    Ok(contents)
}

fn axes(vertices: &Element) -> Result<[usize; 3], FormatError> {
    let lacking = || FormatError::Content("the element `vertex` lacks x, y or z".into());
    vertices.triple(["x", "y", "z"]).ok_or_else(lacking)
}

/// The points at the cursor, which moves behind them.
fn points(
    cursor: &mut Cursor,
    element: &Element,
    last: bool,
    options: &ReadOptions,
) -> Result<Vec<[f64; 3]>, FormatError> {
    let axes = axes(element)?;
    let kinds = axes.map(|axis| element.properties[axis].scalar);
    let bytes = cursor.bytes;
    let mut points = Vec::new();
    match (cursor.encoding, element.stride()) {
        (PlyEncoding::Binary { big_endian }, Some(stride)) => {
            let body = &bytes[cursor.at..];
            let count = usize::try_from(element.count).unwrap_or(usize::MAX);
            if count > body.len() / stride {
                return Err(cut_short(element, (body.len() / stride) as u64));
            }
            options.check_points(bytes.len(), count)?;
            let offset = |axis: usize| element.properties[..axis].iter().map(|p| p.scalar.size()).sum();
            let offsets: [usize; 3] = axes.map(offset);
            let number = |row: &[u8], i: usize| kinds[i].get(row, offsets[i], big_endian).unwrap_or(f64::NAN);
            let rows = body.chunks_exact(stride).take(count);
            points.extend(rows.map(|row| [number(row, 0), number(row, 1), number(row, 2)]));
            cursor.at += count * stride;
        }
        (_, _) => {
            // The count is not trusted with memory: a number takes a byte or more.
            let most = (bytes.len() - cursor.at) / element.properties.len();
            let most = most.min(usize::try_from(element.count).unwrap_or(usize::MAX));
            options.check_points(bytes.len(), most)?;
            points.reserve(most);
            cursor.rows(element, |cursor, places| {
                let value = |i: usize| cursor.value(&places[axes[i]], kinds[i]);
                points.push([value(0)?, value(1)?, value(2)?]);
                Ok(())
            })?;
        }
    }
    // With lists, any bytes behind the rows could be read as one more.
    let countable = cursor.encoding == PlyEncoding::Ascii || element.stride().is_some();
    if last && countable && element.properties.iter().all(|p| matches!(cursor.property(p), Ok(Some(_)))) {
        let problem = format!(
            "{} elements `vertex` announced, but more rows follow; correct the count in the header",
            element.count
        );
        return Err(FormatError::Content(problem));
    }
    Ok(points)
}
