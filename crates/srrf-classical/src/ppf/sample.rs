//! [`OrientedSample`]: thinned points with normals that have no sign.

use nalgebra::Vector3;
use rayon::prelude::*;
use srrf_cloud::{
    CloudError, KnnIndex, PointCloud, VoxelError, coarsen, least_direction, voxel_downsample_to,
};

/// Neighbours of which a normal is made: those within so many steps.
const AROUND: f64 = 1.0;
/// At least, and at most, so many.
const LEAST: usize = 8;
const MOST: usize = 60;

#[derive(Debug)]
pub(super) struct OrientedSample {
    /// Shape `[n, 3]`.
    pub points: Vec<[f64; 3]>,
    normals: Vec<Vector3<f64>>,
}

impl OrientedSample {
    /// Thins a cloud to voxels of side `step`, wider ones where more than `most` points are left.
    pub fn new(cloud: &PointCloud, step: f64, most: usize) -> Result<Self, CloudError> {
        let thin = |size| match voxel_downsample_to(cloud, size, most) {
            Err(VoxelError::TooFine { .. }) => Ok(None),
            other => other,
        };
        let (step, thinned) = coarsen(step, 1.2, thin).unwrap_or_else(|_| (step, cloud.clone()));
        let index = KnnIndex::new(cloud.points())?;
        let normal = |p: &[f64; 3]| {
            let mut near = index.within(p, AROUND * step, MOST);
            if near.len() < LEAST {
                near = index.k_nearest(p, LEAST);
            }
            least_direction(near.iter().map(|&(i, _)| &cloud.points()[i]))
        };
        let points = thinned.into_points();
        let normals = points.par_iter().map(normal).collect();
        Ok(Self { points, normals })
    }

    pub fn at(&self, i: usize) -> (Vector3<f64>, Vector3<f64>) {
        (self.points[i].into(), self.normals[i])
    }

    pub fn iter(&self) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> + '_ {
        (0..self.points.len()).map(|i| self.at(i))
    }

    pub fn centre(&self) -> [f64; 3] {
        let sum = self.points.iter().fold(Vector3::zeros(), |sum, p| sum + Vector3::from(*p));
        (sum / self.points.len() as f64).into()
    }
}
