//! Which format a file has: by its extension, by its content, or by a name.

use std::path::{Path, PathBuf};

use super::{CloudFormat, FORMATS, IoError, foreign};
use crate::CloudError;

/// Formats that need a cargo feature of the same name, and the extensions of their files.
const OPTIONAL: &[(&str, &[&str])] = &[
    ("las", &["las", "laz"]),
    ("e57", &["e57"]),
    ("gltf", &["glb", "gltf"]),
    ("mcap", &["mcap"]),
    ("parquet", &["parquet", "pq"]),
];

/// The extension of a file, in small letters.
pub(super) fn extension_of(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// The format that the extension of `path` says.
pub(super) fn format_of(path: &Path) -> Result<&'static dyn CloudFormat, IoError> {
    let extension = extension_of(path);
    let unknown =
        if extension.is_empty() { "there is no extension" } else { "the extension says no known format" };
    find(path, &extension, unknown)
}

/// The format of this name or extension.
pub(super) fn named(name: &str) -> Result<&'static dyn CloudFormat, IoError> {
    find(Path::new(name), &name.to_ascii_lowercase(), "this is the name of no known format")
}

/// The file and the scan of a name such as `file.e57#2`, where no file has that very name.
pub(super) fn scan_of(path: &Path) -> Option<(PathBuf, usize)> {
    let name = path.file_name()?.to_str()?;
    let (file, number) = name.rsplit_once('#')?;
    let file = path.with_file_name(file);
    let number = number.parse().ok()?;
    (!path.exists() && file.is_file()).then_some((file, number))
}

fn find(path: &Path, name: &str, fact: &'static str) -> Result<&'static dyn CloudFormat, IoError> {
    let is = |format: &&&dyn CloudFormat| format.name() == name || format.extensions().contains(&name);
    if let Some(format) = FORMATS.iter().find(is) {
        return Ok(*format);
    }
    match OPTIONAL.iter().find(|(_, extensions)| extensions.contains(&name)) {
        Some((format, _)) => Err(IoError::LeftOut { path: path.to_owned(), format }),
        None => Err(unknown(path, fact)),
    }
}

/// The format that the content says.
pub(super) fn detect(path: &Path, bytes: &[u8]) -> Result<&'static dyn CloudFormat, IoError> {
    if bytes.is_empty() {
        return Err(IoError::Cloud { path: path.to_owned(), source: CloudError::Empty });
    }
    if let Some(format) = FORMATS.iter().find(|format| format.recognises(bytes)) {
        return Ok(*format);
    }
    for (magic, format) in [
        (&b"LASF"[..], "las"),
        (b"ASTM-E57", "e57"),
        (b"glTF", "gltf"),
        (b"\x89MCAP0", "mcap"),
        (b"PAR1", "parquet"),
    ] {
        if bytes.starts_with(magic) {
            return Err(IoError::LeftOut { path: path.to_owned(), format });
        }
    }
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let by_content = foreign::name(bytes).filter(|_| !foreign::may_hold_anything(bytes));
    let what = by_content.or_else(|| foreign::of_extension(&extension)).or_else(|| foreign::name(bytes));
    if let Some(what) = what {
        return Err(IoError::Foreign { path: path.to_owned(), what });
    }
    Err(unknown(path, "neither the name nor the content says a known format"))
}

fn unknown(path: &Path, fact: &'static str) -> IoError {
    let mut known: Vec<&str> = FORMATS.iter().flat_map(|f| f.extensions()).copied().collect();
    known.extend(FORMATS.iter().map(|f| f.name()).filter(|name| !known.contains(name)).collect::<Vec<_>>());
    IoError::UnknownFormat { path: path.to_owned(), fact, known: known.join(", ") }
}
