//! Arrays of any shape in NumPy's `.npy` and `.npz` files.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};

use super::bytes::read_file;
use super::npy::Array;
use super::{FormatError, IoError, ReadOptions, npz};

/// Why a NumPy file cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ArrayError {
    /// The file cannot be opened, read or written.
    #[error("{path:?}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The file is not an archive of arrays.
    #[error("{path:?} is not an .npz archive, or is damaged ({source}); write it with numpy.savez")]
    Archive {
        /// The file.
        path: PathBuf,
        /// The reader's reason.
        source: zip::result::ZipError,
    },
    /// An array cannot be read.
    #[error("{path:?}, array {array}: {source}")]
    Format {
        /// The file.
        path: PathBuf,
        /// Name of the array.
        array: String,
        /// What is wrong with it.
        source: FormatError,
    },
    /// An array cannot be used for what it is to be.
    #[error("{path:?}, array {array}: {problem}")]
    Array {
        /// The file.
        path: PathBuf,
        /// Name of the array.
        array: String,
        /// What is wrong, and what is expected.
        problem: String,
    },
}

/// Reads a `.npy` file, within [`ReadOptions::max_memory`].
///
/// # Errors
/// [`ArrayError`] with the file and what is wrong with it.
pub fn read_npy(path: &Path, options: &ReadOptions) -> Result<Array, ArrayError> {
    let only = |source| ArrayError::Format { path: path.to_owned(), array: "(the only one)".into(), source };
    let bytes = read_file(path, options).map_err(|error| match error {
        IoError::Read { path, source } => ArrayError::Io { path, source },
        IoError::Format { source, .. } => only(source),
        other => ArrayError::Io { path: path.to_owned(), source: io::Error::other(other) },
    })?;
    parse(&bytes, bytes.len(), options).map_err(only)
}

/// An array whose numbers have room beside the `held` bytes.
fn parse(bytes: &[u8], held: usize, options: &ReadOptions) -> Result<Array, FormatError> {
    let numbers = Array::numbers(bytes)?;
    // Those of Fortran's order are put into another list.
    options.check_memory(&format!("{numbers} numbers"), held, numbers.saturating_mul(16))?;
    Array::parse(bytes)
}

/// The arrays of a `.npz` file.
#[derive(Debug, Clone, Default)]
pub struct NpzArrays {
    /// Names in the order of the file.
    pub names: Vec<String>,
    /// The arrays by name.
    pub arrays: BTreeMap<String, Array>,
}

/// Reads all arrays of a `.npz` file, within [`ReadOptions::max_memory`].
///
/// # Errors
/// [`ArrayError`] with the file, the array and what is wrong with it.
pub fn read_npz(path: &Path, options: &ReadOptions) -> Result<NpzArrays, ArrayError> {
    let file = File::open(path).map_err(|source| ArrayError::Io { path: path.to_owned(), source })?;
    let size = file.metadata().map_err(|source| ArrayError::Io { path: path.to_owned(), source })?.len();
    let archive = |source| ArrayError::Archive { path: path.to_owned(), source };
    let mut zip = zip::ZipArchive::new(BufReader::new(file)).map_err(archive)?;
    let mut npz = NpzArrays::default();
    let mut held = 0usize;
    for index in 0..zip.len() {
        let mut entry = zip.by_index(index).map_err(archive)?;
        let Some(name) = entry.name().map_err(archive)?.strip_suffix(".npy").map(str::to_owned) else {
            continue;
        };
        let said = usize::try_from(entry.size()).unwrap_or(usize::MAX);
        let bytes = options
            .check_memory("the unpacked arrays", held, said)
            .and_then(|()| npz::unpack(&mut entry, size))
            .and_then(|bytes| parse(&bytes, held.saturating_add(bytes.len()), options));
        let array = bytes.map_err(|source| ArrayError::Format {
            path: path.to_owned(),
            array: name.clone(),
            source,
        })?;
        held += size_of_val(&array.values[..]);
        npz.names.push(name.clone());
        npz.arrays.insert(name, array);
    }
    Ok(npz)
}

/// All arrays of the bytes of a `.npz` file.
///
/// # Errors
/// [`FormatError`] for what is none, and with the name of an array that cannot be read.
pub fn parse_npz(bytes: &[u8]) -> Result<NpzArrays, FormatError> {
    let options = ReadOptions::default();
    let unreadable =
        |e: zip::result::ZipError| FormatError::Content(format!("not an NPZ archive, or cut short: {e}"));
    let mut zip = zip::ZipArchive::new(io::Cursor::new(bytes)).map_err(unreadable)?;
    let mut npz = NpzArrays::default();
    let mut held = bytes.len();
    for index in 0..zip.len() {
        let mut entry = zip.by_index(index).map_err(unreadable)?;
        let Some(name) = entry.name().map_err(unreadable)?.strip_suffix(".npy").map(str::to_owned) else {
            continue;
        };
        let said = usize::try_from(entry.size()).unwrap_or(usize::MAX);
        options.check_memory("the unpacked arrays", held, said)?;
        let unpacked = npz::unpack(&mut entry, bytes.len() as u64)?;
        // Words and objects are no numbers, and none of those that are asked for.
        if let Ok(array) = parse(&unpacked, held.saturating_add(unpacked.len()), &options) {
            held = held.saturating_add(size_of_val(&array.values[..]));
            npz.names.push(name.clone());
            npz.arrays.insert(name, array);
        }
    }
    Ok(npz)
}
