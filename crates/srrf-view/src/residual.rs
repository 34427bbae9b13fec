//! How far the source lies from the target under a pose.

use rayon::prelude::*;
use serde::Serialize;
use srrf_cloud::{KnnIndex, Rigid};

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
    /// The distances of `points`, moved by `pose`, to the points of `target`. In parallel; the
    /// answer does not depend on the number of threads.
    pub(crate) fn new(target: &KnnIndex, points: &[[f64; 3]], pose: &Rigid) -> Self {
        let values: Vec<f64> = points.par_iter().map(|p| target.nearest(&pose.apply(p)).1.sqrt()).collect();
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
        let target = KnnIndex::new(&[[10.0, 0.0, 0.0]]).unwrap();
        let points: Vec<[f64; 3]> = (0..20).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        let mut pose = Rigid::identity();
        pose.translation.x = 10.0;
        let residuals = Residuals::new(&target, &points, &pose);
        assert_eq!(residuals.values[7], 7.0);
        assert_eq!(residuals.summary, ResidualSummary { median: 9.0, p90: 17.0 });
        assert_eq!(quantile(&[], 0.5), 0.0);
        assert_eq!(quantile(&[4.0], 0.9), 4.0);
    }
}
