//! Thinning by a grid of voxels, and the spacing of a cloud.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use crate::{CloudError, KnnIndex, PointCloud};

/// Most voxels along an axis: three such numbers make one key.
const MOST_ALONG_AXIS: f64 = (1u64 << AXIS_BITS) as f64;
/// Bits of a voxel's place along an axis.
const AXIS_BITS: u32 = 42;
/// Steps of a voxel's side in which points are summed. Sums of whole numbers do not depend on their order.
const STEPS: f64 = (1u64 << 52) as f64;

/// Clouds up to this size are measured at every point.
const SPACING_SAMPLE: usize = 4096;

/// Why a cloud could not be thinned.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum VoxelError {
    /// The size is no length.
    #[error("the voxel size is {0}: it must be a finite length above 0")]
    Size(f64),
    /// The cloud spans more voxels than can be counted.
    #[error("voxels of {size} are too small for a cloud that spans {extent}: choose larger ones")]
    TooFine {
        /// The voxel size.
        size: f64,
        /// Longest side of the cloud's bounding box.
        extent: f64,
    },
}

/// The centroid of the points in each voxel of a grid with cubes of side `size` (unit of the
/// cloud), ordered by the voxel's place along x, then y, then z.
///
/// The grid starts at the cloud's lowest corner, so that a shifted cloud gives shifted centroids.
/// Sums are taken inside the voxels, which keeps the digits of clouds far from the origin, and in whole steps of `2^-52` sides,
/// so that the answer does not depend on the order of the points.
///
/// # Errors
/// [`VoxelError`] for a size that is not above 0, or far too small for the cloud.
pub fn voxel_downsample(cloud: &PointCloud, size: f64) -> Result<PointCloud, VoxelError> {
    let thinned = voxel_downsample_to(cloud, size, usize::MAX)?;
    // There are never more than so many.
    Ok(thinned.unwrap_or_else(|| cloud.clone()))
}

/// As [`voxel_downsample`]; `None` as soon as more than `most` voxels hold points, which takes far less time than thinning.
///
/// # Errors
/// As [`voxel_downsample`].
pub fn voxel_downsample_to(
    cloud: &PointCloud,
    size: f64,
    most: usize,
) -> Result<Option<PointCloud>, VoxelError> {
    if !size.is_finite() || size <= 0.0 {
        return Err(VoxelError::Size(size));
    }
    let points = cloud.points();
    let low: [f64; 3] = std::array::from_fn(|c| points.iter().map(|p| p[c]).fold(f64::INFINITY, f64::min));
    let extent = points.iter().flat_map(|p| (0..3).map(|c| p[c] - low[c])).fold(0.0, f64::max);
    if extent.is_nan() || extent / size >= MOST_ALONG_AXIS {
        return Err(VoxelError::TooFine { size, extent });
    }
    let mut voxels: HashMap<u128, VoxelSum, BuildHasherDefault<KeyHasher>> = HashMap::default();
    for p in points {
        let place: [f64; 3] = std::array::from_fn(|c| (p[c] - low[c]) / size);
        let whole = place.map(f64::floor);
        let key = whole.iter().fold(0, |key, w| (key << AXIS_BITS) | *w as u128);
        let voxel = voxels.entry(key).or_default();
        for c in 0..3 {
            voxel.steps[c] += i128::from(((place[c] - whole[c]) * STEPS) as i64);
        }
        voxel.count += 1;
        if voxels.len() > most {
            return Ok(None);
        }
    }
    let mut voxels: Vec<(u128, VoxelSum)> = voxels.into_iter().collect();
    voxels.sort_unstable_by_key(|(key, _)| *key);
    let centroid = |(key, sum): &(u128, VoxelSum)| -> [f64; 3] {
        std::array::from_fn(|c| {
            let whole = (key >> (AXIS_BITS * (2 - c as u32))) & ((1 << AXIS_BITS) - 1);
            let mean = sum.steps[c] as f64 / (f64::from(sum.count) * STEPS);
            (whole as f64 + mean) * size + low[c]
        })
    };
    // Means of finite points that lie within one voxel are finite, and there is at least one.
    let centroids = PointCloud::new(voxels.iter().map(centroid).collect());
    centroids.map(Some).map_err(|_| VoxelError::TooFine { size, extent })
}

/// The points of a voxel.
#[derive(Debug, Clone, Copy, Default)]
struct VoxelSum {
    /// Sum of their places in the voxel, in [`STEPS`] of its side.
    steps: [i128; 3],
    count: u32,
}

/// Spreads the keys of voxels, which come from no adversary: neighbours differ in few bits.
#[derive(Debug, Default)]
struct KeyHasher(u64);

impl Hasher for KeyHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|b| self.write_u64(u64::from(*b)));
    }

    fn write_u64(&mut self, value: u64) {
        // A round of splitmix64 (Steele, Lea and Flood 2014).
        let mixed = (self.0 ^ value).wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        self.0 = mixed ^ (mixed >> 31);
    }

    fn write_u128(&mut self, value: u128) {
        self.write_u64(value as u64);
        self.write_u64((value >> 64) as u64);
    }
}

/// The cloud itself if it has at most `most` points, or the centroids of the smallest voxels that leave no more; sizes grow
/// in steps of a quarter from the one at which a surface of this `radius` would have that many voxels.
///
/// Where lengths cannot be computed from the coordinates (beyond 1e150, say), it is the cloud itself.
pub fn thin_to(cloud: &PointCloud, most: usize, radius: f64) -> PointCloud {
    if cloud.len() <= most {
        return cloud.clone();
    }
    // A surface of this radius has about 4 pi (radius / size)^2 voxels.
    thin_from(cloud, most, radius * (4.0 / most as f64).sqrt(), 1.25).1
}

/// The centroids of the first of the voxels of side `first`, `first * growth`, ... that leave at most `most` points, after that side.
///
/// Where lengths cannot be computed from the coordinates (beyond 1e150, say), it is the cloud itself, after `first`.
pub fn thin_from(cloud: &PointCloud, most: usize, first: f64, growth: f64) -> (f64, PointCloud) {
    let thin = |size| match voxel_downsample_to(cloud, size, most) {
        Err(VoxelError::TooFine { .. }) => Ok(None),
        other => other,
    };
    coarsen(first, growth, thin).unwrap_or_else(|_| (first, cloud.clone()))
}

/// The first of the sizes `first`, `first * growth`, ... for which `thin` has an answer, and the answer.
///
/// # Errors
/// The first error of `thin`. It must have an answer for large sizes: one huge voxel holds every cloud.
pub fn coarsen<T, E>(
    first: f64,
    growth: f64,
    mut thin: impl FnMut(f64) -> Result<Option<T>, E>,
) -> Result<(f64, T), E> {
    let mut size = first;
    loop {
        if let Some(thinned) = thin(size)? {
            return Ok((size, thinned));
        }
        size *= growth;
    }
}

/// Median distance from a point to the nearest point that does not coincide with it, unit of the
/// points; 0 where all points coincide.
///
/// Up to 4,096 points every point is asked, of more every n-th. Points that coincide with 8 or more
/// others have no say.
///
/// # Errors
/// [`CloudError::Empty`] without points, [`CloudError::NotFinite`] at the first NaN or infinity.
pub fn point_spacing(points: &[[f64; 3]]) -> Result<f64, CloudError> {
    Ok(spacing_of(&KnnIndex::new(points)?))
}

/// [`point_spacing`] of points that are indexed already.
pub fn spacing_of(index: &KnnIndex) -> f64 {
    let step = index.len().div_ceil(SPACING_SAMPLE);
    let nearest = |p: &[f64; 3]| {
        // The first neighbour is the point itself; a second is nearly always enough.
        let distinct = |k| index.k_nearest(p, k).into_iter().find(|n| n.1 > 0.0).map(|n| n.1);
        distinct(2).or_else(|| distinct(9))
    };
    let sample: Vec<&[f64; 3]> = index.points().iter().step_by(step).collect();
    let mut squared: Vec<f64> = sample.iter().filter_map(|p| nearest(p)).collect();
    if squared.is_empty() {
        return 0.0;
    }
    let middle = squared.len() / 2;
    squared.select_nth_unstable_by(middle, f64::total_cmp).1.sqrt()
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    use nalgebra::Vector3;

    use super::*;

    fn cloud(n: usize) -> PointCloud {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        PointCloud::new((0..n).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect())
            .unwrap()
    }

    #[test]
    fn one_centroid_for_each_voxel() {
        let points = vec![[0.0, 0.0, 0.0], [2.5, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, 0.0, 1.5]];
        let thin = voxel_downsample(&PointCloud::new(points).unwrap(), 1.0).unwrap();
        assert_eq!(thin.points(), [[0.25, 0.25, 0.0], [0.0, 0.0, 1.5], [2.5, 0.0, 0.0]]);
    }

    #[test]
    fn order_does_not_matter_and_weights_are_kept() {
        let cloud = cloud(701);
        let reversed = PointCloud::new(cloud.points().iter().rev().copied().collect()).unwrap();
        let thin = voxel_downsample(&cloud, 0.3).unwrap();
        assert_eq!(thin, voxel_downsample(&reversed, 0.3).unwrap());
        assert!(thin.len() > 100 && thin.len() < 400);
        assert_eq!(voxel_downsample(&cloud, 50.0).unwrap().len(), 1);
        let count = thin.len();
        assert_eq!(voxel_downsample_to(&cloud, 0.3, count), Ok(Some(thin)));
        assert_eq!(voxel_downsample_to(&cloud, 0.3, count - 1), Ok(None));
        let whole = voxel_downsample(&cloud, 50.0).unwrap().points()[0];
        assert!((Vector3::from(whole) - cloud.centroid()).norm() < 1e-12);
    }

    #[test]
    fn thins_to_a_number_of_points_and_no_more() {
        let cloud = cloud(2003);
        assert_eq!(thin_to(&cloud, 2003, 1.0), cloud);
        let thin = thin_to(&cloud, 500, 1.0);
        assert!((200..=500).contains(&thin.len()), "{}", thin.len());
        assert_eq!(thin_to(&cloud, 1, 1.0).len(), 1);
        // Beyond what lengths can be computed from, and no loop without end.
        for radius in [0.0, f64::INFINITY, f64::NAN] {
            assert_eq!(thin_to(&cloud, 500, radius), cloud);
        }
    }

    #[test]
    fn far_from_the_origin() {
        let far = |p: &[f64; 3]| [p[0] + 4e6, p[1] - 5e5, p[2]];
        let near = cloud(503);
        let moved = PointCloud::new(near.points().iter().map(far).collect()).unwrap();
        let (a, b) = (voxel_downsample(&near, 0.25).unwrap(), voxel_downsample(&moved, 0.25).unwrap());
        assert_eq!(a.len(), b.len());
        for (p, q) in a.points().iter().zip(b.points()) {
            assert!((Vector3::from(far(p)) - Vector3::from(*q)).norm() < 1e-8);
        }
    }

    #[test]
    fn refuses_sizes_that_make_no_sense() {
        for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(voxel_downsample(&cloud(5), size), Err(VoxelError::Size(_))));
        }
        assert!(matches!(voxel_downsample(&cloud(5), 1e-20), Err(VoxelError::TooFine { .. })));
        let huge = PointCloud::new(vec![[-1e308; 3], [1e308; 3]]).unwrap();
        assert!(voxel_downsample(&huge, 1.0).is_err());
    }

    #[test]
    fn spacing_of_a_grid_with_repeats() {
        let grid: Vec<[f64; 3]> =
            (0..400).map(|i| [0.5 * f64::from(i % 20), 0.5 * f64::from(i / 20), 7.0]).collect();
        assert!((point_spacing(&grid).unwrap() - 0.5).abs() < 1e-12);
        let repeated = [grid.clone(), grid.clone(), vec![[3.0; 3]; 50]].concat();
        assert!((point_spacing(&repeated).unwrap() - 0.5).abs() < 1e-12);
        assert_eq!(point_spacing(&[[1.0; 3]; 30]).unwrap(), 0.0);
        assert_eq!(point_spacing(&[]), Err(CloudError::Empty));
    }
}
