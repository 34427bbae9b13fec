//! All bytes of a file or stream.

use std::fs;
use std::io::Read;
use std::path::Path;

use super::{CloudFormat, FORMATS, IoError, ReadOptions, TextEncoding};

/// Text of any encoding as UTF-8, and what it was in.
pub(super) fn in_utf8(
    bytes: Vec<u8>,
    path: &Path,
    options: &ReadOptions,
) -> Result<(Vec<u8>, Option<TextEncoding>), IoError> {
    let Some(encoding) = TextEncoding::of(&bytes) else { return Ok((without_mark(bytes), None)) };
    let most = bytes.len().saturating_add(bytes.len() / 2);
    let text =
        options.check_memory("the text as UTF-8", bytes.len(), most).and_then(|()| encoding.decode(&bytes));
    let text = text.map_err(|source| IoError::Format { path: path.to_owned(), source })?;
    Ok((text.into_bytes(), Some(encoding)))
}

/// The mark of Unicode that editors put before a text goes where the format begins with a word of its own.
fn without_mark(mut bytes: Vec<u8>) -> Vec<u8> {
    const MARK: &[u8] = "\u{feff}".as_bytes();
    let words = |format: &&&dyn CloudFormat| ["ply", "pcd", "off", "vtk"].contains(&format.name());
    let marked = bytes
        .strip_prefix(MARK)
        .is_some_and(|rest| FORMATS.iter().filter(words).any(|format| format.recognises(rest)));
    if marked {
        bytes.drain(..MARK.len());
    }
    bytes
}

/// All bytes of a file of any kind, as far as they are allowed to take memory.
///
/// # Errors
/// [`IoError::Read`]; [`IoError::Format`] where they are not.
pub fn read_file(path: &Path, options: &ReadOptions) -> Result<Vec<u8>, IoError> {
    let unread = |source| IoError::Read { path: path.to_owned(), source };
    let file = fs::File::open(path).map_err(unread)?;
    let length = file.metadata().map_err(unread)?.len();
    read_within(file, length, path, options)
}

/// All bytes, about `length` of them, as far as they are allowed to take memory.
pub(super) fn read_within(
    reader: impl Read,
    length: u64,
    path: &Path,
    options: &ReadOptions,
) -> Result<Vec<u8>, IoError> {
    let check = |length: u64| {
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        let checked = options.check_memory("the file alone", 0, length);
        checked.map(|()| length).map_err(|source| IoError::Format { path: path.to_owned(), source })
    };
    let mut bytes = Vec::with_capacity(check(length)?.saturating_add(1));
    if let Err(source) = reader.take(options.memory().saturating_add(1)).read_to_end(&mut bytes) {
        return Err(IoError::Read { path: path.to_owned(), source });
    }
    check(bytes.len() as u64)?;
    Ok(bytes)
}
