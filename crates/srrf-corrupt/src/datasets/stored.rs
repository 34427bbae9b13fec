//! [`StoredClouds`]: shapes kept in memory as clouds whose points are in random order.

use std::path::PathBuf;

use rand::rngs::ChaCha8Rng;
use rand::seq::SliceRandom;

use super::{ShapeSource, SourceError};
use srrf_cloud::PointCloud;

/// One shape in memory.
#[derive(Debug, Clone)]
pub(crate) struct StoredCloud {
    pub id: String,
    pub class: String,
    /// Shape `[n, 3]`, finite, single precision to halve the memory of a data set.
    pub points: Vec<[f32; 3]>,
}

/// Shapes kept in memory as clouds.
#[derive(Debug)]
pub(crate) struct StoredClouds {
    pub description: String,
    pub path: PathBuf,
    /// Never empty.
    pub clouds: Vec<StoredCloud>,
}

impl StoredClouds {
    fn get(&self, index: usize) -> Result<&StoredCloud, SourceError> {
        self.clouds.get(index).ok_or(SourceError::NoSuchShape { index, len: self.clouds.len() })
    }

    fn cloud(&self, index: usize, points: impl Iterator<Item = [f32; 3]>) -> Result<PointCloud, SourceError> {
        PointCloud::new(points.map(|p| p.map(f64::from)).collect()).map_err(|source| SourceError::Shape {
            path: self.path.clone(),
            shape: self.id(index),
            source,
        })
    }
}

impl ShapeSource for StoredClouds {
    fn len(&self) -> usize {
        self.clouds.len()
    }

    fn description(&self) -> String {
        self.description.clone()
    }

    fn id(&self, index: usize) -> String {
        self.clouds.get(index).map(|c| c.id.clone()).unwrap_or_default()
    }

    fn class(&self, index: usize) -> &str {
        self.clouds.get(index).map_or("", |c| &c.class)
    }

    /// The first `count` points, as DCP and its successors take them.
    fn sample(&self, index: usize, count: usize, _rng: &mut ChaCha8Rng) -> Result<PointCloud, SourceError> {
        self.cloud(index, self.get(index)?.points.iter().take(count).copied())
    }

    /// Two disjoint random parts of the stored points; each at most half of them.
    fn sample_two(
        &self,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(PointCloud, PointCloud), SourceError> {
        let mut points = self.get(index)?.points.clone();
        let each = count.min(points.len() / 2);
        let (drawn, _) = points.partial_shuffle(rng, 2 * each);
        let mut drawn = drawn.iter().copied();
        Ok((self.cloud(index, drawn.by_ref().take(each))?, self.cloud(index, drawn)?))
    }
}
