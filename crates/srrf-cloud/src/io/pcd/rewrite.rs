//! A copy of a PCD file with moved points.

use std::io::{self, Write};

use super::super::outgoing::stays_single;
use super::super::scalar::Scalar;
use super::super::scan::{Splice, moved, turned};
use super::super::{FormatError, ReadOptions};
use super::body::{PcdTable, ascii_rows, column, numbers, read};
use super::header::{PcdEncoding, PcdHeader};
use super::lzf;
use crate::Rigid;

/// What becomes of three fields.
struct PcdChange {
    fields: [usize; 3],
    kinds: [Scalar; 3],
    old: Vec<[f64; 3]>,
    new: Vec<[f64; 3]>,
}

/// Writes the file in `bytes` with its points moved by `motion` and its normals turned; all else
/// stays. A coordinate whose type cannot hold the moved numbers becomes a double.
pub(super) fn rewrite(
    bytes: &[u8],
    options: &ReadOptions,
    motion: &Rigid,
    out: &mut dyn Write,
) -> io::Result<()> {
    let old = read(bytes, options)?.points;
    let header = PcdHeader::parse(bytes)?;
    let axes = header.axes()?;
    let new: Vec<[f64; 3]> = old.iter().map(|&point| moved(motion, point)).collect();
    let kind = |axis: usize| header.fields[axes[axis]].scalar;
    let single = (0..3).all(|axis| kind(axis).is_single()) && stays_single(&old, &new).is_ok();
    let kinds = [0, 1, 2].map(|axis| kind(axis).for_moved(axis, &old, &new, single));
    let mut changes = vec![PcdChange { fields: axes, kinds, old, new }];
    let normals = header.triple(["normal_x", "normal_y", "normal_z"]);

    let body = match header.encoding {
        PcdEncoding::Ascii => {
            if let Some(fields) = normals {
                let columns = fields.map(|field| column(&header, field));
                let mut old = Vec::new();
                ascii_rows(bytes, &header, |line, words| {
                    // A damaged normal stays as it is.
                    old.push(numbers(line, words, columns).unwrap_or([f64::NAN; 3]));
                    Ok::<_, FormatError>(())
                })?;
                changes.push(turn(&header, fields, old, motion));
            }
            None
        }
        PcdEncoding::Binary | PcdEncoding::Compressed => {
            let table = PcdTable::new(bytes, &header, options)?;
            if let Some(fields) = normals {
                changes.push(turn(&header, fields, table.triples(&header, fields), motion));
            }
            let body = binary_body(&header, &table, &changes);
            if body == *table.bytes {
                return out.write_all(bytes);
            }
            Some(if header.encoding == PcdEncoding::Compressed { compressed(&body)? } else { body })
        }
    };

    let mut splice = Splice::new(bytes, out);
    let mut words = Vec::new();
    for change in &changes {
        for (&field, &kind) in change.fields.iter().zip(&change.kinds) {
            // Version .5 has no words for types.
            let named = header.fields[field].places[0] != (0..0);
            if kind != header.fields[field].scalar && named {
                let [size, name] = header.fields[field].places.clone();
                words.push((size, kind.size().to_string()));
                words.push((name, "F".to_owned()));
            }
        }
    }
    words.sort_by_key(|(place, _)| place.start);
    for (place, word) in words {
        splice.replace(place, word.as_bytes())?;
    }
    if let Some(body) = body {
        splice.replace(header.body..bytes.len(), &[])?;
        splice.finish()?;
        return out.write_all(&body);
    }
    let mut point = 0;
    let columns: Vec<[usize; 3]> =
        changes.iter().map(|c| c.fields.map(|field| column(&header, field))).collect();
    ascii_rows(bytes, &header, |_, words| {
        // In the order of the file: all words of a point, whichever triple they belong to.
        let mut parts: Vec<(usize, usize, usize)> = (0..changes.len())
            .flat_map(|change| (0..3).map(move |axis| (change, axis)))
            .map(|(change, axis)| (columns[change][axis], change, axis))
            .collect();
        parts.sort_unstable();
        for (column, change, axis) in parts {
            let (at, word) = words[column];
            let (old, new) = (changes[change].old[point][axis], changes[change].new[point][axis]);
            splice.number(at..at + word.len(), old, new)?;
        }
        point += 1;
        Ok::<_, io::Error>(())
    })?;
    splice.finish()
}

fn turn(header: &PcdHeader, fields: [usize; 3], old: Vec<[f64; 3]>, motion: &Rigid) -> PcdChange {
    let new = old.iter().map(|&normal| turned(motion, normal)).collect();
    PcdChange { fields, kinds: fields.map(|field| header.fields[field].scalar.for_turned()), old, new }
}

/// All numbers with the changed ones in place, in the layout of the file.
fn binary_body(header: &PcdHeader, table: &PcdTable, changes: &[PcdChange]) -> Vec<u8> {
    let mut out = Vec::with_capacity(table.bytes.len());
    let put = |field: usize, point: usize, out: &mut Vec<u8>| {
        let place = table.place(field, point);
        let changed = changes.iter().find_map(|change| {
            let axis = change.fields.iter().position(|&f| f == field)?;
            let (old, new) = (change.old[point][axis], change.new[point][axis]);
            let kind = change.kinds[axis];
            let same = old == new || (old.is_nan() && new.is_nan());
            (!same || kind != header.fields[field].scalar).then_some((kind, new))
        });
        match changed {
            Some((kind, new)) => kind.put(new, false, out),
            None => out.extend_from_slice(&table.bytes[place..place + header.fields[field].bytes()]),
        }
    };
    let fields = 0..header.fields.len();
    if header.encoding == PcdEncoding::Binary {
        (0..header.points).for_each(|point| fields.clone().for_each(|field| put(field, point, &mut out)));
        return out;
    }
    fields.for_each(|field| (0..header.points).for_each(|point| put(field, point, &mut out)));
    out
}

/// The sizes before and after compression, and the compressed bytes.
fn compressed(plain: &[u8]) -> Result<Vec<u8>, FormatError> {
    let packed = lzf::compress(plain);
    let (Ok(packed_size), Ok(size)) = (u32::try_from(packed.len()), u32::try_from(plain.len())) else {
        let problem = format!("{} bytes are too many for a compressed PCD; write .ply", plain.len());
        return Err(FormatError::Unwritable(problem));
    };
    Ok([&packed_size.to_le_bytes(), &size.to_le_bytes(), &packed[..]].concat())
}
