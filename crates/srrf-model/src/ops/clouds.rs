//! Batches of clouds on the host, and row numbers into tables of all their points.

use burn::tensor::Tensor;
use rayon::prelude::*;

use crate::ops::copy::{CopyError, to_host};

/// A batch of clouds copied to the host: shape `[batch, points, 3]`.
#[derive(Debug, Clone)]
pub struct HostClouds {
    points: Vec<[f32; 3]>,
    per_cloud: usize,
}

impl HostClouds {
    /// Clouds of `per_cloud` points, one after the other.
    pub fn new(points: Vec<[f32; 3]>, per_cloud: usize) -> Self {
        Self { points, per_cloud }
    }

    /// Points a cloud.
    pub fn per_cloud(&self) -> usize {
        self.per_cloud
    }

    /// The coordinates, point after point.
    pub fn flat(&self) -> &[f32] {
        self.points.as_flattened()
    }

    /// Copies `clouds`, shape `[batch, points, 3]`.
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give them.
    pub fn read(clouds: &Tensor<3>) -> Result<Self, CopyError> {
        let [_, per_cloud, _] = clouds.dims();
        let flat: Vec<f32> = to_host(clouds)?;
        let points = flat.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        Ok(Self { points, per_cloud })
    }

    /// The clouds one by one.
    pub fn iter(&self) -> impl Iterator<Item = &[[f32; 3]]> {
        self.points.chunks_exact(self.per_cloud.max(1))
    }

    /// The clouds at the rows `indices` (as [`flat_indices`] numbers them), `per_cloud` rows each.
    pub fn select(&self, indices: &[i64], per_cloud: usize) -> Self {
        Self { points: indices.iter().map(|&i| self.points[i as usize]).collect(), per_cloud }
    }
}

/// Row numbers into the flattened `[batch * points, channels]` table: `per_cloud(i)` gives the
/// indices inside cloud `i`, which are shifted by `i * support_points`. Clouds are worked on side by side.
pub fn flat_indices(
    clouds: &HostClouds,
    support_points: usize,
    per_cloud: impl Fn(usize, &[[f32; 3]]) -> Vec<u32> + Sync,
) -> Vec<i64> {
    let clouds: Vec<_> = clouds.iter().collect();
    let found: Vec<Vec<u32>> = clouds.par_iter().enumerate().map(|(i, cloud)| per_cloud(i, cloud)).collect();
    let shifted = |(i, rows): (usize, Vec<u32>)| {
        rows.into_iter().map(move |j| (i * support_points) as i64 + i64::from(j))
    };
    found.into_iter().enumerate().flat_map(shifted).collect()
}
