//! Moved copies of legacy and of XML files.

use std::io::{self, Write};
use std::ops::Range;

use super::super::outgoing::stays_single;
use super::super::scalar::Scalar;
use super::super::scan::{Splice, moved, put_number, turned, words};
use super::legacy::Legacy;
use super::xml::{Xml, XmlArray};
use crate::Rigid;

/// Writes the file in `bytes` with its points moved and its normals turned; all else stays.
pub(super) fn rewrite(bytes: &[u8], file: &Legacy, motion: &Rigid, out: &mut dyn Write) -> io::Result<()> {
    if *motion == Rigid::identity() {
        return out.write_all(bytes);
    }
    let mut splice = Splice::new(bytes, out);
    let old = &file.points;
    let new: Vec<[f64; 3]> = old.iter().map(|&point| moved(motion, point)).collect();
    let kind = file.kind.unwrap_or(Scalar::F64);
    // All three coordinates are of one type.
    let single = kind.is_single() && stays_single(old, &new).is_ok();
    let kinds = [0, 1, 2].map(|axis| kind.for_moved(axis, old, &new, single));
    let wide = kinds.into_iter().find(|&other| other != kind).unwrap_or(kind);
    if wide != kind {
        splice
            .replace(file.kind_place.clone(), if wide == Scalar::F32 { &b"float"[..] } else { b"double" })?;
    }
    put(&mut splice, bytes, file, &file.place, wide, old, &new)?;
    let mut normals: Vec<_> = file.data.iter().filter(|data| data.normals).collect();
    normals.sort_by_key(|data| data.place.start);
    for data in normals {
        let old = data.values.as_chunks::<3>().0;
        let new: Vec<[f64; 3]> = old.iter().map(|&normal| turned(motion, normal)).collect();
        put(&mut splice, bytes, file, &data.place, data.kind, old, &new)?;
    }
    splice.finish()
}

/// Replaces the numbers at `place`.
fn put(
    splice: &mut Splice,
    bytes: &[u8],
    file: &Legacy,
    place: &Range<usize>,
    kind: Scalar,
    old: &[[f64; 3]],
    new: &[[f64; 3]],
) -> io::Result<()> {
    if file.binary {
        let mut raw = Vec::with_capacity(new.len() * 3 * kind.size());
        new.iter().flatten().for_each(|&value| kind.put(value, true, &mut raw));
        return splice.replace(place.clone(), &raw);
    }
    let text = bytes.get(place.clone()).unwrap_or_default();
    let values = old.iter().flatten().zip(new.iter().flatten());
    for ((at, word), (&old, &new)) in words(text).zip(values) {
        let begin = place.start + at;
        let mut number = Vec::with_capacity(32);
        put_number(&mut number, if kind == Scalar::F32 { f64::from(new as f32) } else { new });
        if old != new && !(old.is_nan() && new.is_nan()) {
            splice.replace(begin..begin + word.len(), &number)?;
        }
    }
    Ok(())
}

/// Writes the XML file in `bytes` with its points moved and its normals turned, as text; all else stays.
pub(super) fn rewrite_xml(bytes: &[u8], file: &Xml, motion: &Rigid, out: &mut dyn Write) -> io::Result<()> {
    let mut splice = Splice::new(bytes, out);
    let mut arrays: Vec<&XmlArray> = file.arrays.iter().collect();
    arrays.sort_by_key(|array| array.place.start);
    for array in arrays {
        let old = &array.values;
        let change = if array.normals { turned } else { moved };
        let new: Vec<[f64; 3]> = old.iter().map(|&point| change(motion, point)).collect();
        let single = array.kind == Scalar::F32
            && (array.normals
                || (0..3).all(|axis| array.kind.for_moved(axis, old, &new, false) == array.kind)
                || stays_single(old, &new).is_ok());
        let kind = if single { "Float32" } else { "Float64" };
        let name = array.name.replace('&', "&amp;").replace('"', "&quot;").replace('<', "&lt;");
        let head =
            format!("<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"3\" format=\"ascii\">");
        let mut text = head.into_bytes();
        for &value in new.iter().flatten() {
            put_number(&mut text, if single { f64::from(value as f32) } else { value });
            text.push(b' ');
        }
        text.extend_from_slice(b"</DataArray>");
        splice.replace(array.place.clone(), &text)?;
    }
    splice.finish()
}
