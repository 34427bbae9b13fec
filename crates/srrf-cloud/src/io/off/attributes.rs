//! Colours and normals of the vertices of an OFF file.

use std::io::{self, Write};

use super::super::outgoing::{COLOURS, NORMALS};
use super::super::scalar::Scalar;
use super::super::scan::{number, put_point};
use super::super::text::smallest;
use super::super::{Attribute, FormatError, Outgoing, ReadOptions};
use super::header::OffHeader;
use super::lines::Lines;
use super::rows::Rows;

/// Reads what the letters before `OFF` announce, as far as all vertices have it.
pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
    let (_, header, rows) = super::parse(bytes, options)?;
    let mut names: Vec<(&str, usize)> = Vec::new();
    let mut at = header.place();
    if header.normals {
        names.extend(NORMALS.iter().enumerate().map(|(axis, name)| (*name, at + axis)));
        at += 3;
    }
    if header.colours {
        names.extend(COLOURS.iter().enumerate().map(|(part, name)| (*name, at + part)));
        // Three parts where the row ends behind them.
        if !matches!(rows, Rows::Words { vertex } if vertex == header.width(3)) {
            names.push(("alpha", at + 3));
        }
    }
    options.check_memory("the attributes", bytes.len(), header.vertices.saturating_mul(8 * names.len()))?;
    let mut columns: Vec<Option<Vec<f64>>> = names.iter().map(|_| Some(Vec::new())).collect();
    let mut lines = Lines::new(bytes);
    OffHeader::parse(&mut lines)?;
    let mut row = Vec::new();
    for _ in 0..header.vertices {
        if rows.vertex(&mut lines, &mut row).is_none() {
            break;
        }
        for (column, (name, place)) in columns.iter_mut().zip(&names) {
            // With texture, a colour of three parts cannot be told from one of four but by the length of the row.
            let short = *name == "alpha" && row.len() < header.width(4);
            let value = row.get(*place).filter(|_| !short).and_then(|(_, word)| number(word).ok());
            match (value, &mut *column) {
                (Some(value), Some(list)) => list.push(value),
                (None, column) => *column = None,
                (Some(_), None) => {}
            }
        }
    }
    // Colours are whole numbers up to 255, or shares of 1.
    let is_colour = |name: &str| !NORMALS.contains(&name);
    let parts = names
        .iter()
        .zip(&columns)
        .filter(|((name, _), _)| is_colour(name))
        .filter_map(|(_, list)| list.as_ref());
    let shares = parts.flatten().all(|&value| value <= 1.0);
    let found = names.iter().zip(columns);
    let attribute = |((name, _), list): (&(&str, usize), Option<Vec<f64>>)| {
        let list = list?;
        let values = if is_colour(name) && shares { Scalar::F32.of_numbers(&list) } else { smallest(&list) };
        Some(Attribute { name: (*name).into(), values })
    };
    Ok(found.filter_map(attribute).collect())
}

/// Whether the rows have room for it.
pub(super) fn keeps(attribute: &Attribute, cloud: &Outgoing<'_>) -> bool {
    let name = attribute.name.as_str();
    (NORMALS.contains(&name) && cloud.triple(NORMALS).is_some())
        || ((COLOURS.contains(&name) || name == "alpha") && cloud.triple(COLOURS).is_some())
}

/// Writes the points with their normals (`NOFF`) and colours (`COFF`), where they have them.
pub(super) fn write(cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
    let normals = cloud.triple(NORMALS);
    let colours = cloud.triple(COLOURS);
    let (c, n) = (if colours.is_some() { "C" } else { "" }, if normals.is_some() { "N" } else { "" });
    writeln!(out, "{c}{n}OFF\n{} 0 0", cloud.points.len())?;
    let alpha = cloud.attribute("alpha");
    // A share of 1 or of 255, as the colours are.
    let shares = colours.is_some_and(|parts| parts.iter().all(|part| part.most() <= 1.0));
    let opaque: &[u8] = if shares { b" 1" } else { b" 255" };
    let mut row = Vec::with_capacity(96);
    for (index, point) in cloud.points.iter().enumerate() {
        row.clear();
        put_point(&mut row, point);
        for attribute in normals.iter().chain(&colours).flatten() {
            row.push(b' ');
            attribute.values.put_text(index, &mut row);
        }
        match (colours, alpha) {
            (Some(_), Some(alpha)) => {
                row.push(b' ');
                alpha.values.put_text(index, &mut row);
            }
            (Some(_), None) => row.extend_from_slice(opaque),
            (None, _) => {}
        }
        row.push(b'\n');
        out.write_all(&row)?;
    }
    Ok(())
}
