//! Farthest point sampling.

use crate::neighbours::squared_distance;

/// Picks `count` of `points` so that each next one is the farthest from all picked before it,
/// beginning with the point at `start`; returns their indices in the order of picking.
///
/// `points` has shape `[n, 3]`. The indices are pairwise distinct, also where points coincide;
/// of equally far points the one with the lowest index is picked, so the result is deterministic.
/// `count > n` gives all `n` points, and a `start` beyond the last point counts as the last. Takes
/// O(n count) time. Distances that are NaN count as 0.
///
/// Source: Eldar et al., "The farthest point strategy for progressive image sampling", 1997, as used
/// by PointNet++.
pub fn farthest_point_sampling(points: &[[f64; 3]], count: usize, start: usize) -> Vec<usize> {
    let count = count.min(points.len());
    let mut picked = Vec::with_capacity(count);
    if count == 0 {
        return picked;
    }
    // Squared distance to the nearest picked point; -1 once picked.
    let mut distances = vec![f64::INFINITY; points.len()];
    let mut next = start.min(points.len() - 1);
    loop {
        picked.push(next);
        distances[next] = -1.0;
        if picked.len() == count {
            return picked;
        }
        let latest = points[next];
        let mut farthest = -1.0;
        for (i, (point, distance)) in points.iter().zip(&mut distances).enumerate() {
            if *distance < 0.0 {
                continue;
            }
            *distance = distance.min(squared_distance(point, &latest));
            // `max(0)` turns NaN into 0.
            if distance.max(0.0) > farthest {
                (farthest, next) = (distance.max(0.0), i);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn picks_the_ends_of_a_line_first() {
        let line: Vec<[f64; 3]> = (0..11).map(|i| [i as f64, 0.0, 0.0]).collect();
        assert_eq!(farthest_point_sampling(&line, 5, 3), [3, 10, 0, 6, 8]);
    }

    #[test]
    fn indices_are_distinct_and_bounded() {
        let points = vec![[1.0, 2.0, 3.0]; 40];
        let mut all = farthest_point_sampling(&points, 99, 1000);
        assert_eq!(all[..3], [39, 0, 1]);
        all.sort_unstable();
        assert_eq!(all, (0..40).collect::<Vec<_>>());
        assert!(farthest_point_sampling(&[], 5, 0).is_empty());
        assert!(farthest_point_sampling(&points, 0, 0).is_empty());
        assert_eq!(farthest_point_sampling(&[[f64::NAN; 3]; 3], 3, 1), [1, 0, 2]);
    }

    /// Every point lies within the last picking distance of a picked one.
    #[test]
    fn covers_the_cloud() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let points: Vec<[f64; 3]> =
            (0..501).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect();
        let picked = farthest_point_sampling(&points, 33, 7);
        let near = |p: &[f64; 3], set: &[usize]| {
            set.iter().map(|&i| squared_distance(p, &points[i])).fold(f64::INFINITY, f64::min)
        };
        let last = near(&points[picked[32]], &picked[..32]);
        assert!(points.iter().all(|p| near(p, &picked) <= last));
        assert!(last > 0.0);
    }
}
