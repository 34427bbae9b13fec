//! Clusters: the nearest points of a random point, as all corruptions of density use them.

use rand::{Rng, RngExt};

use crate::card::REFERENCE_POINTS;

/// Fewest points for which the corruptions of density are defined: below, a cluster of `cutout`
/// rounds to less than one point.
pub const MIN_POINTS: usize = 32;

/// `density_inc` and `density_dec`: points of a cluster, the nearest of its centre, which counts.
pub const CLUSTER_POINTS: usize = 100;

/// `density_inc` and `density_dec`: number of clusters.
pub const CLUSTERS: [usize; 5] = [1, 2, 3, 4, 5];

/// A count that is stated for 1,024 points, in proportion to `points`; at least 1.
pub(super) fn scaled(count: usize, points: usize) -> usize {
    ((count * points + REFERENCE_POINTS / 2) / REFERENCE_POINTS).max(1)
}

/// Draws a centre uniformly from `pool` (indices into `points`) and moves its `size` nearest
/// members, the centre included, out of the pool. Both lists keep their order; a smaller pool is
/// emptied.
pub(super) fn take<R: Rng>(points: &[[f64; 3]], pool: &mut Vec<u32>, size: usize, rng: &mut R) -> Vec<u32> {
    if pool.is_empty() {
        return Vec::new();
    }
    let centre = points[pool[rng.random_range(0..pool.len())] as usize];
    let (near, far) = split_nearest(points, pool, &centre, size);
    *pool = far;
    near
}

/// The `size` members of `pool` (indices into `points`, each within its bounds) that are nearest
/// to `centre`, and the others; both in the order of the pool. Distances are Euclidean; equal
/// ones are decided by the index.
pub fn split_nearest(
    points: &[[f64; 3]],
    pool: &[u32],
    centre: &[f64; 3],
    size: usize,
) -> (Vec<u32>, Vec<u32>) {
    if size == 0 {
        return (Vec::new(), pool.to_vec());
    }
    if size >= pool.len() {
        return (pool.to_vec(), Vec::new());
    }
    // Numbers that are not negative are in the order of their bits.
    let squared = |&index: &u32| -> u64 {
        let p = &points[index as usize];
        (0..3).map(|c| (p[c] - centre[c]).powi(2)).sum::<f64>().to_bits()
    };
    let distances: Vec<u64> = pool.iter().map(squared).collect();
    let limit = *distances.clone().select_nth_unstable(size - 1).1;
    // Of those that are as far as the last one, the first by index.
    let nearer = distances.iter().filter(|d| **d < limit).count();
    let mut ties: Vec<u32> =
        pool.iter().zip(&distances).filter(|(_, d)| **d == limit).map(|(i, _)| *i).collect();
    ties.sort_unstable();
    let last = ties[size - 1 - nearer];
    let (mut near, mut far) = (Vec::with_capacity(size), Vec::with_capacity(pool.len() - size));
    for (&index, &distance) in pool.iter().zip(&distances) {
        if distance < limit || (distance == limit && index <= last) {
            near.push(index);
        } else {
            far.push(index);
        }
    }
    (near, far)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{SeedableRng, rngs::ChaCha8Rng};

    #[test]
    fn counts_follow_the_cloud() {
        assert_eq!([scaled(100, 1024), scaled(30, 1024), scaled(100, 512), scaled(30, 32)], [100, 30, 50, 1]);
        assert_eq!(scaled(75, 3), 1);
    }

    #[test]
    fn takes_the_nearest_of_those_that_are_left() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let points: Vec<[f64; 3]> = (0..57).map(|_| std::array::from_fn(|_| rng.random())).collect();
        let mut pool: Vec<u32> = (0..57).filter(|i| i % 5 != 0).collect();
        let before = pool.clone();
        let taken = take(&points, &mut pool, 11, &mut rng);
        assert_eq!(taken.len(), 11);
        let mut all = [taken.clone(), pool.clone()].concat();
        all.sort_unstable();
        assert_eq!(all, before);
        let distance = |a: u32, b: u32| {
            (0..3).map(|c| (points[a as usize][c] - points[b as usize][c]).powi(2)).sum::<f64>()
        };
        // One of the taken is the centre: all others taken are nearer to it than all others left.
        assert!(taken.iter().any(|&centre| {
            let reach = taken.iter().map(|&i| distance(centre, i)).fold(0.0, f64::max);
            pool.iter().all(|&i| distance(centre, i) >= reach)
        }));
    }

    #[test]
    fn a_small_pool_is_emptied() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut pool = vec![0, 1, 2];
        assert_eq!(take(&[[0.0; 3]; 3], &mut pool, 7, &mut rng), [0, 1, 2]);
        assert!(take(&[[0.0; 3]; 3], &mut pool, 7, &mut rng).is_empty());
        // Coinciding points: exactly as many as asked for are taken.
        let mut pool: Vec<u32> = (0..9).collect();
        assert_eq!(take(&[[0.0; 3]; 9], &mut pool, 4, &mut rng).len(), 4);
    }
}
