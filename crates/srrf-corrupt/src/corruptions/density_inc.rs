//! `density_inc`: some regions are scanned more densely than the rest.

use rand::{Rng, RngExt, rngs::ChaCha8Rng};

use super::{
    clusters::{CLUSTER_POINTS, CLUSTERS, MIN_POINTS, scaled, take},
    draws::{add, in_cube},
};
use crate::card::{Card, Family, REFERENCE_POINTS, Strength};
use crate::corruption::{CorruptError, Corrupted, Corruption, check_points};
use crate::severity::Severity;
use crate::variants::{DensityInc, Variants};

/// Points of the clouds that ModelNet40-C thins: twice the reference.
pub const DENSE_POINTS: usize = 2 * REFERENCE_POINTS;

/// What the registry says of it.
pub(super) const CARD: Card = Card {
    name: "density_inc",
    family: Family::Density,
    summary: "clusters of 100 points gain 100 more",
    strength: Strength::Count("clusters", CLUSTERS),
    build: |variants| Box::new(DensityIncrease::new(variants)),
};

/// Clusters of a cloud become denser.
///
/// [`DensityInc::PaperText`]: each cluster gains as many new points as it has, every one a copy of
/// one of its points with an offset uniform in a small cube; 1,024 points become 1,124 to 1,524,
/// and the clusters have twice the density of the rest. Clusters do not overlap.
///
/// [`DensityInc::ModelNet40C`]: 2,048 points become 1,024. The clusters keep their points; the
/// rest is drawn with replacement from the points outside, which makes the clusters 2.1 to 3
/// times as dense as the rest. For `n` points all counts scale with `n / 2048`, so that the
/// contrast stays and `n / 2` points come out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DensityIncrease {
    variant: DensityInc,
    offset: f64,
}

impl DensityIncrease {
    /// In the reading that `variants` chooses.
    pub fn new(variants: &Variants) -> Self {
        Self { variant: variants.density_inc, offset: variants.density_inc_offset }
    }

    fn add_points<R: Rng>(&self, points: &[[f64; 3]], clusters: usize, rng: &mut R) -> Corrupted {
        let size = scaled(CLUSTER_POINTS, points.len());
        let mut pool: Vec<u32> = (0..points.len() as u32).collect();
        let dense: Vec<u32> = (0..clusters).flat_map(|_| take(points, &mut pool, size, rng)).collect();
        let added = dense.iter().map(|&i| add(&points[i as usize], &in_cube(self.offset, rng)));
        Corrupted::extended(points, added)
    }

    fn thin_the_rest<R: Rng>(points: &[[f64; 3]], clusters: usize, rng: &mut R) -> Corrupted {
        let keep = points.len() * REFERENCE_POINTS / DENSE_POINTS;
        let size = scaled(CLUSTER_POINTS, keep);
        let mut pool: Vec<u32> = (0..points.len() as u32).collect();
        let mut kept: Vec<u32> = (0..clusters).flat_map(|_| take(points, &mut pool, size, rng)).collect();
        while kept.len() < keep {
            kept.push(pool[rng.random_range(0..pool.len())]);
        }
        Corrupted::subset(points, &kept)
    }
}

impl Corruption for DensityIncrease {
    fn name(&self) -> &'static str {
        CARD.name
    }

    /// Twice as many where ModelNet40-C's reading thins them.
    fn clean_points(&self, points: usize) -> usize {
        match self.variant {
            DensityInc::PaperText => points,
            DensityInc::ModelNet40C => points.saturating_mul(DENSE_POINTS / REFERENCE_POINTS),
        }
    }

    fn apply(
        &self,
        points: &[[f64; 3]],
        severity: Severity,
        rng: &mut ChaCha8Rng,
    ) -> Result<Corrupted, CorruptError> {
        check_points(points, self.name(), MIN_POINTS)?;
        let clusters = severity.of(&CLUSTERS);
        Ok(match self.variant {
            DensityInc::PaperText => self.add_points(points, clusters, rng),
            DensityInc::ModelNet40C => Self::thin_the_rest(points, clusters, rng),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corruptions::testing::{cloud, rng};

    #[test]
    fn paper_text_adds_points_near_points() {
        let points = cloud(1024);
        for (severity, count) in Severity::ALL.into_iter().zip([1124, 1224, 1324, 1424, 1524]) {
            let out = DensityIncrease::new(&Variants::paper()).apply(&points, severity, &mut rng(3)).unwrap();
            assert_eq!(out.points.len(), count);
            assert_eq!(out.points[..1024], points[..]);
            for (p, origin) in out.points[1024..].iter().zip(&out.origin[1024..]) {
                assert_eq!(*origin, None);
                assert!(points.iter().any(|q| (0..3).all(|c| (p[c] - q[c]).abs() <= 0.02)));
            }
        }
    }

    #[test]
    fn modelnet40_c_keeps_clusters_and_thins_the_rest() {
        let points = cloud(2048);
        let variant = DensityIncrease::new(&Variants::modelnet40_c());
        for severity in Severity::ALL {
            let out = variant.apply(&points, severity, &mut rng(3)).unwrap();
            let dense = 100 * usize::from(severity.get());
            assert_eq!(out.points.len(), 1024);
            let mut first: Vec<_> = out.origin[..dense].to_vec();
            first.sort_unstable();
            first.dedup();
            assert_eq!(first.len(), dense, "cluster points come once");
            assert!(out.origin[dense..].iter().all(|o| !first.contains(o)));
            assert!(out.points.iter().zip(&out.origin).all(|(p, o)| *p == points[o.unwrap() as usize]));
        }
    }
}
