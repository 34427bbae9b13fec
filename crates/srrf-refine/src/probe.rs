//! [`Probe`]: which shares of two clouds lie on each other under a pose, at several distances, looked up on few points.

use nalgebra::Vector3;
use rayon::prelude::*;
use srrf_cloud::Rigid;

use crate::prepared::{CloudLevel, RefineCloud};

/// Distances at which points count as lying on the other cloud, in point spacings of that cloud.
pub(crate) const SCALES: [f64; 7] = [2.0, 1.0, 0.5, 0.25, 0.12, 0.06, 0.03];
/// Place of 1 in [`SCALES`].
pub(crate) const ONE_SPACING: usize = 1;
/// Points of each cloud that are asked.
const ASKED: usize = 512;

/// Points farther away than the largest of [`SCALES`] whose match lies aside, not along its normal by at least this share, are beside
/// the edge.
const ASIDE: f64 = 0.5;

/// Shares of the source's points on the target, and of the target's on the source, for each of [`SCALES`].
pub(crate) type Shares = [[f64; SCALES.len()]; 2];

/// A pair whose poses are looked at many times. Poses are between the centred clouds.
pub(crate) struct Probe<'a> {
    pub source: &'a CloudLevel,
    pub target: &'a CloudLevel,
    asked: [Vec<[f64; 3]>; 2],
}

impl<'a> Probe<'a> {
    pub fn new(source: &'a RefineCloud, target: &'a RefineCloud) -> Self {
        let (source, target) = (source.coarse(), target.coarse());
        let asked = [source, target].map(|level| {
            let stride = level.points().len().div_ceil(ASKED);
            level.points().iter().step_by(stride).copied().collect()
        });
        Self { source, target, asked }
    }

    /// Points that are asked, of each cloud.
    pub fn asked(&self) -> [&[[f64; 3]]; 2] {
        [&self.asked[0], &self.asked[1]]
    }

    /// Spacing of the cloud that points of each side are laid on.
    pub fn spacings(&self) -> [f64; 2] {
        [self.target.spacing, self.source.spacing]
    }

    /// For each asked point of both sides: the number of the nearest point of the other cloud, and the distance to it in
    /// spacings of that cloud.
    pub fn distances(&self, pose: &Rigid) -> [Vec<(usize, f64)>; 2] {
        let inverse = pose.inverse();
        let one = |points: &[[f64; 3]], to: &CloudLevel, pose: &Rigid| {
            let nearest = |p: &[f64; 3]| {
                let (number, squared) = to.index.nearest(&pose.apply(p));
                (number, squared.sqrt() / to.spacing)
            };
            points.iter().map(nearest).collect()
        };
        [one(&self.asked[0], self.target, pose), one(&self.asked[1], self.source, &inverse)]
    }

    /// The shares under a pose.
    pub fn shares(&self, pose: &Rigid) -> Shares {
        self.distances(pose).map(|side| {
            let n = side.len() as f64;
            SCALES.map(|scale| side.iter().filter(|(_, d)| *d <= scale).count() as f64 / n)
        })
    }

    /// The shares under a pose of those points that have another surface beside them: what lies beside the edge of the other cloud says
    /// nothing, since that cloud may end there by chance. And which share of the points of each side that is.
    pub fn shares_within(&self, pose: &Rigid) -> (Shares, [f64; 2]) {
        let inverse = pose.inverse();
        let mut within = [0.0; 2];
        let sides = [(&self.asked[0], self.target, pose), (&self.asked[1], self.source, &inverse)];
        let shares = std::array::from_fn(|side| {
            let (points, level, pose) = sides[side];
            let distance = |p: &[f64; 3]| {
                let moved = pose.apply(p);
                let (number, squared) = level.index.nearest(&moved);
                let apart = Vector3::from(moved) - Vector3::from(level.index.points()[number]);
                let beside = apart.dot(&level.normals[number]).abs() < ASIDE * apart.norm();
                let distance = squared.sqrt() / level.spacing;
                (distance <= SCALES[0] || !beside).then_some(distance)
            };
            let distances: Vec<f64> = points.iter().filter_map(distance).collect();
            within[side] = distances.len() as f64 / points.len() as f64;
            let n = distances.len().max(1) as f64;
            SCALES.map(|scale| distances.iter().filter(|d| **d <= scale).count() as f64 / n)
        });
        (shares, within)
    }

    /// The mean shares over several poses.
    pub fn mean_shares(&self, poses: &[Rigid]) -> Shares {
        let all: Vec<Shares> = poses.par_iter().map(|pose| self.shares(pose)).collect();
        let mean = |side: usize, scale: usize| {
            all.iter().map(|shares| shares[side][scale]).sum::<f64>() / all.len().max(1) as f64
        };
        std::array::from_fn(|side| std::array::from_fn(|scale| mean(side, scale)))
    }

    /// Different points of the other cloud that the asked ones of each side have as their nearest: what lies on one and the same
    /// point counts once.
    pub fn partners(&self, pose: &Rigid) -> [usize; 2] {
        self.distances(pose).map(|side| {
            let mut numbers: Vec<usize> = side.into_iter().map(|(number, _)| number).collect();
            numbers.sort_unstable();
            numbers.dedup();
            numbers.len()
        })
    }

    /// Mean of the asked source points that lie within two spacings of the target, in the target's frame, and their root mean
    /// square distance from it; of all, where there are fewer than three.
    pub fn overlap(&self, pose: &Rigid) -> (Vector3<f64>, f64) {
        let [from_source, _] = self.distances(pose);
        let moved = self.asked[0].iter().map(|p| Vector3::from(pose.apply(p)));
        let near: Vec<Vector3<f64>> =
            moved.clone().zip(&from_source).filter(|(_, (_, d))| *d <= SCALES[0]).map(|(p, _)| p).collect();
        let points = if near.len() < 3 { moved.collect() } else { near };
        let n = points.len() as f64;
        let centre = points.iter().sum::<Vector3<f64>>() / n;
        let squares: f64 = points.iter().map(|p| (p - centre).norm_squared()).sum();
        (centre, (squares / n).sqrt())
    }
}

/// How much a share speaks against an expected one, for each point: the Kullback-Leibler divergence of the two, 0 where the share
/// is no larger. The chance of `n` points to reach it is at most `exp(-n divergence)` (Chernoff 1952).
pub(crate) fn divergence(share: f64, expected: f64) -> f64 {
    if share <= expected {
        return 0.0;
    }
    let term = |a: f64, b: f64| if a > 0.0 { a * (a / b).ln() } else { 0.0 };
    term(share, expected) + term(1.0 - share, 1.0 - expected)
}

#[cfg(test)]
mod tests {
    use srrf_cloud::PointCloud;

    use super::*;

    #[test]
    fn a_lattice_lies_on_itself_and_half_a_step_away_it_does_not() {
        let at = |i: usize| [(i % 7) as f64, (i / 7 % 7) as f64, (i / 49) as f64];
        let cloud = RefineCloud::of(&PointCloud::new((0..343).map(at).collect()).unwrap());
        let probe = Probe::new(&cloud, &cloud);
        let shifted = |x: f64| Rigid { translation: Vector3::new(x, 0.0, 0.0), ..Rigid::identity() };
        assert_eq!(probe.shares(&shifted(0.0)), [[1.0; SCALES.len()]; 2]);
        assert_eq!(probe.partners(&shifted(0.0)), [343, 343]);
        let half = probe.shares(&shifted(0.5));
        assert!(half[0][ONE_SPACING] > 0.99 && half[0][3] == 0.0, "{half:?}");
        let away = probe.shares(&shifted(3.0));
        assert!((away[0][6] - 4.0 / 7.0).abs() < 1e-9, "{away:?}");
        let (centre, radius) = probe.overlap(&shifted(0.0));
        assert!(centre.norm() < 1e-9 && (radius - 12f64.sqrt()).abs() < 1e-9, "{centre} {radius}");
    }

    #[test]
    fn divergence_is_that_of_a_coin() {
        assert_eq!(divergence(0.4, 0.5), 0.0);
        assert!((divergence(1.0, 0.25) - 4f64.ln()).abs() < 1e-12);
        assert!((divergence(0.75, 0.5) - (0.75 * 1.5f64.ln() + 0.25 * 0.5f64.ln())).abs() < 1e-12);
    }
}
