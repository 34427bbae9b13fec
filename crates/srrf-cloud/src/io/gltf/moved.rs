//! A moved copy of a glTF file: a node above all others, which moves them.

use std::io::{self, Write};

use gltf::binary::{Glb, Header};
use gltf::json::{Value, serialize};

use super::super::{FormatError, Room};
use super::document::{GltfDocument, GltfParts};
use crate::Rigid;

fn content(problem: impl Into<String>) -> FormatError {
    FormatError::Content(problem.into())
}

/// Checks that a copy of the file can be moved.
///
/// # Errors
/// [`FormatError::Unwritable`] where the file refers to other files, which the copy would look for beside itself, or holds
/// several scenes.
pub(super) fn check(json: &Value, document: &GltfDocument) -> Result<(), FormatError> {
    let named = |list: &str| {
        let items = json.get(list).and_then(Value::as_array).into_iter().flatten();
        items.filter_map(|item| item.get("uri").and_then(Value::as_str)).any(|uri| !uri.starts_with("data:"))
    };
    if named("buffers") || named("images") {
        return Err(Room::refusal(
            "it refers to other files, which a copy would look for beside itself; save as .glb first, or write .ply",
        ));
    }
    if document.root.scenes.len() > 1 {
        return Err(Room::refusal("it holds several scenes; save one of them, or write .ply"));
    }
    Ok(())
}

/// Writes the file anew with the node; all else stays.
///
/// # Errors
/// Those of `out`, and inside them those of [`check`].
pub(super) fn write(
    parts: &GltfParts,
    document: &GltfDocument,
    motion: &Rigid,
    out: &mut dyn Write,
) -> io::Result<()> {
    let mut json = parts.value()?;
    check(&json, document)?;
    let top = document.top_nodes()?;
    let rigid = motion.rotation;
    let t = motion.translation;
    let matrix: Vec<Value> = (0..16)
        .map(|at| match (at / 4, at % 4) {
            (3, 3) => 1.0,
            (_, 3) => 0.0,
            (3, axis) => t[axis],
            (column, row) => rigid[(row, column)],
        })
        .map(Value::from)
        .collect();
    let mut node = Value::Object(Default::default());
    node["name"] = "moved".into();
    node["children"] = top.into_iter().map(Value::from).collect();
    node["matrix"] = Value::Array(matrix);
    let nodes =
        json.get_mut("nodes").and_then(Value::as_array_mut).ok_or_else(|| content("there are no nodes"))?;
    let index = nodes.len();
    nodes.push(node);
    match json.get_mut("scenes").and_then(Value::as_array_mut).and_then(|scenes| scenes.first_mut()) {
        Some(scene) => scene["nodes"] = Value::Array(vec![index.into()]),
        None => {
            let mut scene = Value::Object(Default::default());
            scene["nodes"] = Value::Array(vec![index.into()]);
            json["scenes"] = Value::Array(vec![scene]);
            json["scene"] = 0.into();
        }
    }
    let text = serialize::to_vec(&json).map_err(|e| content(format!("the JSON is damaged: {e}")))?;
    if parts.glb {
        let header = Header { magic: *b"glTF", version: 2, length: 0 };
        let glb = Glb { header, json: text.into(), bin: parts.bin.clone() };
        return glb.to_writer(out).map_err(io::Error::other);
    }
    out.write_all(&text)
}
