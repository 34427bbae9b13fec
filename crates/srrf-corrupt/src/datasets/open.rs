//! [`open`]: finds out what lies at a path.

use std::path::{Path, PathBuf};

use super::error::SourceError;
#[cfg(feature = "hdf5")]
use super::modelnet_hdf5;
use super::source::{ShapeSource, Split};
use super::{folder, modelnet_off, resampled_text};

/// Opens the shapes at `path`: a data set in one of the accepted layouts ([`ACCEPTED_LAYOUTS`](super::ACCEPTED_LAYOUTS)), a
/// folder that contains one, or a single file (all of whose shapes are taken, whatever the split).
///
/// ModelNet40's clouds and meshes come at mean 0 and radius 1; those of other files stay as they
/// are. Meshes and text are read from disk at each sampling, HDF5 once.
///
/// # Errors
/// [`SourceError::NotFound`] where there is nothing of the kind, others for damaged files.
pub fn open(path: &Path, split: Split) -> Result<Box<dyn ShapeSource>, SourceError> {
    if !path.exists() {
        return Err(SourceError::NotFound {
            path: path.to_owned(),
            looked: "the path does not exist".into(),
        });
    }
    for candidate in candidates(path)? {
        #[cfg(feature = "hdf5")]
        if modelnet_hdf5::detect(&candidate) {
            return Ok(Box::new(modelnet_hdf5::open(&candidate, split)?));
        }
        if resampled_text::detect(&candidate) {
            return Ok(Box::new(resampled_text::open(&candidate, split)?));
        }
        if modelnet_off::detect(&candidate) {
            return Ok(Box::new(modelnet_off::open(&candidate, split)?));
        }
    }
    if let Some(folder) = folder::open(path, split)? {
        return Ok(Box::new(folder));
    }
    let looked =
        "neither the path nor a folder in it has an accepted layout, and there are no files of clouds".into();
    Err(SourceError::NotFound { path: path.to_owned(), looked })
}

/// The path itself, then the folders in it by name.
fn candidates(path: &Path) -> Result<Vec<PathBuf>, SourceError> {
    let mut candidates = vec![path.to_owned()];
    if path.is_dir() {
        let entries = std::fs::read_dir(path).map_err(|e| SourceError::io(path, e))?;
        let mut folders: Vec<PathBuf> =
            entries.filter_map(|e| Some(e.ok()?.path())).filter(|p| p.is_dir()).collect();
        folders.sort();
        candidates.extend(folders);
    }
    Ok(candidates)
}

/// The path in the environment variable `SRRF_DATA`, if it is set and not empty.
pub fn default_data_path() -> Option<PathBuf> {
    std::env::var_os("SRRF_DATA").filter(|value| !value.is_empty()).map(PathBuf::from)
}
