//! A glTF file as its parts: the JSON, and the bytes of its buffers.

use std::borrow::Cow;
use std::path::{Component, Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::binary::Glb;
use gltf::json::{Root, Value, deserialize};

use super::super::bytes::read_file;
use super::super::scan::quote;
use super::super::{FormatError, IoError, ReadOptions};

/// The parts of a file.
pub(super) struct GltfParts<'a> {
    pub json: Cow<'a, [u8]>,
    /// What follows the JSON in a `.glb`.
    pub bin: Option<Cow<'a, [u8]>>,
    /// Whether it is a `.glb`.
    pub glb: bool,
}

impl GltfParts<'_> {
    /// The JSON, with all that it holds.
    pub fn value(&self) -> Result<Value, FormatError> {
        deserialize::from_slice(&self.json).map_err(|e| content(format!("the JSON is damaged: {e}")))
    }
}

/// The file, taken apart.
pub(super) struct GltfDocument<'a> {
    pub root: Root,
    pub nodes: Vec<Placed>,
    pub buffers: Vec<Cow<'a, [u8]>>,
}

/// How a node stands in its parent, in double precision: the crate keeps single, which is not enough for map
/// coordinates.
#[derive(Debug, Default, Clone, serde::Deserialize)]
pub(super) struct Placed {
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
}

#[derive(serde::Deserialize)]
struct Nodes {
    #[serde(default)]
    nodes: Vec<Placed>,
}

fn content(problem: impl Into<String>) -> FormatError {
    FormatError::Content(problem.into())
}

/// Takes a `.glb` or a `.gltf` apart.
pub(super) fn parts(bytes: &[u8]) -> Result<GltfParts<'_>, FormatError> {
    if !bytes.starts_with(b"glTF") {
        let json = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
        return Ok(GltfParts { json: Cow::Borrowed(json), bin: None, glb: false });
    }
    let length =
        bytes.get(8..).and_then(|rest| rest.first_chunk()).map(|&word| u32::from_le_bytes(word) as usize);
    let version = bytes.get(4..).and_then(|rest| rest.first_chunk()).map(|&word| u32::from_le_bytes(word));
    match (version, length) {
        (Some(2), Some(length)) if (20..=bytes.len()).contains(&length) => {}
        (Some(2), Some(length)) => {
            return Err(FormatError::truncated(format!("{length} bytes"), format!("{} bytes", bytes.len())));
        }
        (Some(version), _) => {
            let problem =
                format!("glTF of version {version}; version 2 is read, convert the file with Blender");
            return Err(content(problem));
        }
        (None, _) => {
            return Err(FormatError::truncated("a header of 12 bytes", format!("{} bytes", bytes.len())));
        }
    }
    let glb = Glb::from_slice(bytes).map_err(|e| content(format!("the GLB is damaged: {e}")))?;
    Ok(GltfParts { json: glb.json, bin: glb.bin, glb: true })
}

/// What a glTF file may need without which its points are right all the same.
fn harmless(extension: &str) -> bool {
    let begins = ["KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "EXT_lights_", "KHR_xmp"];
    begins.iter().any(|begin| extension.starts_with(begin))
        || ["KHR_mesh_quantization", "KHR_animation_pointer", "EXT_mesh_features", "EXT_structural_metadata"]
            .contains(&extension)
}

/// The words for what is compressed in a way that is not supported.
pub(super) fn compressed(extension: &str) -> FormatError {
    content(format!(
        "its points are compressed by {extension}, which is not supported; save without compression, for example \
         with `npx @gltf-transform/cli copy in.glb out.glb`"
    ))
}

const COMPRESSIONS: [&str; 3] =
    ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Reads all but the points.
///
/// # Errors
/// [`FormatError`] where it is no glTF 2, or needs what is not supported.
pub(super) fn document<'a>(
    parts: &GltfParts<'a>,
    options: &ReadOptions,
) -> Result<GltfDocument<'a>, FormatError> {
    let damaged = |e: gltf::json::Error| content(format!("the JSON is damaged or not that of glTF: {e}"));
    let root: Root = deserialize::from_slice(&parts.json).map_err(damaged)?;
    let Nodes { nodes } = deserialize::from_slice(&parts.json).map_err(damaged)?;
    if !root.asset.version.starts_with("2.") {
        let version = quote(root.asset.version.as_bytes());
        return Err(content(format!(
            "glTF of version {version}; version 2 is read, convert the file with Blender"
        )));
    }
    for needed in &root.extensions_required {
        if COMPRESSIONS.contains(&needed.as_str()) {
            return Err(compressed(needed));
        }
        if !harmless(needed) {
            let needed = quote(needed.as_bytes());
            return Err(content(format!(
                "it needs the extension {needed}, which is not supported; save without it"
            )));
        }
    }
    let mut buffers = Vec::new();
    for (index, buffer) in root.buffers.iter().enumerate() {
        let bytes = match buffer.uri.as_deref() {
            Some(uri) => resolve(uri, options)?,
            None => match (index, &parts.bin) {
                (0, Some(bin)) => bin.clone(),
                _ => Cow::Borrowed(&[][..]),
            },
        };
        buffers.push(bytes);
    }
    Ok(GltfDocument { root, nodes, buffers })
}

impl GltfDocument<'_> {
    /// The compression that the file uses, if any.
    pub fn compression(&self) -> Option<&'static str> {
        COMPRESSIONS.into_iter().find(|name| self.root.extensions_used.iter().any(|used| used == name))
    }
}

/// The bytes of a buffer that is named: inside the JSON, or a file in the folder of the `.gltf`.
fn resolve(uri: &str, options: &ReadOptions) -> Result<Cow<'static, [u8]>, FormatError> {
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((_, text)) = data.split_once(";base64,") else {
            return Err(content("a buffer inside the JSON that is not in base64"));
        };
        let bytes = STANDARD.decode(text).map_err(|e| content(format!("a buffer is not in base64: {e}")))?;
        return Ok(Cow::Owned(bytes));
    }
    let shown = quote(uri.as_bytes());
    let name = percent_decoded(uri).filter(|name| !name.contains([':', '\\', '\0']));
    let name = name.map(PathBuf::from).filter(|name| {
        let plain = |part| matches!(part, Component::Normal(_) | Component::CurDir);
        name.components().all(plain) && name.file_name().is_some()
    });
    let name = name.ok_or_else(|| {
        content(format!("the buffer {shown} is not inside the folder of the file; only files there are read"))
    })?;
    let folder = options.folder.as_deref().ok_or_else(|| {
        content(format!("the buffer {shown} is a file of its own, and a stream has no folder; save as .glb"))
    })?;
    let path = folder.join(name);
    let unread = |e: std::io::Error| content(format!("the buffer {shown} cannot be read: {e}"));
    inside(folder, &path).map_err(unread)?.then_some(()).ok_or_else(|| {
        content(format!(
            "the buffer {shown} is a link out of the folder of the file; only files there are read"
        ))
    })?;
    match read_file(&path, options) {
        Ok(bytes) => Ok(Cow::Owned(bytes)),
        Err(IoError::Format { source, .. }) => Err(source),
        Err(IoError::Read { source, .. }) => Err(unread(source)),
        Err(other) => Err(content(format!("the buffer {shown} cannot be read: {other}"))),
    }
}

/// Whether a file, its links followed, is inside a folder.
fn inside(folder: &Path, file: &Path) -> std::io::Result<bool> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    Ok(file.canonicalize()?.starts_with(folder.canonicalize()?))
}

fn percent_decoded(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, after @ ..] = rest {
        rest = after;
        if *first == b'%' {
            let hex = std::str::from_utf8(after.get(..2)?).ok()?;
            bytes.push(u8::from_str_radix(hex, 16).ok()?);
            rest = &after[2..];
        } else {
            bytes.push(*first);
        }
    }
    String::from_utf8(bytes).ok()
}
