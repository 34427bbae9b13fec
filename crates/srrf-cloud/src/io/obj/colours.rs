//! Colours behind the place of a vertex, `v x y z r g b`, as MeshLab, CloudCompare and Open3D write them.

use std::io::{self, Write};

use super::super::outgoing::COLOURS;
use super::super::scalar::Scalar;
use super::super::scan::{number, put_point, put_single};
use super::super::text::smallest;
use super::super::{Attribute, FormatError, Outgoing, ReadOptions};
use super::{statements, words};

/// How far a share of 255 may lie from a whole number that it stands for: six decimals.
const ROUNDING: f64 = 2e-4;

/// The colours, where all vertices have them: in 8 bits where they are shares of 255, or whole numbers.
pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
    let mut parts: [Vec<f64>; 3] = Default::default();
    for line in statements(bytes) {
        let mut words = words(&line);
        if words.next().is_none_or(|(_, word)| word != b"v") {
            continue;
        }
        let mut colour = words.skip(3).map(|(_, word)| number(word).ok());
        let Some([Some(red), Some(green), Some(blue)]) = triple(&mut colour) else { return Ok(Vec::new()) };
        for (list, value) in parts.iter_mut().zip([red, green, blue]) {
            options.grow("the colours", bytes.len(), list)?;
            list.push(value);
        }
    }
    if parts[0].is_empty() {
        return Ok(Vec::new());
    }
    let all = || parts.iter().flatten();
    let shares = all().all(|value| (0.0..=1.0).contains(value));
    let eight = all().all(|value| (value * 255.0 - (value * 255.0).round()).abs() <= ROUNDING);
    let attribute = |(name, list): (&&str, Vec<f64>)| {
        let values = match (shares, eight) {
            (true, true) => {
                Scalar::U8.of_numbers(&list.iter().map(|v| (v * 255.0).round()).collect::<Vec<_>>())
            }
            (true, false) => Scalar::F32.of_numbers(&list),
            (false, _) => smallest(&list),
        };
        Attribute { name: (*name).to_owned(), values }
    };
    Ok(COLOURS.iter().zip(parts.clone()).map(attribute).collect())
}

fn triple<T>(list: &mut impl Iterator<Item = T>) -> Option<[T; 3]> {
    Some([list.next()?, list.next()?, list.next()?])
}

/// Writes the vertices, with their colours as shares of 1.
pub(super) fn write(cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
    let shares = cloud.shares();
    let mut row = Vec::with_capacity(96);
    for (index, point) in cloud.points.iter().enumerate() {
        row.clear();
        row.extend_from_slice(b"v ");
        put_point(&mut row, point);
        for &part in shares.iter().flat_map(|shares| &shares[index]) {
            row.push(b' ');
            put_single(&mut row, part);
        }
        row.push(b'\n');
        out.write_all(&row)?;
    }
    Ok(())
}
