//! What points have besides their place, as arrays of VTK.

use std::io::{self, Write};

use super::super::outgoing::{COLOURS, NORMALS};
use super::super::scalar::Scalar;
use super::super::{Attribute, Outgoing};

/// An array that is to be written.
pub(super) struct OutgoingArray {
    pub name: String,
    pub components: usize,
    pub kind: Scalar,
    pub normals: bool,
    /// Little endian.
    pub bytes: Vec<u8>,
}

/// The attributes of a cloud: colours and normals of one type together, each other one alone.
pub(super) fn arrays(cloud: &Outgoing<'_>) -> Vec<OutgoingArray> {
    let array = |name: &str, parts: &[&Attribute], normals: bool| {
        let mut bytes = Vec::new();
        for point in 0..cloud.points.len() {
            parts.iter().for_each(|part| part.values.put(point, &mut bytes));
        }
        let kind = parts.first().map_or(Scalar::F64, |part| part.values.scalar());
        OutgoingArray { name: name.to_owned(), components: parts.len(), kind, normals, bytes }
    };
    let mut all = Vec::new();
    let mut together: Vec<&str> = Vec::new();
    for (name, names, normals) in [("normals", NORMALS, true), ("rgb", COLOURS, false)] {
        let Some(parts) = cloud.triple(names) else { continue };
        let kind = parts[0].values.scalar();
        let fits = !normals || matches!(kind, Scalar::F32 | Scalar::F64);
        if fits && parts.iter().all(|part| part.values.scalar() == kind) {
            all.push(array(name, &parts, normals));
            together.extend(names);
        }
    }
    let others = cloud.attributes.iter().filter(|attribute| !together.contains(&attribute.name.as_str()));
    all.extend(others.map(|attribute| array(&attribute.name, &[attribute], false)));
    all
}

/// The section POINT_DATA of a legacy file.
pub(super) fn legacy(cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
    let arrays = arrays(cloud);
    if arrays.is_empty() {
        return Ok(());
    }
    let count = cloud.points.len();
    writeln!(out, "POINT_DATA {count}")?;
    let (normals, others): (Vec<_>, Vec<_>) = arrays.iter().partition(|array| array.normals);
    for array in normals {
        writeln!(out, "NORMALS {} {}", array.name, legacy_type(array.kind))?;
        big_endian(array, out)?;
    }
    if !others.is_empty() {
        writeln!(out, "FIELD FieldData {}", others.len())?;
    }
    for array in others {
        let (name, kind) = (encoded(&array.name), legacy_type(array.kind));
        writeln!(out, "{name} {} {count} {kind}", array.components)?;
        big_endian(array, out)?;
    }
    Ok(())
}

fn big_endian(array: &OutgoingArray, out: &mut dyn Write) -> io::Result<()> {
    let mut bytes = array.bytes.clone();
    bytes.chunks_exact_mut(array.kind.size()).for_each(<[u8]>::reverse);
    out.write_all(&bytes)?;
    out.write_all(b"\n")
}

/// A name as one word, as VTK writes names.
fn encoded(name: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_graphic() && !b"%\"".contains(&byte);
    let name = if name.is_empty() { "unnamed" } else { name };
    name.bytes()
        .map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") })
        .collect()
}

fn legacy_type(kind: Scalar) -> &'static str {
    match kind {
        Scalar::I8 => "char",
        Scalar::U8 => "unsigned_char",
        Scalar::I16 => "short",
        Scalar::U16 => "unsigned_short",
        Scalar::I32 => "int",
        Scalar::U32 => "unsigned_int",
        Scalar::I64 => "vtktypeint64",
        Scalar::U64 => "vtktypeuint64",
        Scalar::F16 | Scalar::F32 => "float",
        Scalar::F64 => "double",
    }
}

/// The type of an array in XML.
pub(super) fn xml_type(kind: Scalar) -> &'static str {
    match kind {
        Scalar::I8 => "Int8",
        Scalar::U8 => "UInt8",
        Scalar::I16 => "Int16",
        Scalar::U16 => "UInt16",
        Scalar::I32 => "Int32",
        Scalar::U32 => "UInt32",
        Scalar::I64 => "Int64",
        Scalar::U64 => "UInt64",
        Scalar::F16 | Scalar::F32 => "Float32",
        Scalar::F64 => "Float64",
    }
}

/// A name inside quotes of XML.
pub(super) fn escaped(name: &str) -> String {
    let mut text = String::new();
    for c in name.chars() {
        match c {
            '&' => text.push_str("&amp;"),
            '<' => text.push_str("&lt;"),
            '>' => text.push_str("&gt;"),
            '"' => text.push_str("&quot;"),
            c if c.is_control() => text.push('_'),
            c => text.push(c),
        }
    }
    text
}
