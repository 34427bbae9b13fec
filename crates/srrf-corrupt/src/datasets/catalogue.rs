//! [`Catalogue`]: what a set of shapes says of itself, for every source in this crate.

use std::path::Path;

use rand::rngs::ChaCha8Rng;
use srrf_cloud::PointCloud;

use super::error::SourceError;
use super::source::{Label, SYMMETRIC_CLASSES, ShapeSource};

/// The shapes of a set by number: what each is called, and what is needed to sample it.
#[derive(Debug)]
pub(crate) struct Catalogue<T> {
    description: String,
    entries: Vec<Entry<T>>,
}

/// One shape of a set.
#[derive(Debug)]
pub(crate) struct Entry<T> {
    label: Label,
    /// What is needed to sample it.
    pub(crate) item: T,
}

impl<T> Entry<T> {
    /// Its symmetry is that of its class: one of [`SYMMETRIC_CLASSES`].
    pub(crate) fn new(id: String, class: String, item: T) -> Self {
        let symmetric = SYMMETRIC_CLASSES.contains(&class.as_str());
        Self { label: Label { id, class, symmetric }, item }
    }

    pub(crate) fn symmetric(mut self, symmetric: bool) -> Self {
        self.label.symmetric = symmetric;
        self
    }

    pub(crate) fn id(&self) -> &str {
        &self.label.id
    }
}

impl<T> Catalogue<T> {
    /// `entries` are not empty.
    pub(crate) fn new(description: String, entries: Vec<Entry<T>>) -> Self {
        Self { description, entries }
    }

    /// The shape of that number.
    ///
    /// # Errors
    /// [`SourceError::NoSuchShape`] beyond the last.
    pub(crate) fn get(&self, index: usize) -> Result<&Entry<T>, SourceError> {
        self.entries.get(index).ok_or(SourceError::NoSuchShape { index, len: self.entries.len() })
    }

    fn label(&self, index: usize) -> Option<&Label> {
        self.entries.get(index).map(|entry| &entry.label)
    }
}

/// A source with a [`Catalogue`], which says all but how shapes are sampled.
pub(crate) trait Listed: Send + Sync {
    /// What is needed to sample a shape.
    type Item: Send + Sync;

    fn catalogue(&self) -> &Catalogue<Self::Item>;

    /// [`ShapeSource::sample`] of a shape that exists.
    fn draw(
        &self,
        shape: &Entry<Self::Item>,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<PointCloud, SourceError>;

    /// [`ShapeSource::sample_two`] of a shape that exists.
    fn draw_two(
        &self,
        shape: &Entry<Self::Item>,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(PointCloud, PointCloud), SourceError>;
}

impl<L: Listed> ShapeSource for L {
    fn len(&self) -> usize {
        self.catalogue().entries.len()
    }

    fn description(&self) -> String {
        self.catalogue().description.clone()
    }

    fn id(&self, index: usize) -> String {
        self.catalogue().label(index).map(|label| label.id.clone()).unwrap_or_default()
    }

    fn class(&self, index: usize) -> &str {
        self.catalogue().label(index).map_or("", |label| &label.class)
    }

    fn is_symmetric(&self, index: usize) -> bool {
        self.catalogue().label(index).is_some_and(|label| label.symmetric)
    }

    fn sample(&self, index: usize, count: usize, rng: &mut ChaCha8Rng) -> Result<PointCloud, SourceError> {
        self.draw(self.catalogue().get(index)?, index, count, rng)
    }

    fn sample_two(
        &self,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(PointCloud, PointCloud), SourceError> {
        self.draw_two(self.catalogue().get(index)?, index, count, rng)
    }
}

/// A checked cloud of the shape called `shape` in `path`.
///
/// # Errors
/// [`SourceError::Shape`] where there are no points, or some that are not finite.
pub(crate) fn checked(
    points: Vec<[f64; 3]>,
    path: &Path,
    shape: impl ToString,
) -> Result<PointCloud, SourceError> {
    PointCloud::new(points).map_err(|source| SourceError::Shape {
        path: path.to_owned(),
        shape: shape.to_string(),
        source,
    })
}
