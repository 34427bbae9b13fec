//! What the points of E57 scans have besides their place.

use std::io::Cursor;

use e57::{E57Reader, PointCloud, RecordDataType, RecordName};

use super::super::outgoing::{COLOURS, INTENSITY, NORMALS};
use super::super::scalar::Scalar;
use super::super::scan::turned;
use super::super::{Attribute, ReadOptions};
use super::{E57Problem, NORMALS_NAMESPACE, pose, value, wanted};

/// The column of a normal, of the extension for them.
pub(super) fn normal(axis: usize) -> RecordName {
    let name = ["normalX", "normalY", "normalZ"][axis].to_owned();
    RecordName::Unknown { namespace: NORMALS_NAMESPACE.to_owned(), name }
}

/// The name of a column that is an attribute.
fn known(column: &RecordName) -> Option<&'static str> {
    Some(match column {
        RecordName::ColorRed => COLOURS[0],
        RecordName::ColorGreen => COLOURS[1],
        RecordName::ColorBlue => COLOURS[2],
        RecordName::Intensity => INTENSITY,
        RecordName::RowIndex => "row_index",
        RecordName::ColumnIndex => "column_index",
        RecordName::ReturnCount => "return_count",
        RecordName::ReturnIndex => "return_index",
        RecordName::TimeStamp => "time_stamp",
        RecordName::Unknown { name, .. } => {
            let axis = ["normalX", "normalY", "normalZ"].iter().position(|n| name.eq_ignore_ascii_case(n))?;
            NORMALS[axis]
        }
        _ => return None,
    })
}

/// The smallest type of all values of a column.
fn scalar(kind: &RecordDataType) -> Scalar {
    match kind {
        RecordDataType::Single { .. } => Scalar::F32,
        RecordDataType::Integer { min, max } => match (*min, *max) {
            (0.., ..=255) => Scalar::U8,
            (0.., ..=65_535) => Scalar::U16,
            (-2_147_483_648.., ..=2_147_483_647) => Scalar::I32,
            _ => Scalar::I64,
        },
        RecordDataType::Double { .. } | RecordDataType::ScaledInteger { .. } => Scalar::F64,
    }
}

/// The columns that all scans have, and their types.
fn shared(scans: &[PointCloud]) -> Vec<(&'static str, Scalar)> {
    let columns = |scan: &PointCloud| -> Vec<(&'static str, Scalar)> {
        scan.prototype.iter().filter_map(|r| Some((known(&r.name)?, scalar(&r.data_type)))).collect()
    };
    let mut all = scans.iter().map(columns);
    let mut found = all.next().unwrap_or_default();
    for others in all {
        found.retain_mut(|(name, kind)| {
            let other = others.iter().find(|(other, _)| other == name);
            if other.is_some_and(|(_, other)| other != kind) {
                *kind = Scalar::F64;
            }
            other.is_some()
        });
    }
    found
}

/// The attributes of the points, in their order; normals in the frame of the file.
pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, E57Problem> {
    let mut reader = E57Reader::new(Cursor::new(bytes))?;
    let scans = wanted(bytes, &reader.pointclouds(), options)?;
    let found = shared(&scans);
    if found.is_empty() {
        return Ok(Vec::new());
    }
    let points = scans.iter().map(|scan| usize::try_from(scan.records).unwrap_or(usize::MAX));
    let points = points.fold(0usize, usize::saturating_add);
    let planned = points.saturating_mul(16 * found.len());
    options.check_memory("the attributes", bytes.len(), planned).map_err(E57Problem::Format)?;
    let mut lists: Vec<Vec<f64>> = vec![Vec::with_capacity(points); found.len()];
    let normals = NORMALS.map(|name| found.iter().position(|(other, _)| *other == name));
    for scan in &scans {
        let place = |name: &str| scan.prototype.iter().position(|r| known(&r.name) == Some(name));
        let places: Vec<usize> = found.iter().filter_map(|(name, _)| place(name)).collect();
        let pose = pose(scan);
        for values in reader.pointcloud_raw(scan)? {
            let values = values?;
            for (list, &column) in lists.iter_mut().zip(&places) {
                list.push(value(&values, &scan.prototype, column));
            }
            if let (Some(pose), [Some(x), Some(y), Some(z)]) = (&pose, normals) {
                let old = [x, y, z].map(|at| lists[at].last().copied().unwrap_or(f64::NAN));
                for (at, new) in [x, y, z].into_iter().zip(turned(pose, old)) {
                    lists[at].pop();
                    lists[at].push(new);
                }
            }
        }
    }
    let made = found.into_iter().zip(lists);
    Ok(made
        .map(|((name, kind), list)| Attribute { name: name.to_owned(), values: kind.of_numbers(&list) })
        .collect())
}

/// Names of the columns that are neither places nor attributes.
pub(super) fn left_out(bytes: &[u8], options: &ReadOptions) -> Result<Vec<String>, E57Problem> {
    let reader = E57Reader::new(Cursor::new(bytes))?;
    let scans = wanted(bytes, &reader.pointclouds(), options)?;
    let found = shared(&scans);
    let mut names: Vec<String> = Vec::new();
    for record in scans.iter().flat_map(|scan| &scan.prototype) {
        let name = match (&record.name, known(&record.name)) {
            (_, Some(name)) if found.iter().all(|(other, _)| *other != name) => name.to_owned(),
            (RecordName::Unknown { name, .. }, None) => name.clone(),
            _ => continue,
        };
        if !names.contains(&name) {
            names.push(name);
        }
    }
    Ok(names)
}
