//! Where the scans of an alignment are: files, folders of them, and files of several scans.

use std::path::{Path, PathBuf};

use srrf_args::{Failure, files};
use srrf_cloud::Rigid;
use srrf_cloud::io::{ReadOptions, is_cloud_file};

use super::scans;

/// Where a scan is.
#[derive(Debug, Clone)]
pub struct ScanFile {
    /// As given; `FILE#2` for the second scan of a file.
    pub path: PathBuf,
    /// The file, and the number of the scan in it, where it holds several.
    pub file: (PathBuf, Option<usize>),
    /// From the scanner's frame to that of the file, where the file has it.
    pub pose: Option<Rigid>,
}

impl ScanFile {
    /// A whole file, or `FILE#2`.
    pub fn of(path: &Path) -> Self {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let numbered = name.rsplit_once('#').and_then(|(file, number)| Some((file, number.parse().ok()?)));
        let file = match numbered {
            Some((file, number)) if !path.exists() => (path.with_file_name(file), Some(number)),
            _ => (path.to_owned(), None),
        };
        Self { path: path.to_owned(), file, pose: None }
    }
}

/// A file of several scans as each of them.
pub fn apart(path: PathBuf, options: &ReadOptions) -> Vec<ScanFile> {
    let whole = ScanFile::of(&path);
    if whole.file.1.is_some() {
        return vec![whole];
    }
    match scans::of_path(&path, options.clone()) {
        Some((_, entries)) => (1..)
            .zip(entries)
            .map(|(number, entry)| {
                let mut name = path.file_name().unwrap_or_default().to_owned();
                name.push(format!("#{number}"));
                ScanFile {
                    path: path.with_file_name(name),
                    file: (path.clone(), Some(number)),
                    pose: entry.pose,
                }
            })
            .collect(),
        None => vec![whole],
    }
}

/// The files of folders, by name; files as they are.
pub fn expanded(given: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut paths = Vec::new();
    for path in given {
        if files::is_stream(path) {
            return Err(Failure::usage("a scan is `-`: the scans of a map are files; name them".into()));
        }
        if !path.is_dir() {
            paths.push(path.clone());
            continue;
        }
        let unreadable = |e| Failure::usage(format!("cannot read the folder {path:?}: {e}"));
        let mut inside = Vec::new();
        for entry in std::fs::read_dir(path).map_err(unreadable)? {
            let entry = entry.map_err(unreadable)?.path();
            if entry.is_file() && is_cloud_file(&entry) {
                inside.push(entry);
            }
        }
        if inside.is_empty() {
            return Err(Failure::usage(format!(
                "the folder {path:?} holds no file whose extension names a format of clouds; name the files, or another folder"
            )));
        }
        inside.sort();
        paths.extend(inside);
    }
    Ok(paths)
}
