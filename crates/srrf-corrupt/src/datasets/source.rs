//! [`ShapeSource`]: the seam of every set of shapes.

use std::fmt;

use rand::rngs::ChaCha8Rng;
use srrf_cloud::PointCloud;

use super::error::SourceError;

/// The classes of ModelNet40 whose shapes are symmetric about an axis, so that no pose of them is
/// unique.
pub const SYMMETRIC_CLASSES: [&str; 8] =
    ["bottle", "bowl", "cone", "cup", "flower_pot", "lamp", "tent", "vase"];

/// What a shape is called.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Label {
    /// Name of the shape.
    pub id: String,
    /// Name of its category.
    pub class: String,
    /// Whether the category is symmetric about an axis.
    pub symmetric: bool,
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

    /// Name, category and symmetry of a shape.
    fn label(&self, index: usize) -> Label {
        Label { id: self.id(index), class: self.class(index).to_owned(), symmetric: self.is_symmetric(index) }
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
