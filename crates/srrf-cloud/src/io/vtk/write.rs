//! Points as legacy and as XML files, each with a cell, so that viewers show it.

use std::io::{self, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::super::FormatError;
use super::xml::XmlKind;

fn check(count: usize) -> io::Result<i32> {
    let problem = format!("VTK holds no {count} points; write .ply");
    i32::try_from(count).map_err(|_| FormatError::Unwritable(problem).into())
}

/// Binary POLYDATA.
pub(super) fn legacy(points: &[[f64; 3]], out: &mut dyn Write) -> io::Result<()> {
    let count = check(points.len())?;
    write!(out, "# vtk DataFile Version 3.0\nsrrf\nBINARY\nDATASET POLYDATA\nPOINTS {count} double\n")?;
    points.iter().flatten().try_for_each(|c| out.write_all(&c.to_be_bytes()))?;
    write!(out, "\nVERTICES {count} {}\n", 2 * points.len())?;
    (0..count).try_for_each(|index| {
        out.write_all(&1i32.to_be_bytes())?;
        out.write_all(&index.to_be_bytes())
    })?;
    out.write_all(b"\n")
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
pub(super) fn xml(kind: XmlKind, points: &[[f64; 3]], out: &mut dyn Write) -> io::Result<()> {
    let count = i64::from(check(points.len())?);
    let coordinates = array("Float64", "Points", 3, points.iter().flatten().flat_map(|c| c.to_le_bytes()));
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
            let problem = "a .vts holds a grid, which other clouds do not have; write .vtp";
            return Err(FormatError::Unwritable(problem.into()).into());
        }
    };
    let name = kind.name();
    write!(
        out,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{name}\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n<{name}>\n<Piece NumberOfPoints=\"{count}\" {counts}>\n<Points>\n{coordinates}\
         </Points>\n<{list}>\n{connectivity}{offsets}{types}</{list}>\n</Piece>\n</{name}>\n</VTKFile>\n"
    )
}
