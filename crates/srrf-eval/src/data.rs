//! The shapes that an evaluation uses.

use std::path::{Path, PathBuf};

use srrf_corrupt::datasets::{self, ShapeSource, Split};
use srrf_corrupt::shapes::ProceduralShapes;

use crate::EvalError;

/// Seed of the procedural shapes that are scored. No model may be trained on shapes of this seed.
pub const TEST_SHAPES_SEED: u64 = 0x7E57_5EED;

/// Opens the test split of the data at `path`; without a path that of `$SRRF_DATA`; without
/// either, `shapes` procedural shapes of [`TEST_SHAPES_SEED`].
///
/// # Errors
/// [`EvalError::Data`] names the path, where it came from, what was looked for, and the command
/// that works without data.
pub fn open(path: Option<&Path>, shapes: usize) -> Result<Box<dyn ShapeSource>, EvalError> {
    let (path, origin): (PathBuf, _) = match (path, datasets::default_data_path()) {
        (Some(path), _) => (path.to_owned(), "The path was given by --data."),
        (None, Some(path)) => (path, "The path was given by the environment variable SRRF_DATA."),
        (None, None) => return procedural(shapes),
    };
    let named = |source| EvalError::Data { origin: origin.into(), source: Box::new(source) };
    datasets::open(&path, Split::Test).map_err(named)
}

/// `shapes` procedural shapes for scoring.
///
/// # Errors
/// [`EvalError::Shape`] if `shapes` is 0.
pub fn procedural(shapes: usize) -> Result<Box<dyn ShapeSource>, EvalError> {
    Ok(Box::new(ProceduralShapes::new(TEST_SHAPES_SEED, shapes, None)?))
}
