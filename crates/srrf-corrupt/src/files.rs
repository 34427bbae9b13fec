//! Files in and out.

use std::path::Path;

use srrf_cloud::PointCloud;
use srrf_cloud::io::{FORMATS, is_cloud_file, read_cloud, read_cloud_dropping_nan};

use crate::failure::Failure;

/// Reads a cloud; also says how many points with NaN were left out.
pub fn read(path: &Path, drop_nan: bool) -> Result<(PointCloud, usize), Failure> {
    let read =
        if drop_nan { read_cloud_dropping_nan(path) } else { read_cloud(path).map(|cloud| (cloud, 0)) };
    read.map_err(|e| Failure::Usage(e.to_string()))
}

/// Checks, before any work is done, that a cloud can be written to `path`.
pub fn check_cloud_output(path: &Path) -> Result<(), Failure> {
    if !is_cloud_file(path) {
        let known: Vec<&str> = FORMATS.iter().flat_map(|f| f.extensions()).copied().collect();
        return Err(Failure::Usage(format!(
            "cannot write {}: its extension names no known format; use one of {}",
            path.display(),
            known.join(", ")
        )));
    }
    check_folder(path)
}

/// Checks that the folder of `path` is there.
pub fn check_folder(path: &Path) -> Result<(), Failure> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => Err(Failure::Usage(format!(
            "cannot write {}: the folder {} does not exist; create it first",
            path.display(),
            folder.display()
        ))),
        _ => Ok(()),
    }
}
