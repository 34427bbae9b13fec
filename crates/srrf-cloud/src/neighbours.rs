//! [`KnnIndex`]: nearest neighbours in a cloud, by a k-d tree.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};

use crate::CloudError;

/// Relative widening of a radius query, so that rounding cannot lose a point at its very edge.
const EDGE: f64 = 1e-9;

/// Finds the points of a fixed cloud that are nearest to a query.
///
/// Clouds with repeated points and flat clouds are fine.
#[derive(Debug)]
pub struct KnnIndex {
    points: Vec<[f64; 3]>,
    /// `None` where the tree cannot be built (more points than `u32` can count): queries then
    /// look at every point.
    tree: Option<ImmutableKdTree<f64, 3>>,
}

impl KnnIndex {
    /// Builds the index over `points`, shape `[n, 3]`, in O(n log n).
    ///
    /// # Errors
    /// [`CloudError::Empty`] without points, [`CloudError::NotFinite`] at the first NaN or infinity.
    pub fn new(points: &[[f64; 3]]) -> Result<Self, CloudError> {
        if points.is_empty() {
            return Err(CloudError::Empty);
        }
        if let Some(index) = points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
            return Err(CloudError::NotFinite { index, point: points[index] });
        }
        Ok(Self { points: points.to_vec(), tree: ImmutableKdTree::new_from_slice(points).ok() })
    }

    /// Number of indexed points, at least 1.
    #[allow(clippy::len_without_is_empty, reason = "an index is never empty")]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// The indexed points, shape `[n, 3]`.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// Index of the point nearest to `query`, and the squared distance to it.
    ///
    /// Where several points are equally near it is one of them, always the same. A query that is
    /// not finite answers point 0 and NaN or infinity.
    pub fn nearest(&self, query: &[f64; 3]) -> (usize, f64) {
        match &self.tree {
            Some(tree) if query.iter().all(|c| c.is_finite()) => {
                let found = tree.query(query).nearest_one::<SquaredEuclidean<f64>>().execute();
                let index = found.item as usize;
                (index, squared_distance(&self.points[index], query))
            }
            _ => self.scan(query, 1).first().copied().unwrap_or((0, f64::NAN)),
        }
    }

    /// The `k` points nearest to `query` as `(index, squared distance)`, sorted by distance and,
    /// where distances are equal, by index. Fewer than `k` if the cloud is smaller.
    ///
    /// The answer does not depend on how the tree was built: of equally near points, those with
    /// the lowest indices are taken.
    pub fn k_nearest(&self, query: &[f64; 3], k: usize) -> Vec<(usize, f64)> {
        let k = k.min(self.len());
        let (Some(tree), Some(one_more), true) =
            (&self.tree, NonZero::new((k + 1).min(self.len())), query.iter().all(|c| c.is_finite()))
        else {
            return self.scan(query, k);
        };
        let found = tree.query(query).nearest_n::<SquaredEuclidean<f64>>(one_more).execute();
        let mut neighbours: Vec<(usize, f64)> =
            found.iter().map(|f| self.with_distance(f.item as usize, query)).collect();
        sort(&mut neighbours);
        // A tie across the k-th place: look at all that tie, to take the lowest indices.
        if k > 0 && neighbours.len() > k && neighbours[k].1 <= neighbours[k - 1].1 * (1.0 + EDGE) {
            let radius = neighbours[k].1 * (1.0 + EDGE);
            let tied = tree.query(query).within::<SquaredEuclidean<f64>>(radius).unsorted().execute();
            neighbours.clear();
            neighbours.extend(tied.iter().map(|f| self.with_distance(f.item as usize, query)));
            // Scans may hold thousands of points at the origin: sort only what is kept.
            if neighbours.len() > k {
                neighbours.select_nth_unstable_by(k, by_distance);
                neighbours.truncate(k);
            }
            sort(&mut neighbours);
        }
        neighbours.truncate(k);
        neighbours
    }

    /// The points within `radius` of `query` as `(index, squared distance)`, sorted as by
    /// [`KnnIndex::k_nearest`]; of more than `most`, the nearest `most`.
    pub fn within(&self, query: &[f64; 3], radius: f64, most: usize) -> Vec<(usize, f64)> {
        let limit = radius * radius;
        let mut found = match &self.tree {
            Some(tree) if query.iter().all(|c| c.is_finite()) && limit.is_finite() => {
                let near = tree.query(query).within::<SquaredEuclidean<f64>>(limit * (1.0 + EDGE));
                near.unsorted().execute().iter().map(|f| self.with_distance(f.item as usize, query)).collect()
            }
            _ => self.scan(query, self.len()),
        };
        found.retain(|n| n.1 <= limit);
        if found.len() > most && most > 0 {
            found.select_nth_unstable_by(most - 1, by_distance);
        }
        found.truncate(most);
        sort(&mut found);
        found
    }

    fn with_distance(&self, index: usize, query: &[f64; 3]) -> (usize, f64) {
        (index, squared_distance(&self.points[index], query))
    }

    fn scan(&self, query: &[f64; 3], k: usize) -> Vec<(usize, f64)> {
        let mut all: Vec<_> = (0..self.len()).map(|i| self.with_distance(i, query)).collect();
        sort(&mut all);
        all.truncate(k);
        all
    }
}

/// `|a - b|^2`.
pub(crate) fn squared_distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]) * (a[c] - b[c])).sum()
}

fn sort(neighbours: &mut [(usize, f64)]) {
    neighbours.sort_unstable_by(by_distance);
}

fn by_distance(a: &(usize, f64), b: &(usize, f64)) -> std::cmp::Ordering {
    a.1.total_cmp(&b.1).then(a.0.cmp(&b.0))
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// Compares every answer with a plain scan.
    fn check(points: &[[f64; 3]], queries: &[[f64; 3]]) {
        let index = KnnIndex::new(points).unwrap();
        assert!(index.tree.is_some(), "the tree could not be built over {} points", points.len());
        for query in queries {
            let expected = index.scan(query, points.len());
            assert_eq!(index.nearest(query).1, expected[0].1);
            for radius in [0.0, 0.2, 0.5, 3.0, f64::INFINITY] {
                let inside: Vec<_> = expected.iter().copied().filter(|n| n.1 <= radius * radius).collect();
                for most in [0, 1, 7, points.len()] {
                    let found = index.within(query, radius, most);
                    assert_eq!(found, inside[..most.min(inside.len())], "radius {radius}, most {most}");
                }
            }
            for k in [0, 1, 2, 5, 20, 33, 64, 200, points.len(), points.len() + 3] {
                assert_eq!(index.k_nearest(query, k), expected[..k.min(points.len())], "k = {k}");
            }
        }
    }

    fn random(n: usize, seed: u64) -> Vec<[f64; 3]> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..n).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect()
    }

    #[test]
    fn agrees_with_a_scan() {
        for n in [1, 2, 7, 31, 33, 65, 517, 2100] {
            check(&random(n, n as u64), &random(13, 99));
        }
    }

    /// Far more equal coordinates than a leaf of the tree holds.
    #[test]
    fn duplicates_planes_lines_and_grids() {
        let mut queries = random(9, 5);
        queries.push([0.25, 0.5, -0.75]);
        queries.push([0.0; 3]);
        let base = random(1000, 6);
        check(&vec![[0.25, 0.5, -0.75]; 1000], &queries);
        check(&[base.clone(), vec![[0.25, 0.5, -0.75]; 1000]].concat(), &queries);
        for flat in 0..3 {
            let plane = base.iter().map(|p| std::array::from_fn(|c| if c == flat { 0.5 } else { p[c] }));
            check(&plane.collect::<Vec<_>>(), &queries);
            let line = base.iter().map(|p| std::array::from_fn(|c| if c == flat { p[c] } else { -0.0 }));
            check(&line.collect::<Vec<_>>(), &queries);
        }
        let grid: Vec<[f64; 3]> =
            (0..1000).map(|i| [i % 10, i / 10 % 10, i / 100].map(|c| c as f64 / 4.0 - 1.0)).collect();
        check(&grid, &queries);
        check(&grid, &grid[..200]);
    }

    #[test]
    fn far_from_the_origin() {
        let shift = |p: &[f64; 3]| [p[0] + 5e5, p[1] - 4e6, p[2]];
        let points: Vec<_> = random(700, 8).iter().map(shift).collect();
        let queries: Vec<_> = random(20, 9).iter().map(shift).collect();
        check(&points, &queries);
    }

    #[test]
    fn refuses_what_is_not_a_cloud_and_survives_a_bad_query() {
        assert_eq!(KnnIndex::new(&[]).unwrap_err(), CloudError::Empty);
        let bad = KnnIndex::new(&[[0.0; 3], [f64::NAN, 0.0, 0.0]]);
        assert!(matches!(bad, Err(CloudError::NotFinite { index: 1, .. })));
        let index = KnnIndex::new(&random(50, 1)).unwrap();
        assert!(index.nearest(&[f64::NAN; 3]).1.is_nan());
        assert_eq!(index.k_nearest(&[f64::NAN; 3], 4).len(), 4);
    }
}
