//! How far the source lies from the target under a pose.

use rayon::prelude::*;
use serde::Serialize;
use srrf_cloud::{CloudError, KnnIndex, PointCloud, Rigid};

/// Targets of more points than this have a limit beyond which distances are not told apart. Without
/// it, a page of 2 million points took over a minute of computing for a pose that is off by a third
/// of the object: far queries look at much of the tree.
const EXACT_POINTS: usize = 10_000;

/// That limit, as a share of half the diagonal of the target's bounding box.
const LIMIT: f64 = 0.1;

/// Distances to the nearest point of a target.
#[derive(Debug)]
pub(crate) struct Distances {
    index: KnnIndex,
    guard: Option<Guard>,
}

/// Tells cheaply that a point is beyond the limit.
#[derive(Debug)]
struct Guard {
    limit: f64,
    low: [f64; 3],
    high: [f64; 3],
    /// A few points of the target, such that each other one is within `cover` of one of them.
    coarse: KnnIndex,
    cover: f64,
}

impl Distances {
    pub(crate) fn new(target: &PointCloud) -> Result<Self, CloudError> {
        let points = target.points();
        let guard = if points.len() > EXACT_POINTS { Guard::new(points)? } else { None };
        Ok(Self { index: KnnIndex::new(points)?, guard })
    }

    /// Distances of this and more are all answered as this.
    pub(crate) fn limit(&self) -> Option<f64> {
        self.guard.as_ref().map(|guard| guard.limit)
    }

    fn to(&self, point: &[f64; 3]) -> f64 {
        match &self.guard {
            Some(guard) if guard.is_beyond(point) => guard.limit,
            Some(guard) => self.index.nearest(point).1.sqrt().min(guard.limit),
            None => self.index.nearest(point).1.sqrt(),
        }
    }
}

impl Guard {
    /// `None` for targets without extent.
    fn new(points: &[[f64; 3]]) -> Result<Option<Self>, CloudError> {
        let corner = |pick: fn(f64, f64) -> f64, start| -> [f64; 3] {
            points.iter().fold([start; 3], |c, p| std::array::from_fn(|axis| pick(c[axis], p[axis])))
        };
        let (low, high) = (corner(f64::min, f64::INFINITY), corner(f64::max, f64::NEG_INFINITY));
        let diagonal = (0..3).map(|axis| (high[axis] - low[axis]).powi(2)).sum::<f64>().sqrt();
        let limit = LIMIT * diagonal / 2.0;
        if !(limit > 0.0 && limit.is_finite()) {
            return Ok(None);
        }
        // The first point in each cell of a grid; the diagonal of a cell is `cover`. At most
        // 2 sqrt(3) / LIMIT = 70 cells to an edge of the box.
        let cover = limit / 2.0;
        let cell = |p: &[f64; 3], axis: usize| ((p[axis] - low[axis]) / (cover / 3f64.sqrt())) as usize;
        let size: [usize; 3] = std::array::from_fn(|axis| cell(&high, axis) + 1);
        let mut taken = vec![false; size.iter().product()];
        let mut coarse = Vec::new();
        for p in points {
            let slot = (cell(p, 0) * size[1] + cell(p, 1)) * size[2] + cell(p, 2);
            if !std::mem::replace(&mut taken[slot], true) {
                coarse.push(*p);
            }
        }
        Ok(Some(Self { limit, low, high, coarse: KnnIndex::new(&coarse)?, cover }))
    }

    fn is_beyond(&self, p: &[f64; 3]) -> bool {
        let outside = |axis: usize| (self.low[axis] - p[axis]).max(p[axis] - self.high[axis]).max(0.0);
        let from_box = (0..3).map(|axis| outside(axis).powi(2)).sum::<f64>().sqrt();
        from_box > self.limit || self.coarse.nearest(p).1.sqrt() - self.cover > self.limit
    }
}

/// Distances from source points to the nearest target point.
#[derive(Debug, Clone)]
pub(crate) struct Residuals {
    /// One for each drawn source point, in the unit of the clouds.
    pub values: Vec<f64>,
    /// Their summary.
    pub summary: ResidualSummary,
}

/// Order statistics of the distances, in the unit of the clouds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct ResidualSummary {
    /// Half of the points are nearer than this.
    pub median: f64,
    /// Nine points in ten are nearer than this.
    pub p90: f64,
}

impl Residuals {
    /// The distances of `points`, moved by `pose`. In parallel; the answer does not depend on the
    /// number of threads.
    pub(crate) fn new(target: &Distances, points: &[[f64; 3]], pose: &Rigid) -> Self {
        let values: Vec<f64> = points.par_iter().map(|p| target.to(&pose.apply(p))).collect();
        let mut sorted = values.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let summary = ResidualSummary { median: quantile(&sorted, 0.5), p90: quantile(&sorted, 0.9) };
        Self { values, summary }
    }
}

/// The smallest value that at least the share `q` does not exceed; 0 of nothing.
fn quantile(sorted: &[f64], q: f64) -> f64 {
    let rank = (q * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_and_their_summary() {
        let target = Distances::new(&PointCloud::new(vec![[10.0, 0.0, 0.0]]).unwrap()).unwrap();
        let points: Vec<[f64; 3]> = (0..20).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        let mut pose = Rigid::identity();
        pose.translation.x = 10.0;
        let residuals = Residuals::new(&target, &points, &pose);
        assert_eq!(residuals.values[7], 7.0);
        assert_eq!(residuals.summary, ResidualSummary { median: 9.0, p90: 17.0 });
        assert_eq!(target.limit(), None);
        assert_eq!(quantile(&[], 0.5), 0.0);
        assert_eq!(quantile(&[4.0], 0.9), 4.0);
    }

    #[test]
    fn below_the_limit_the_distances_are_exact_above_it_they_are_the_limit() {
        // A sphere far from the origin and some points within.
        let points: Vec<[f64; 3]> = (0..EXACT_POINTS + 7)
            .map(|i| {
                let (a, b) = (0.618 * i as f64, (0.271 * i as f64).sin().asin());
                let r = if i % 97 == 0 { 0.4 } else { 1.0 };
                [5e5 + r * b.cos() * a.cos(), r * b.cos() * a.sin(), 3.0 * r * b.sin()]
            })
            .collect();
        let exact = KnnIndex::new(&points).unwrap();
        let target = Distances::new(&PointCloud::new(points).unwrap()).unwrap();
        let limit = target.limit().unwrap();
        assert!(target.guard.as_ref().unwrap().coarse.len() < EXACT_POINTS / 2);
        let (mut near, mut far) = (0, 0);
        for i in 0..3001 {
            let s = f64::from(i);
            let p = [5e5 + 2.0 * s.sin(), 1.7 * (1.3 * s).cos(), 4.0 * (0.7 * s).sin()];
            let expected = exact.nearest(&p).1.sqrt();
            assert_eq!(target.to(&p), expected.min(limit));
            if expected < limit { near += 1 } else { far += 1 }
        }
        assert!(near > 100 && far > 100, "{near} near, {far} far");
        assert_eq!(target.to(&[0.0; 3]), limit);
    }

    #[test]
    fn a_large_target_without_extent() {
        let target = Distances::new(&PointCloud::new(vec![[2.0; 3]; EXACT_POINTS + 1]).unwrap()).unwrap();
        assert_eq!(target.to(&[2.0, 2.0, 5.0]), 3.0);
    }
}
