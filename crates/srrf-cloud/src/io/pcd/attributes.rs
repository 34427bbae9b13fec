//! What the points of a PCD file have besides their place.

use std::io::{self, Write};

use super::super::outgoing::{COLOURS, NORMALS, Outgoing};
use super::super::scalar::Scalar;
use super::super::{Attribute, AttributeValues, FormatError, ReadOptions};
use super::body::{PcdTable, ascii_rows, column};
use super::header::{PcdEncoding, PcdHeader};

/// More numbers of one field are a descriptor, and no attributes.
const MOST_COUNT: usize = 64;

/// One number of each point: the field, and which of its numbers.
struct Part {
    field: usize,
    number: usize,
    name: String,
}

/// Reads all fields but the place and padding; packed colours become their parts.
pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
    let header = PcdHeader::parse(bytes)?;
    let axes = header.axes()?;
    let mut parts = Vec::new();
    for (index, field) in header.fields.iter().enumerate() {
        if axes.contains(&index) || field.name == "_" || field.count > MOST_COUNT {
            continue;
        }
        let name = known(&field.name);
        parts.extend((0..field.count).map(|number| Part {
            field: index,
            number,
            name: if field.count == 1 { name.clone() } else { format!("{name}_{number}") },
        }));
    }
    if parts.is_empty() {
        return Ok(Vec::new());
    }
    let kind = |part: &Part| header.fields[part.field].scalar;
    let values: Vec<AttributeValues> = if header.encoding == PcdEncoding::Ascii {
        let most = header.points.min((bytes.len() - header.body) / 2 + 1);
        let planned = most.saturating_mul(parts.len()).saturating_mul(16);
        options.check_memory("the attributes", bytes.len(), planned)?;
        let columns: Vec<usize> =
            parts.iter().map(|part| column(&header, part.field) + part.number).collect();
        let mut lists: Vec<Vec<AsciiNumber>> = vec![Vec::new(); parts.len()];
        ascii_rows(bytes, &header, |_, words| {
            for (list, &column) in lists.iter_mut().zip(&columns) {
                list.push(AsciiNumber::of(words[column].1));
            }
            Ok::<_, FormatError>(())
        })?;
        parts.iter().zip(&lists).map(|(part, list)| typed(kind(part), list)).collect()
    } else {
        let table = PcdTable::new(bytes, &header, options)?;
        let row: usize = parts.iter().map(|part| kind(part).size()).sum();
        let held = bytes.len() + table.bytes.len();
        options.check_memory("the attributes", held, header.points.saturating_mul(row))?;
        let one = |part: &Part| {
            let offset = part.number * kind(part).size();
            let places = (0..header.points).map(|point| table.place(part.field, point) + offset);
            kind(part).column(&table.bytes, false, places)
        };
        parts.iter().map(one).collect()
    };
    let mut attributes = Vec::new();
    for (part, values) in parts.into_iter().zip(values) {
        match packed(&part.name, &values) {
            Some(colours) => attributes.extend(colours),
            None => attributes.push(Attribute { name: part.name, values }),
        }
    }
    Ok(attributes)
}

/// A number of a text: as a number, and as an integer where it is one, for packed colours.
#[derive(Clone, Copy)]
struct AsciiNumber {
    value: f64,
    whole: Option<u32>,
}

impl AsciiNumber {
    fn of(word: &[u8]) -> Self {
        let value = super::super::scan::number(word).unwrap_or(f64::NAN);
        Self { value, whole: std::str::from_utf8(word).ok().and_then(|text| text.parse().ok()) }
    }
}

fn typed(kind: Scalar, list: &[AsciiNumber]) -> AttributeValues {
    match kind {
        Scalar::U32 => AttributeValues::U32(list.iter().map(|n| n.whole.unwrap_or(n.value as u32)).collect()),
        kind => kind.of_numbers(&list.iter().map(|n| n.value).collect::<Vec<f64>>()),
    }
}

/// The parts of colours that are packed in one number, `0xAARRGGBB`, as PCL has it.
fn packed(name: &str, values: &AttributeValues) -> Option<Vec<Attribute>> {
    if !["rgb", "rgba"].contains(&name) {
        return None;
    }
    let words: Vec<u32> = match values {
        AttributeValues::F32(v) => v.iter().map(|v| v.to_bits()).collect(),
        AttributeValues::U32(v) => v.clone(),
        AttributeValues::I32(v) => v.iter().map(|&v| v as u32).collect(),
        _ => return None,
    };
    let part = |name: &str, shift: u32| Attribute {
        name: name.into(),
        values: AttributeValues::U8(words.iter().map(|word| (word >> shift) as u8).collect()),
    };
    let mut parts = vec![part("red", 16), part("green", 8), part("blue", 0)];
    if name == "rgba" {
        parts.push(part("alpha", 24));
    }
    Some(parts)
}

fn known(name: &str) -> String {
    match &*name.to_ascii_lowercase() {
        "normal_x" => "nx".into(),
        "normal_y" => "ny".into(),
        "normal_z" => "nz".into(),
        other => other.to_owned(),
    }
}

/// Whether a field can hold these values.
pub(super) fn keeps(attribute: &Attribute, cloud: &Outgoing<'_>) -> bool {
    // A colour is all of its parts.
    attribute.name != "alpha" || (cloud.colours().is_some() && attribute.values.are_whole(255.0))
}

/// Writes binary; colours packed in one number, as PCL has them.
pub(super) fn write(cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
    let n = cloud.points.len();
    let colours = cloud.colours().map(|(colours, _)| colours);
    let alpha = cloud.attribute("alpha").filter(|alpha| colours.is_some() && keeps(alpha, cloud));
    let of_colour =
        |a: &Attribute| a.name == "alpha" || (colours.is_some() && COLOURS.contains(&a.name.as_str()));
    let others: Vec<&Attribute> = cloud.attributes.iter().filter(|a| !of_colour(a)).collect();

    let place = if cloud.single { Scalar::F32 } else { Scalar::F64 };
    let mut fields: Vec<(String, Scalar)> = ["x", "y", "z"].map(|axis| (axis.to_owned(), place)).into();
    if colours.is_some() {
        fields.push(match alpha {
            Some(_) => ("rgba".into(), Scalar::U32),
            None => ("rgb".into(), Scalar::F32),
        });
    }
    fields.extend(others.iter().map(|a| (field_name(&a.name), a.values.scalar())));
    let line = |word: &dyn Fn(&(String, Scalar)) -> String| {
        fields.iter().map(word).collect::<Vec<String>>().join(" ")
    };
    write!(
        out,
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\nWIDTH {n}\n\
         HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA binary\n",
        line(&|(name, _)| name.clone()),
        line(&|(_, kind)| kind.size().to_string()),
        line(&|(_, kind)| letter(*kind).to_owned()),
        line(&|_| "1".to_owned()),
    )?;
    let mut row = Vec::with_capacity(64);
    for (index, point) in cloud.points.iter().enumerate() {
        row.clear();
        point.iter().for_each(|&value| place.put(value, false, &mut row));
        if let Some(colours) = &colours {
            let [r, g, b] = colours[index];
            let a = alpha.and_then(|alpha| alpha.values.get(index)).map_or(0, |a| a as u8);
            // Little endian: 0xAARRGGBB.
            row.extend([b, g, r, a]);
        }
        others.iter().for_each(|attribute| attribute.values.put(index, &mut row));
        out.write_all(&row)?;
    }
    Ok(())
}

fn field_name(name: &str) -> String {
    match NORMALS.iter().position(|normal| *normal == name) {
        Some(axis) => format!("normal_{}", ["x", "y", "z"][axis]),
        None => name.chars().map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c }).collect(),
    }
}

fn letter(kind: Scalar) -> &'static str {
    match kind {
        Scalar::F16 | Scalar::F32 | Scalar::F64 => "F",
        Scalar::I8 | Scalar::I16 | Scalar::I32 | Scalar::I64 => "I",
        Scalar::U8 | Scalar::U16 | Scalar::U32 | Scalar::U64 => "U",
    }
}
