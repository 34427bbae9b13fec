//! What the vertices of a PLY file have besides their place.

use std::io::{self, Write};

use super::super::Outgoing;
use super::super::outgoing::COLOURS;
use super::super::scalar::Scalar;
use super::super::{Attribute, AttributeValues, FormatError, ReadOptions};
use super::cursor::{Cursor, cut_short};
use super::foreign::{self, is_passed_over};
use super::header::{PlyEncoding, Property};

/// Reads all properties of `vertex` but the place and lists.
pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
    let header = foreign::open(bytes)?;
    let (mut cursor, element) = Cursor::at_vertices(bytes, &header)?;
    let wanted: Vec<usize> = (0..element.properties.len())
        .filter(|&i| {
            let property = &element.properties[i];
            let Property { name, length, .. } = property;
            let place = ["x", "y", "z"].contains(&&*name.to_ascii_lowercase());
            length.is_none() && !place && !is_passed_over(property)
        })
        .collect();
    if wanted.is_empty() {
        return Ok(Vec::new());
    }
    let kind = |property: usize| element.properties[property].scalar;
    let row: usize = wanted.iter().map(|&property| kind(property).size()).sum();
    let values: Vec<AttributeValues> = match (header.encoding, element.stride()) {
        (PlyEncoding::Binary { big_endian }, Some(stride)) => {
            let body = &bytes[cursor.at..];
            let count = usize::try_from(element.count).unwrap_or(usize::MAX);
            if count > body.len() / stride.max(1) {
                return Err(cut_short(element, (body.len() / stride.max(1)) as u64));
            }
            options.check_memory("the attributes", bytes.len(), count.saturating_mul(row))?;
            let column = |&property: &usize| {
                let offset: usize = element.properties[..property].iter().map(|p| p.scalar.size()).sum();
                kind(property).column(body, big_endian, (0..count).map(|point| point * stride + offset))
            };
            wanted.iter().map(column).collect()
        }
        (_, _) => {
            // The count is not trusted with memory: a number takes a byte or more.
            let most = (bytes.len() - cursor.at) / element.properties.len().max(1);
            let most = most.min(usize::try_from(element.count).unwrap_or(usize::MAX));
            let planned = most.saturating_mul(wanted.len()).saturating_mul(16);
            options.check_memory("the attributes", bytes.len(), planned)?;
            let mut numbers: Vec<Vec<f64>> = vec![Vec::with_capacity(most); wanted.len()];
            cursor.rows(element, |cursor, places| {
                for (list, &property) in numbers.iter_mut().zip(&wanted) {
                    // A damaged number is no reason to lose the points.
                    list.push(cursor.value(&places[property], kind(property)).unwrap_or(f64::NAN));
                }
                Ok(())
            })?;
            wanted.iter().zip(numbers).map(|(&property, list)| kind(property).of_numbers(&list)).collect()
        }
    };
    let name = |property: usize| known(&element.properties[property].name);
    Ok(wanted
        .iter()
        .zip(values)
        .map(|(&property, values)| Attribute { name: name(property), values })
        .collect())
}

/// Names of the lists of `vertex`, and of the elements that are neither vertices nor faces.
pub(super) fn left_out(bytes: &[u8]) -> Result<Vec<String>, FormatError> {
    let header = foreign::open(bytes)?;
    let mut names = Vec::new();
    for element in &header.elements {
        if element.name == "vertex" {
            let left_out = element.properties.iter().filter(|p| p.length.is_some() || is_passed_over(p));
            names.extend(left_out.map(|p| p.name.clone()));
        } else if element.face_list().is_none() && element.count > 0 {
            names.push(element.name.clone());
        }
    }
    Ok(names)
}

/// The name by which all formats know a property.
fn known(name: &str) -> String {
    match &*name.to_ascii_lowercase() {
        "r" | "diffuse_red" => "red".into(),
        "g" | "diffuse_green" => "green".into(),
        "b" | "diffuse_blue" => "blue".into(),
        "a" | "diffuse_alpha" => "alpha".into(),
        "normal_x" => "nx".into(),
        "normal_y" => "ny".into(),
        "normal_z" => "nz".into(),
        "scalar_intensity" => "intensity".into(),
        other => other.to_owned(),
    }
}

/// Whether a property can hold these values.
pub(super) fn keeps(attribute: &Attribute) -> bool {
    // There are no 64-bit integers.
    !matches!(attribute.values, AttributeValues::I64(_) | AttributeValues::U64(_))
}

/// Writes binary little endian; colours in 8 bits, as readers expect them.
pub(super) fn write(cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
    let axis = if cloud.single { "float" } else { "double" };
    write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", cloud.points.len())?;
    ["x", "y", "z"].iter().try_for_each(|name| writeln!(out, "property {axis} {name}"))?;
    let colours = cloud.colours().map(|(colours, _)| colours);
    let kept: Vec<&Attribute> = cloud.attributes.iter().filter(|attribute| keeps(attribute)).collect();
    let part = |attribute: &Attribute| COLOURS.iter().position(|name| *name == attribute.name);
    for attribute in &kept {
        let kind = match part(attribute) {
            Some(_) if colours.is_some() => "uchar",
            _ => word(attribute.values.scalar()),
        };
        let name: String = attribute
            .name
            .chars()
            .map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c })
            .collect();
        writeln!(out, "property {kind} {name}")?;
    }
    out.write_all(b"end_header\n")?;
    let mut row = Vec::with_capacity(64);
    for (index, point) in cloud.points.iter().enumerate() {
        row.clear();
        for &value in point {
            let kind = if cloud.single { Scalar::F32 } else { Scalar::F64 };
            kind.put(value, false, &mut row);
        }
        for attribute in &kept {
            match (part(attribute), &colours) {
                (Some(part), Some(colours)) => row.push(colours[index][part]),
                _ => attribute.values.put(index, &mut row),
            }
        }
        out.write_all(&row)?;
    }
    Ok(())
}

/// The word for a type.
fn word(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::I8 => "char",
        Scalar::U8 => "uchar",
        Scalar::I16 => "short",
        Scalar::U16 => "ushort",
        Scalar::I32 => "int",
        Scalar::U32 => "uint",
        Scalar::F16 | Scalar::F32 => "float",
        Scalar::I64 | Scalar::U64 | Scalar::F64 => "double",
    }
}
