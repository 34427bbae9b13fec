//! Matches between two clouds by their descriptors.

use rayon::prelude::*;
use srrf_cloud::{RegisterError, VoxelError, coarsen};

use crate::consensus::Correspondences;
use crate::fpfh::{Descriptor, NeighbourChoice};
use crate::fpfh_cloud::FpfhCloud;

/// Features of more voxels than this need more neighbours than the nearest hundred.
const WIDE: f64 = 6.0;
/// Descriptors whose distances to all others are one task.
const PART: usize = 256;

/// Two thinned clouds and the matches between them.
pub(crate) struct FeatureMatches {
    /// Thinned source, shape `[n, 3]`.
    pub source: Vec<[f64; 3]>,
    /// Thinned target, shape `[m, 3]`.
    pub target: Vec<[f64; 3]>,
    /// Side of a voxel, unit of the clouds: the yardstick of all thresholds.
    pub voxel: f64,
    /// Pairs of indices `(source, target)`.
    pub pairs: Vec<(u32, u32)>,
    /// Every other source point with its nearest: mostly wrong.
    pub one_way: Vec<(u32, u32)>,
}

impl FeatureMatches {
    /// The matches, with those that hold in one direction only where `one_way`; the more likely first.
    pub fn correspondences(&self, one_way: bool) -> Result<Correspondences, RegisterError> {
        let more: &[(u32, u32)] = if one_way { &self.one_way } else { &[] };
        let all = || self.pairs.iter().chain(more);
        let source = all().map(|(i, _)| self.source[*i as usize]).collect();
        let target = all().map(|(_, j)| self.target[*j as usize]).collect();
        Correspondences::new(source, target).map_err(|e| RegisterError::NoPose(e.into()))
    }
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
) -> Result<FeatureMatches, RegisterError> {
    let most = most_points.max(16);
    let (voxel, (source, target)) =
        coarsen(source.spacing().max(target.spacing()), 1.15, |voxel| -> Result<_, VoxelError> {
            let (source, target) = (source.thinned(voxel, most)?, target.thinned(voxel, most)?);
            Ok(source.zip(target))
        })
        .map_err(|e| RegisterError::NoPose(e.into()))?;
    let radius = feature_voxels * voxel;
    let of = if feature_voxels > WIDE { NeighbourChoice::Throughout } else { NeighbourChoice::Nearest };
    let a = source.described(radius, of).map_err(RegisterError::Source)?;
    let b = target.described(radius, of).map_err(RegisterError::Target)?;
    let (forth, back) = nearest_both_ways(&a, &b);
    let all = || forth.iter().enumerate().map(|(i, &j)| (i as u32, j));
    let (mut pairs, mut one_way): (Vec<_>, Vec<_>) = all().partition(|&(i, j)| back[j as usize] == i);
    if pairs.len() < least {
        (pairs, one_way) = (all().collect(), Vec::new());
    }
    Ok(FeatureMatches { source: source.points.clone(), target: target.points.clone(), voxel, pairs, one_way })
}

/// For each of `a` the nearest of `b`, the lowest index of equals. By looking at all: in 33 dimensions
/// trees hardly prune, and a plain loop fills the vector units.
pub fn nearest_descriptors(a: &[Descriptor], b: &[Descriptor]) -> Vec<u32> {
    let nearest = |x: &Descriptor| {
        let mut best = (f32::INFINITY, 0);
        for (j, y) in b.iter().enumerate() {
            let distance = squared(x, y);
            if distance < best.0 {
                best = (distance, j as u32);
            }
        }
        best.1
    };
    a.par_iter().with_min_len(64).map(nearest).collect()
}

/// [`nearest_descriptors`] of both, each distance taken once.
fn nearest_both_ways(a: &[Descriptor], b: &[Descriptor]) -> (Vec<u32>, Vec<u32>) {
    let of_part = |(part, descriptors): (usize, &[Descriptor])| {
        let mut back = vec![(f32::INFINITY, 0); b.len()];
        let mut forth = Vec::with_capacity(descriptors.len());
        for (i, x) in (part * PART..).zip(descriptors) {
            let mut best = (f32::INFINITY, 0);
            for (j, (y, nearest)) in b.iter().zip(&mut back).enumerate() {
                let distance = squared(x, y);
                if distance < best.0 {
                    best = (distance, j as u32);
                }
                if distance < nearest.0 {
                    *nearest = (distance, i as u32);
                }
            }
            forth.push(best.1);
        }
        (forth, back)
    };
    let parts: Vec<_> = a.par_chunks(PART).enumerate().map(of_part).collect();
    let mut back = vec![(f32::INFINITY, 0); b.len()];
    let mut forth = Vec::with_capacity(a.len());
    for (part, of_part) in parts {
        forth.extend(part);
        for (nearest, found) in back.iter_mut().zip(of_part) {
            if found.0 < nearest.0 {
                *nearest = found;
            }
        }
    }
    (forth, back.into_iter().map(|(_, i)| i).collect())
}

/// Squared distance.
fn squared(x: &Descriptor, y: &Descriptor) -> f32 {
    let mut lanes = [0.0f32; 12];
    for block in 0..3 {
        for (lane, sum) in lanes.iter_mut().enumerate() {
            let d = x[block * 12 + lane] - y[block * 12 + lane];
            *sum += d * d;
        }
    }
    lanes.iter().sum()
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn both_ways_at_once_are_both_ways_one_by_one() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut some = |n: usize| -> Vec<Descriptor> {
            // Few values, so that many are equally near.
            (0..n).map(|_| std::array::from_fn(|_| f32::from(rng.random_range(0u8..2)))).collect()
        };
        let (a, b) = (some(2 * PART + 41), some(307));
        let (forth, back) = nearest_both_ways(&a, &b);
        assert_eq!((forth, back), (nearest_descriptors(&a, &b), nearest_descriptors(&b, &a)));
        assert_eq!(nearest_both_ways(&[], &b[..2]), (vec![], vec![0, 0]));
    }
}
