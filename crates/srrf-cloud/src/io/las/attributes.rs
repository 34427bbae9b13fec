//! What the points of LAS have besides their place.

use super::super::outgoing::{COLOURS, INTENSITY};
use super::super::scalar::Scalar;
use super::super::{Attribute, AttributeValues, Outgoing};

/// Name, type and place in a point of formats 0 to 5.
const EARLY: [(&str, Scalar, usize); 5] = [
    (INTENSITY, Scalar::U16, 12),
    ("classification", Scalar::U8, 15),
    ("scan_angle", Scalar::I8, 16),
    ("user_data", Scalar::U8, 17),
    ("point_source_id", Scalar::U16, 18),
];
/// In a point of formats 6 to 10.
const LATE: [(&str, Scalar, usize); 6] = [
    (INTENSITY, Scalar::U16, 12),
    ("classification", Scalar::U8, 16),
    ("user_data", Scalar::U8, 17),
    ("scan_angle", Scalar::I16, 18),
    ("point_source_id", Scalar::U16, 20),
    ("gps_time", Scalar::F64, 22),
];

/// The attributes of uncompressed records of a point format; those that are all 0 stand for what was not measured.
pub(super) fn read(format: u8, length: usize, records: &[u8]) -> Vec<Attribute> {
    let mut fields = if format < 6 { EARLY.to_vec() } else { LATE.to_vec() };
    if matches!(format, 1 | 3 | 4 | 5) {
        fields.push(("gps_time", Scalar::F64, 20));
    }
    let colours = match format {
        2 => Some(20),
        3 | 5 => Some(28),
        7 | 8 | 10 => Some(30),
        _ => None,
    };
    if let Some(at) = colours {
        fields.extend(COLOURS.iter().enumerate().map(|(part, name)| (*name, Scalar::U16, at + 2 * part)));
    }
    if matches!(format, 8 | 10) {
        fields.push(("nir", Scalar::U16, 36));
    }
    let count = records.len() / length.max(1);
    let fields = fields.into_iter().filter(|(_, kind, at)| at + kind.size() <= length);
    let column = |(name, kind, at): (&str, Scalar, usize)| Attribute {
        name: name.into(),
        values: kind.column(records, false, (0..count).map(|point| point * length + at)),
    };
    let attributes: Vec<Attribute> = fields.map(column).collect();
    let measured = |a: &Attribute| (0..count).any(|i| a.values.get(i).is_some_and(|value| value != 0.0));
    let coloured = attributes.iter().any(|a| COLOURS.contains(&a.name.as_str()) && measured(a));
    let kept = |a: &Attribute| measured(a) || (coloured && COLOURS.contains(&a.name.as_str()));
    attributes.into_iter().filter(kept).collect()
}

/// Whether a point of format 0 or 2 has room for an attribute.
pub(super) fn keeps(attribute: &Attribute, cloud: &Outgoing<'_>) -> bool {
    match &*attribute.name {
        INTENSITY => attribute.values.are_whole(65535.0),
        "classification" => attribute.values.are_whole(31.0),
        "user_data" => attribute.values.are_whole(255.0),
        "point_source_id" => attribute.values.are_whole(65535.0),
        name => COLOURS.contains(&name) && words(cloud).is_some(),
    }
}

/// The colours in 16 bits a part: those of 8 bits are spread over them, as the specification of LAS asks for.
fn words(cloud: &Outgoing<'_>) -> Option<[Vec<u16>; 3]> {
    let parts = cloud.triple(COLOURS)?;
    let is_word = parts.iter().any(|part| matches!(part.values, AttributeValues::U16(_)));
    if is_word && parts.iter().all(|part| part.values.are_whole(65535.0)) {
        let values = |part: &Attribute| -> Vec<u16> {
            (0..part.values.len()).map(|i| part.values.get(i).unwrap_or(0.0) as u16).collect()
        };
        return Some(parts.map(values));
    }
    let (colours, _) = cloud.colours()?;
    Some([0, 1, 2].map(|part| colours.iter().map(|colour| u16::from(colour[part]) * 257).collect()))
}

/// Bytes of a point that holds the attributes of a cloud, and its format.
pub(super) fn layout(cloud: &Outgoing<'_>) -> (usize, u8) {
    if words(cloud).is_some() { (26, 2) } else { (20, 0) }
}

/// Puts the attributes into records of the [`layout`].
pub(super) fn put(cloud: &Outgoing<'_>, length: usize, records: &mut [u8]) {
    for attribute in cloud.attributes.iter().filter(|a| keeps(a, cloud)) {
        let Some((_, kind, at)) = EARLY.iter().find(|(name, ..)| *name == attribute.name) else { continue };
        for (index, record) in records.chunks_exact_mut(length).enumerate() {
            let mut bytes = Vec::with_capacity(8);
            kind.put(attribute.values.get(index).unwrap_or(0.0), false, &mut bytes);
            super::header::put_word(record, *at, &bytes);
        }
    }
    let Some(words) = words(cloud) else { return };
    for (index, record) in records.chunks_exact_mut(length).enumerate() {
        for (part, values) in words.iter().enumerate() {
            super::header::put_word(record, 20 + 2 * part, &values[index].to_le_bytes());
        }
    }
}
