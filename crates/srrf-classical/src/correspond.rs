//! Matches between two clouds by their descriptors.

use rayon::prelude::*;
use srrf_cloud::{RegisterError, VoxelError, coarsen};

use crate::fpfh::Descriptor;
use crate::fpfh_cloud::FpfhCloud;

/// Two thinned clouds and the matches between them.
pub(crate) struct Correspondences {
    /// Thinned source, shape `[n, 3]`.
    pub source: Vec<[f64; 3]>,
    /// Thinned target, shape `[m, 3]`.
    pub target: Vec<[f64; 3]>,
    /// Side of a voxel, unit of the clouds: the yardstick of all thresholds.
    pub voxel: f64,
    /// Pairs of indices `(source, target)`.
    pub pairs: Vec<(u32, u32)>,
}

/// Thins both clouds alike to at most `most_points`, describes and matches them.
///
/// The voxel is the point spacing of the sparser cloud (1.0 of it), or larger if that leaves more than
/// `most_points`; the radius of the features is `feature_voxels` of it. A pair of points is a match if each is the other's nearest
/// descriptor; where fewer than `least` are, every source point keeps its nearest.
pub(crate) fn correspond(
    source: &FpfhCloud<'_>,
    target: &FpfhCloud<'_>,
    most_points: usize,
    feature_voxels: f64,
    least: usize,
) -> Result<Correspondences, RegisterError> {
    let most = most_points.max(16);
    let (voxel, (source, target)) =
        coarsen(source.spacing().max(target.spacing()), 1.15, |voxel| -> Result<_, VoxelError> {
            let (source, target) = (source.thinned(voxel, most)?, target.thinned(voxel, most)?);
            Ok(source.zip(target))
        })
        .map_err(|e| RegisterError::NoPose(e.to_string()))?;
    let radius = feature_voxels * voxel;
    let a = source.described(radius).map_err(RegisterError::Source)?;
    let b = target.described(radius).map_err(RegisterError::Target)?;
    let forth = nearest_descriptors(&a, &b);
    let back = nearest_descriptors(&b, &a);
    let all = || forth.iter().enumerate().map(|(i, &j)| (i as u32, j));
    let mut pairs: Vec<(u32, u32)> = all().filter(|&(i, j)| back[j as usize] == i).collect();
    if pairs.len() < least {
        pairs = all().collect();
    }
    Ok(Correspondences { source: source.points.clone(), target: target.points.clone(), voxel, pairs })
}

/// For each of `a` the nearest of `b`, the lowest index of equals. By looking at all: in 33 dimensions
/// trees hardly prune, and a plain loop fills the vector units.
pub fn nearest_descriptors(a: &[Descriptor], b: &[Descriptor]) -> Vec<u32> {
    a.par_iter()
        .with_min_len(64)
        .map(|x| {
            let mut best = (f32::INFINITY, 0);
            for (j, y) in b.iter().enumerate() {
                let mut lanes = [0.0f32; 12];
                for block in 0..3 {
                    for (lane, sum) in lanes.iter_mut().enumerate() {
                        let d = x[block * 12 + lane] - y[block * 12 + lane];
                        *sum += d * d;
                    }
                }
                let distance: f32 = lanes.iter().sum();
                if distance < best.0 {
                    best = (distance, j as u32);
                }
            }
            best.1
        })
        .collect()
}
