//! [`OrientedSample`]: thinned points with normals that have no sign.

use nalgebra::Vector3;
use rayon::prelude::*;
use srrf_cloud::{CloudError, KnnIndex, PointCloud, least_direction, thin_from};

/// Neighbours of which a normal is made: those within so many steps.
const AROUND: f64 = 1.0;
/// At least, and at most, so many.
const LEAST: usize = 8;
const MOST: usize = 60;

#[derive(Debug)]
pub(super) struct OrientedSample {
    pub cloud: PointCloud,
    normals: Vec<Vector3<f64>>,
}

impl OrientedSample {
    /// Thins a cloud to voxels of side `step`, wider ones where more than `most` points are left.
    ///
    /// # Errors
    /// Those of [`KnnIndex::new`], of which clouds have none.
    pub fn new(cloud: &PointCloud, step: f64, most: usize) -> Result<Self, CloudError> {
        let (step, thinned) = thin_from(cloud, most, step, 1.2);
        let index = KnnIndex::new(cloud.points())?;
        let normal = |p: &[f64; 3]| {
            let mut near = index.within(p, AROUND * step, MOST);
            if near.len() < LEAST {
                near = index.k_nearest(p, LEAST);
            }
            least_direction(near.iter().map(|&(i, _)| &cloud.points()[i]))
        };
        let normals = thinned.points().par_iter().map(normal).collect();
        Ok(Self { cloud: thinned, normals })
    }

    pub fn at(&self, i: usize) -> (Vector3<f64>, Vector3<f64>) {
        (self.cloud.points()[i].into(), self.normals[i])
    }

    pub fn iter(&self) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> + '_ {
        (0..self.cloud.len()).map(|i| self.at(i))
    }
}
