//! The formats of VTK and ParaView: legacy files (`.vtk`) and XML files (`.vtp`, `.vtu`, `.vts`).

mod arrays;
mod blocks;
mod cells;
mod cursor;
mod legacy;
mod rewrite;
mod write;
mod xml;

use std::io::{self, Write};

use self::legacy::PointData;
use self::xml::{What, XmlKind};
use super::scans::attribute_values;
use super::{Attribute, CloudFormat, Contents, FormatError, Note, Outgoing, ReadOptions, Room};
use crate::Rigid;

/// Legacy files of VTK, text and binary: POLYDATA, UNSTRUCTURED_GRID and STRUCTURED_GRID. Polygons,
/// strips and flat cells are faces. Written as binary POLYDATA, with attributes as arrays. A moved copy keeps
/// all else as it is; normals are turned.
pub(super) struct Vtk;

/// XML files of VTK: PolyData, UnstructuredGrid and StructuredGrid, arrays as text, in base64 and behind
/// the XML, packed by zlib, LZ4, LZMA or not at all. Written with a cell for each point, and attributes as arrays. A moved copy
/// has points and normals as text; all else stays.
pub(super) struct VtkXml {
    kind: XmlKind,
}

/// `.vtp`.
pub(super) static VTP: VtkXml = VtkXml { kind: XmlKind::PolyData };
/// `.vtu`.
pub(super) static VTU: VtkXml = VtkXml { kind: XmlKind::UnstructuredGrid };
/// `.vts`.
pub(super) static VTS: VtkXml = VtkXml { kind: XmlKind::StructuredGrid };

/// Colours, normals and other values of points under the names of the house.
fn attributes(data: Vec<PointData>) -> Vec<Attribute> {
    let mut attributes = Vec::new();
    for data in data {
        let lower = data.name.to_ascii_lowercase();
        let colours = ["rgb", "rgba", "color", "colors", "colour", "colours"].contains(&lower.as_str());
        let names: Vec<String> = match data.components {
            1 => vec![lower],
            3 if data.normals => ["nx", "ny", "nz"].map(str::to_owned).to_vec(),
            3 | 4 if colours => {
                ["red", "green", "blue", "alpha"].map(str::to_owned)[..data.components].to_vec()
            }
            count => (0..count).map(|component| format!("{lower}_{component}")).collect(),
        };
        for (component, name) in names.into_iter().enumerate() {
            let values = data.values.iter().skip(component).step_by(data.components).copied();
            attributes.push(Attribute { name, values: attribute_values(data.kind, values) });
        }
    }
    attributes
}

/// Vertices of a mesh that no face has are lost where its surface is sampled.
fn notes(points: usize, faces: &[[u32; 3]]) -> Vec<Note> {
    if faces.is_empty() {
        return Vec::new();
    }
    let mut used = vec![false; points];
    for &corner in faces.iter().flatten() {
        if let Some(slot) = used.get_mut(corner as usize) {
            *slot = true;
        }
    }
    let loose = used.iter().filter(|used| !**used).count();
    if loose > 0 { vec![Note::LoosePoints { points: loose }] } else { Vec::new() }
}

impl CloudFormat for Vtk {
    fn name(&self) -> &'static str {
        "vtk"
    }

    fn extensions(&self) -> &[&'static str] {
        &["vtk"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        legacy::recognises(bytes)
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let file = legacy::read(bytes, options)?;
        let unread = file.unread.iter().map(|word| Note::Ignored { what: format!("all from {word} on") });
        Ok(Contents {
            notes: notes(file.points.len(), &file.faces).into_iter().chain(unread).collect(),
            single: file.kind.is_some_and(|kind| kind.is_single()),
            points: file.points,
            faces: file.faces,
            grid: file.grid,
            ..Contents::default()
        })
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        Ok(attributes(legacy::read(bytes, options)?.data))
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        write::legacy(cloud, out)
    }

    fn keeps(&self, _: &Attribute, _: &Outgoing<'_>) -> bool {
        true
    }

    fn has_both_precisions(&self) -> bool {
        true
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        rewrite::rewrite(bytes, &legacy::read(bytes, options)?, motion, out)
    }
}

impl CloudFormat for VtkXml {
    fn name(&self) -> &'static str {
        match self.kind {
            XmlKind::PolyData => "vtp",
            XmlKind::UnstructuredGrid => "vtu",
            XmlKind::StructuredGrid => "vts",
        }
    }

    fn extensions(&self) -> &[&'static str] {
        match self.kind {
            XmlKind::PolyData => &["vtp"],
            XmlKind::UnstructuredGrid => &["vtu"],
            XmlKind::StructuredGrid => &["vts"],
        }
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        xml::recognises(bytes, self.kind)
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let file = xml::read(bytes, options, What::Geometry)?;
        Ok(Contents {
            notes: notes(file.points.len(), &file.faces),
            points: file.points,
            faces: file.faces,
            single: file.single,
            grid: file.grid,
            ..Contents::default()
        })
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        Ok(attributes(xml::read(bytes, options, What::Data)?.data))
    }

    fn room(&self) -> Room {
        match self.kind {
            XmlKind::PolyData | XmlKind::UnstructuredGrid => Room::Anything,
            XmlKind::StructuredGrid => Room::Nothing(write::NO_GRID),
        }
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        write::xml(self.kind, cloud, out)
    }

    fn keeps(&self, _: &Attribute, _: &Outgoing<'_>) -> bool {
        true
    }

    fn has_both_precisions(&self) -> bool {
        true
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        let file = xml::read(bytes, options, What::Arrays)?;
        if *motion == Rigid::identity() {
            return out.write_all(bytes);
        }
        rewrite::rewrite_xml(bytes, &file, motion, out)
    }
}

#[cfg(test)]
mod tests;
