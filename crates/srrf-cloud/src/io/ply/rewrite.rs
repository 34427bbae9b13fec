//! A copy of a PLY file with moved points.

use std::io::{self, Write};
use std::ops::Range;

use super::super::ReadOptions;
use super::super::outgoing::stays_single;
use super::super::scalar::Scalar;
use super::super::scan::{Splice, moved, put_number, turned};
use super::body::read;
use super::cursor::Cursor;
use super::foreign;
use super::header::PlyEncoding;
use crate::Rigid;

/// What happens to one property of `vertex`.
struct PlyChange {
    property: usize,
    /// The triple and the axis in it.
    triple: usize,
    axis: usize,
    kind: Scalar,
}

/// Writes the file in `bytes` with its points moved by `motion` and its normals (`nx`, `ny`, `nz`)
/// turned; every other byte stays. A coordinate whose type cannot hold the moved numbers becomes
/// `double`.
pub(super) fn rewrite(
    bytes: &[u8],
    options: &ReadOptions,
    motion: &Rigid,
    out: &mut dyn Write,
) -> io::Result<()> {
    let points = read(bytes, options)?.points;
    let header = foreign::open(bytes)?;
    let (mut cursor, element) = Cursor::at_vertices(bytes, &header)?;
    let Some(axes) = element.triple(["x", "y", "z"]) else { return Err(io::ErrorKind::InvalidData.into()) };
    let normals = element.triple(["nx", "ny", "nz"]);
    let new_points: Vec<[f64; 3]> = points.iter().map(|&p| moved(motion, p)).collect();
    let scalar = |property: usize| element.properties[property].scalar;

    let single =
        axes.iter().all(|&axis| scalar(axis).is_single()) && stays_single(&points, &new_points).is_ok();
    let mut changes: Vec<PlyChange> = (0..3)
        .map(|axis| {
            let kind = scalar(axes[axis]).for_moved(axis, &points, &new_points, single);
            PlyChange { property: axes[axis], triple: 0, axis, kind }
        })
        .collect();
    for axis in 0..3 {
        if let Some(normals) = normals {
            let kind = scalar(normals[axis]).for_turned();
            changes.push(PlyChange { property: normals[axis], triple: 1, axis, kind });
        }
    }
    changes.sort_by_key(|change| change.property);

    let mut splice = Splice::new(bytes, out);
    for change in &changes {
        if change.kind != scalar(change.property) {
            let word: &[u8] = if change.kind == Scalar::F64 { b"double" } else { b"float" };
            splice.replace(element.properties[change.property].place.clone(), word)?;
        }
    }
    let mut failed = Ok(());
    let mut row = new_points.iter().zip(&points);
    let mut number = Vec::with_capacity(32);
    let walked = cursor.rows(element, |cursor, places: &[Range<usize>]| {
        let Some((&new_point, &point)) = row.next().filter(|_| failed.is_ok()) else { return Ok(()) };
        let (old, new) = match normals {
            Some(normals) => {
                // A damaged normal stays as it is.
                let value =
                    |i: usize| cursor.value(&places[normals[i]], scalar(normals[i])).unwrap_or(f64::NAN);
                let normal = [value(0), value(1), value(2)];
                ([point, normal], [new_point, turned(motion, normal)])
            }
            None => ([point; 2], [new_point; 2]),
        };
        for change in &changes {
            let (old, new) = (old[change.triple][change.axis], new[change.triple][change.axis]);
            let same = old == new || (old.is_nan() && new.is_nan());
            number.clear();
            match header.encoding {
                _ if same && change.kind == scalar(change.property) => continue,
                PlyEncoding::Ascii if same => continue,
                PlyEncoding::Ascii => put_number(&mut number, new),
                PlyEncoding::Binary { big_endian } => change.kind.put(new, big_endian, &mut number),
            }
            failed = splice.replace(places[change.property].clone(), &number);
            if failed.is_err() {
                break;
            }
        }
        Ok(())
    });
    walked?;
    failed?;
    splice.finish()
}
