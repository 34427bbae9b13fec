//! Copies of the scans of a map, each moved into its frame: what holds poses, as E57 and PTX do, keeps its points and gets new poses.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use srrf_align::Map;
use srrf_args::{Failure, files};
use srrf_cloud::Rigid;
use srrf_cloud::io::{CloudFile, IoError, ReadOptions};

use super::align_scans::ScanFiles;

/// The name of each copy and its file. Scans of one file have one copy.
///
/// # Errors
/// [`Failure::usage`] for two files of one name.
pub fn names(scans: &ScanFiles) -> Result<BTreeMap<PathBuf, PathBuf>, Failure> {
    let mut names: BTreeMap<PathBuf, PathBuf> = BTreeMap::new();
    for number in 0..scans.len() {
        let (file, _) = scans.file(number);
        let name = PathBuf::from(file.file_name().unwrap_or_default());
        if let Some(other) = names.insert(name, file.to_owned()).filter(|other| other != file) {
            return Err(Failure::usage(format!(
                "--moved: {other:?} and {file:?} have the same name, and the copy of one would replace that of the other; rename one"
            )));
        }
    }
    Ok(names)
}

/// Checks, before any work is done, that a moved copy of each file can be written.
///
/// # Errors
/// [`Failure::usage`] for a file of a format, or of a kind, that is not written.
pub fn check(scans: &ScanFiles) -> Result<(), Failure> {
    for file in names(scans)?.into_values() {
        let read = CloudFile::open_with(&file, scans.options().clone())?;
        read.check_transformed_to(None, &[]).map_err(|error| {
            let why = match &error {
                IoError::Write { source, .. } => source.to_string(),
                other => other.to_string(),
            };
            Failure::usage(format!("--moved: no moved copy of {file:?} can be written: {why}")).because(error)
        })?;
    }
    Ok(())
}

/// What was written, and the scans that are not in the largest map: those stay as they were in a file of several.
#[derive(Debug, Default, PartialEq)]
pub struct MovedCopies {
    /// Files.
    pub written: usize,
    /// Names of scans.
    pub unmoved: Vec<String>,
}

/// Writes a copy of each file that holds a scan of the largest map.
///
/// # Errors
/// [`Failure`], which names the file.
pub fn write(map: &Map, scans: &ScanFiles, folder: &Path) -> Result<MovedCopies, Failure> {
    std::fs::create_dir_all(folder).map_err(|e| {
        Failure::failed(format!("cannot make the folder {folder:?}: {e}; choose another --moved"))
    })?;
    let mut copies = MovedCopies::default();
    for (name, file) in names(scans)? {
        let of_file: Vec<usize> = (0..scans.len()).filter(|i| scans.file(*i).0 == file).collect();
        let (placed, left): (Vec<usize>, Vec<usize>) =
            of_file.into_iter().partition(|i| map.scans[*i].component == 0 && map.components[0].len() > 1);
        copies.unmoved.extend(left.into_iter().map(|i| scans.name(i)));
        if placed.is_empty() {
            continue;
        }
        let motions: Vec<(Option<usize>, Rigid)> =
            placed.iter().map(|&i| (scans.file(i).1, map.scans[i].map_from_scan)).collect();
        copy(&file, &folder.join(name), &motions, scans.options())?;
        copies.written += 1;
    }
    Ok(copies)
}

/// Moves the scans of these numbers, or the whole file.
fn copy(
    file: &Path,
    to: &Path,
    motions: &[(Option<usize>, Rigid)],
    options: &ReadOptions,
) -> Result<(), Failure> {
    let [first, rest @ ..] = motions else { return Ok(()) };
    let with = |scan: Option<usize>| scan.map_or_else(|| options.clone(), |scan| options.of_scan(scan));
    let read = CloudFile::open_with(file, with(first.0))?;
    let format = read.format();
    let mut bytes = Vec::new();
    read.write_transformed_to(&mut bytes, None, &first.1)?;
    for (scan, motion) in rest {
        let next = CloudFile::from_reader_with(&mut &bytes[..], Some(format), with(*scan))?;
        let mut moved = Vec::new();
        next.write_transformed_to(&mut moved, None, motion)?;
        bytes = moved;
    }
    files::write(to, &bytes)
}
