//! Sets of shapes from which registration pairs are made.

use std::fmt;
use std::path::{Path, PathBuf};

use rand::rngs::ChaCha8Rng;

use srrf_cloud::PointCloud;

mod error;
mod folder;
#[cfg(feature = "hdf5")]
mod modelnet_hdf5;
mod modelnet_off;
mod resampled_text;
#[cfg(feature = "hdf5")]
mod stored;

pub use error::{ACCEPTED_LAYOUTS, SourceError};

/// The classes of ModelNet40 whose shapes are symmetric about an axis, so that no pose of them is
/// unique.
pub const SYMMETRIC_CLASSES: [&str; 8] =
    ["bottle", "bowl", "cone", "cup", "flower_pot", "lamp", "tent", "vase"];

/// Shapes that are held out for validation: `count` of `shapes`, evenly spread, in ascending order. At least one and at
/// most half of them.
pub fn held_out(shapes: usize, count: usize) -> Vec<usize> {
    let count = count.min(shapes / 2).max(1);
    let stride = shapes as f64 / count as f64;
    (0..count).map(|i| ((i as f64 + 0.5) * stride) as usize).collect()
}

/// A set of shapes from which registration pairs are made.
#[allow(clippy::len_without_is_empty, reason = "a source is never empty")]
pub trait ShapeSource: Send + Sync {
    /// Number of shapes, at least 1.
    fn len(&self) -> usize;

    /// One line: which data, which split, how many shapes.
    fn description(&self) -> String;

    /// Name of a shape, such as `airplane_0627`; empty beyond the last.
    fn id(&self, index: usize) -> String;

    /// Name of its category; empty if unknown.
    fn class(&self, index: usize) -> &str;

    /// Whether its class is symmetric about an axis: one of [`SYMMETRIC_CLASSES`].
    fn is_symmetric(&self, index: usize) -> bool {
        SYMMETRIC_CLASSES.contains(&self.class(index))
    }

    /// `count` points of its surface in its canonical frame; fewer if the source has fewer.
    ///
    /// Sets of stored clouds in random order give their first `count` points, whatever `rng`.
    ///
    /// # Errors
    /// [`SourceError`] if the shape cannot be read, has no points, or does not exist, and if
    /// `count` is 0.
    fn sample(&self, index: usize, count: usize, rng: &mut ChaCha8Rng) -> Result<PointCloud, SourceError>;

    /// Two samplings of one surface, in one frame, that share no point: two draws from a mesh or
    /// a procedural shape, two disjoint parts (each at most half) of a stored cloud.
    ///
    /// # Errors
    /// As [`ShapeSource::sample`]; a stored cloud of one point has no halves.
    fn sample_two(
        &self,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(PointCloud, PointCloud), SourceError>;
}

/// A part of a data set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Split {
    /// The shapes to learn from.
    Train,
    /// The shapes to measure on.
    Test,
}

impl fmt::Display for Split {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Train => "train",
            Self::Test => "test",
        })
    }
}

/// Opens the shapes at `path`: a data set in one of the accepted layouts ([`ACCEPTED_LAYOUTS`]), a
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

#[cfg(test)]
mod tests {
    use super::held_out;

    #[test]
    fn held_out_shapes_are_spread_and_never_more_than_half() {
        assert_eq!(held_out(12, 3), [2, 6, 10]);
        assert_eq!(held_out(5, 100), [1, 3]);
        assert_eq!(held_out(1, 0), [0]);
        let many = held_out(9843, 192);
        assert_eq!(many.len(), 192);
        assert!(many.windows(2).all(|pair| pair[1] - pair[0] >= 51), "{many:?}");
    }
}
