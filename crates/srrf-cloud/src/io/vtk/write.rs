//! Points as legacy and as XML files, each with a cell, so that viewers show it.

use std::io::{self, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::super::{FormatError, Outgoing, Room};
use super::arrays;
use super::xml::XmlKind;

pub(super) const NO_GRID: &str = "a .vts holds a grid, which other clouds do not have; write .vtp";

fn check(count: usize) -> io::Result<i32> {
    let problem = format!("VTK holds no {count} points; write .ply");
    i32::try_from(count).map_err(|_| FormatError::Unwritable(problem).into())
}

/// Binary POLYDATA.
pub(super) fn legacy(cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
    let points = cloud.points;
    let count = check(points.len())?;
    let kind = if cloud.single { "float" } else { "double" };
    write!(out, "# vtk DataFile Version 3.0\nsrrf\nBINARY\nDATASET POLYDATA\nPOINTS {count} {kind}\n")?;
    points.iter().flatten().try_for_each(|&c| match cloud.single {
        true => out.write_all(&(c as f32).to_be_bytes()),
        false => out.write_all(&c.to_be_bytes()),
    })?;
    write!(out, "\nVERTICES {count} {}\n", 2 * points.len())?;
    (0..count).try_for_each(|index| {
        out.write_all(&1i32.to_be_bytes())?;
        out.write_all(&index.to_be_bytes())
    })?;
    out.write_all(b"\n")?;
    arrays::legacy(cloud, out)
}

/// An array in base64, behind its size.
fn array(kind: &str, name: &str, components: usize, bytes: impl Iterator<Item = u8>) -> String {
    let mut all = vec![0; 8];
    all.extend(bytes);
    let size = all.len() as u64 - 8;
    all[..8].copy_from_slice(&size.to_le_bytes());
    let text = STANDARD.encode(all);
    format!(
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">{text}\
         </DataArray>\n"
    )
}

/// PolyData or UnstructuredGrid.
pub(super) fn xml(kind: XmlKind, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
    let count = i64::from(check(cloud.points.len())?);
    let numbers = cloud.points.iter().flatten();
    let coordinates = match cloud.single {
        true => array("Float32", "Points", 3, numbers.flat_map(|&c| (c as f32).to_le_bytes())),
        false => array("Float64", "Points", 3, numbers.flat_map(|c| c.to_le_bytes())),
    };
    let (mut values, mut normals) = (String::new(), "");
    for one in arrays::arrays(cloud) {
        let name = arrays::escaped(&one.name);
        values += &array(arrays::xml_type(one.kind), &name, one.components, one.bytes.into_iter());
        if one.normals {
            normals = " Normals=\"normals\"";
        }
    }
    let connectivity = array("Int64", "connectivity", 1, (0..count).flat_map(i64::to_le_bytes));
    let offsets = array("Int64", "offsets", 1, (1..=count).flat_map(i64::to_le_bytes));
    let (counts, list, types) = match kind {
        XmlKind::PolyData => (
            format!("NumberOfVerts=\"{count}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"0\""),
            "Verts",
            String::new(),
        ),
        XmlKind::UnstructuredGrid => (
            format!("NumberOfCells=\"{count}\""),
            "Cells",
            // Cells of one point.
            array("UInt8", "types", 1, (0..count).map(|_| 1)),
        ),
        XmlKind::StructuredGrid => {
            return Err(Room::refusal(NO_GRID).into());
        }
    };
    let name = kind.name();
    write!(
        out,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{name}\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n<{name}>\n<Piece NumberOfPoints=\"{count}\" {counts}>\n<PointData{normals}>\n{values}\
         </PointData>\n<Points>\n{coordinates}</Points>\n<{list}>\n{connectivity}{offsets}{types}</{list}>\n</Piece>\n</{name}>\n</VTKFile>\n"
    )
}
