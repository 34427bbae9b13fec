//! [`StoredClouds`]: shapes kept in memory as clouds whose points are in random order.

use std::path::PathBuf;

use rand::rngs::ChaCha8Rng;
use rand::seq::SliceRandom;
use srrf_cloud::PointCloud;

use super::catalogue::{Catalogue, Entry, Listed, checked};
use super::error::SourceError;

/// The points of one shape, `[n, 3]`, finite; single precision to halve the memory of a data set.
pub(super) type StoredPoints = Vec<[f32; 3]>;

/// Shapes kept in memory as clouds.
#[derive(Debug)]
pub(super) struct StoredClouds {
    pub(super) path: PathBuf,
    pub(super) clouds: Catalogue<StoredPoints>,
}

impl StoredClouds {
    fn cloud(&self, shape: &Entry<StoredPoints>, points: &[[f32; 3]]) -> Result<PointCloud, SourceError> {
        checked(points.iter().map(|p| p.map(f64::from)).collect(), &self.path, shape.id())
    }
}

impl Listed for StoredClouds {
    type Item = StoredPoints;

    fn catalogue(&self) -> &Catalogue<StoredPoints> {
        &self.clouds
    }

    /// The first `count` points, as DCP and its successors take them.
    fn draw(
        &self,
        shape: &Entry<StoredPoints>,
        _index: usize,
        count: usize,
        _rng: &mut ChaCha8Rng,
    ) -> Result<PointCloud, SourceError> {
        self.cloud(shape, &shape.item[..count.min(shape.item.len())])
    }

    /// Two disjoint random parts of the stored points; each at most half of them.
    fn draw_two(
        &self,
        shape: &Entry<StoredPoints>,
        _index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(PointCloud, PointCloud), SourceError> {
        let mut points = shape.item.clone();
        let each = count.min(points.len() / 2);
        let (drawn, _) = points.partial_shuffle(rng, 2 * each);
        let (first, second) = drawn.split_at(each);
        Ok((self.cloud(shape, first)?, self.cloud(shape, second)?))
    }
}
