//! glTF 2, the format of meshes and points for viewers, by the `gltf` crate: `.glb` and `.gltf`.
//!
//! The crate gives the structure of a file; the numbers of accessors are read here, because the crate's
//! own iterators panic on sparse accessors that lie, and keep nodes in single precision.

mod accessor;
mod document;
mod moved;
mod scene;

use std::io::{self, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::binary::{Glb, Header};

use super::outgoing::{COLOURS, NORMALS};
use super::single::check_single;
use super::{
    Attribute, AttributeValues, CloudFormat, Contents, FormatError, Note, Outgoing, ReadOptions, Room,
};
use crate::Rigid;

/// glTF files. The points of all meshes of the scene are read, each placed by its nodes; triangles,
/// strips and fans are faces. Written with one list of points, their colours in 8 bits and their
/// normals. A moved copy has a node
/// above all others; all else stays.
pub(super) struct Gltf {
    /// `.glb`, or `.gltf` with everything in its JSON; both are read as what they are.
    binary: bool,
}

/// `.glb`.
pub(super) static GLB: Gltf = Gltf { binary: true };
/// `.gltf`.
pub(super) static GLTF: Gltf = Gltf { binary: false };

impl CloudFormat for Gltf {
    fn name(&self) -> &'static str {
        if self.binary { "glb" } else { "gltf" }
    }

    fn extensions(&self) -> &[&'static str] {
        if self.binary { &["glb"] } else { &["gltf"] }
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        if self.binary {
            return bytes.starts_with(b"glTF");
        }
        let begin = &bytes[..bytes.len().min(4096)];
        let json = begin.strip_prefix("\u{feff}".as_bytes()).unwrap_or(begin).trim_ascii_start();
        let names = |word: &[u8]| json.windows(word.len()).any(|window| window == word);
        json.starts_with(b"{") && names(b"\"asset\"") && names(b"\"version\"")
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let document = document::document(&document::parts(bytes)?, options)?;
        let scene = document.scene(bytes.len(), options)?;
        let mut notes = Vec::new();
        if scene.loose > 0 && !scene.faces.is_empty() {
            notes.push(Note::LoosePoints { points: scene.loose });
        }
        Ok(Contents {
            points: scene.points,
            faces: scene.faces,
            single: scene.single,
            notes,
            ..Contents::default()
        })
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        let document = document::document(&document::parts(bytes)?, options)?;
        let scene = document.scene(bytes.len(), options)?;
        let mut attributes = Vec::new();
        for (axis, name) in ["nx", "ny", "nz"].into_iter().enumerate() {
            if let Some(normals) = scene.normals.as_ref().filter(|normals| !normals.is_empty()) {
                let values = normals.iter().map(|normal| normal[axis] as f32).collect();
                attributes.push(Attribute { name: name.into(), values: AttributeValues::F32(values) });
            }
        }
        for (channel, name) in ["red", "green", "blue", "alpha"].into_iter().enumerate() {
            if let Some(colours) = scene.colours.as_ref().filter(|colours| !colours.is_empty()) {
                let byte = |value: f64| (value.clamp(0.0, 1.0) * 255.0).round() as u8;
                let values = colours.iter().map(|colour| byte(colour[channel])).collect();
                attributes.push(Attribute { name: name.into(), values: AttributeValues::U8(values) });
            }
        }
        Ok(attributes)
    }

    fn keeps(&self, attribute: &Attribute, cloud: &Outgoing<'_>) -> bool {
        let of = |names: [&str; 3]| names.contains(&attribute.name.as_str()) && cloud.triple(names).is_some();
        of(COLOURS) || of(NORMALS)
    }

    fn room(&self) -> Room {
        Room::SomePoints
    }

    fn check_points(&self, points: &[[f64; 3]]) -> Result<(), FormatError> {
        check_single(points, "glTF")?;
        if points.is_empty() || !points.iter().flatten().all(|c| c.is_finite()) {
            return Err(Room::refusal("glTF holds neither empty clouds nor NaN; write .ply"));
        }
        if points.len() > (u32::MAX as usize - (1 << 16)) / 28 {
            let problem = format!("a .glb holds at most 4 GB, not {} points; write .ply", points.len());
            return Err(FormatError::Unwritable(problem));
        }
        Ok(())
    }

    fn check_rewrite(
        &self,
        from: &str,
        bytes: &[u8],
        options: &ReadOptions,
    ) -> Option<Result<Room, FormatError>> {
        let check = || {
            let parts = document::parts(bytes)?;
            moved::check(&parts.value()?, &document::document(&parts, options)?)?;
            Ok(Room::Anything)
        };
        (from == self.name()).then(check)
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        let points = cloud.points;
        self.check_points(points)?;
        let mut bin: Vec<u8> = points.iter().flatten().flat_map(|&c| (c as f32).to_le_bytes()).collect();
        let count = points.len();
        let mut arrays: Vec<(&str, &str, Vec<u8>)> = Vec::new();
        if let Some(normals) = cloud.triple(NORMALS) {
            let parts = |point| normals.map(|part| part.values.get(point).unwrap_or(0.0) as f32);
            let bytes = (0..count).flat_map(parts).flat_map(f32::to_le_bytes).collect();
            arrays.push(("NORMAL", "\"componentType\":5126,\"type\":\"VEC3\"", bytes));
        }
        if let Some((colours, _)) = cloud.colours() {
            let bytes = colours.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
            let accessor = "\"componentType\":5121,\"normalized\":true,\"type\":\"VEC4\"";
            arrays.push(("COLOR_0", accessor, bytes));
        }
        let (mut names, mut accessors, mut views) = (String::new(), String::new(), String::new());
        for (number, (name, accessor, bytes)) in (1..).zip(arrays) {
            names += &format!(",\"{name}\":{number}");
            accessors += &format!(",{{\"bufferView\":{number},\"count\":{count},{accessor}}}");
            let (at, length) = (bin.len(), bytes.len());
            views +=
                &format!(",{{\"buffer\":0,\"byteOffset\":{at},\"byteLength\":{length},\"target\":34962}}");
            bin.extend(bytes);
        }
        let bound = |axis: usize, pick: fn(f32, f32) -> f32| {
            points.iter().map(|point| point[axis] as f32).reduce(pick).unwrap_or_default()
        };
        let bounds = |pick| format!("[{},{},{}]", bound(0, pick), bound(1, pick), bound(2, pick));
        let (low, high, length) = (bounds(f32::min), bounds(f32::max), bin.len());
        let of_points = 12 * count;
        let uri = if self.binary {
            String::new()
        } else {
            format!("\"uri\":\"data:application/octet-stream;base64,{}\",", STANDARD.encode(&bin))
        };
        let json = format!(
            "{{\"asset\":{{\"version\":\"2.0\",\"generator\":\"srrf\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\
             \"nodes\":[{{\"mesh\":0}}],\"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0{names}}},\"mode\":0}}]}}],\
             \"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":{count},\"type\":\"VEC3\",\
             \"min\":{low},\"max\":{high}}}{accessors}],\
             \"bufferViews\":[{{\"buffer\":0,\"byteLength\":{of_points},\"target\":34962}}{views}],\
             \"buffers\":[{{{uri}\"byteLength\":{length}}}]}}"
        );
        if !self.binary {
            return out.write_all(json.as_bytes());
        }
        let header = Header { magic: *b"glTF", version: 2, length: 0 };
        let glb = Glb { header, json: json.into_bytes().into(), bin: Some(bin.into()) };
        glb.to_writer(out).map_err(io::Error::other)
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        let parts = document::parts(bytes)?;
        let document = document::document(&parts, options)?;
        // Read once, so that a damaged file is not copied.
        document.scene(bytes.len(), options)?;
        if *motion == Rigid::identity() {
            return out.write_all(bytes);
        }
        moved::write(&parts, &document, motion, out)
    }
}

#[cfg(test)]
mod tests;
