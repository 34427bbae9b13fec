//! `density_dec`: some regions lose most of their points.

use rand::rngs::ChaCha8Rng;

use super::{
    clusters::{CLUSTER_POINTS, CLUSTERS, MIN_POINTS, scaled, take},
    draws::distinct,
};
use crate::card::{Card, Family, Strength};
use crate::corruption::{CorruptError, Corrupted, Corruption, check_points};
use crate::severity::Severity;

/// Points deleted from each cluster.
pub const DELETED: usize = 75;

/// What the registry says of it.
pub(super) const CARD: Card = Card {
    name: "density_dec",
    family: Family::Density,
    summary: "clusters of 100 points lose 75",
    strength: Strength::Count("clusters", CLUSTERS),
    build: |_| Box::new(DensityDec),
};

/// A random three quarters of each cluster are deleted. The quarter that is left may be part of
/// the next cluster. 1,024 points become 949, 874, 799, 724, 649.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DensityDec;

impl Corruption for DensityDec {
    fn name(&self) -> &'static str {
        CARD.name
    }

    fn apply(
        &self,
        points: &[[f64; 3]],
        severity: Severity,
        rng: &mut ChaCha8Rng,
    ) -> Result<Corrupted, CorruptError> {
        check_points(points, self.name(), MIN_POINTS)?;
        let size = scaled(CLUSTER_POINTS, points.len());
        let deleted = scaled(DELETED, points.len());
        let mut pool: Vec<u32> = (0..points.len() as u32).collect();
        for _ in 0..severity.of(&CLUSTERS) {
            let cluster = take(points, &mut pool, size, rng);
            let survivors = cluster.len().saturating_sub(deleted);
            pool.extend(distinct(cluster.len(), survivors, rng).into_iter().map(|i| cluster[i]));
        }
        pool.sort_unstable();
        Ok(Corrupted::subset(points, &pool))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corruptions::testing::{cloud, rng};

    #[test]
    fn counts_and_locality() {
        let points = cloud(1024);
        for (severity, count) in Severity::ALL.into_iter().zip([949, 874, 799, 724, 649]) {
            let out = DensityDec.apply(&points, severity, &mut rng(5)).unwrap();
            assert_eq!(out.points.len(), count);
            assert!(out.points.iter().zip(&out.origin).all(|(p, o)| *p == points[o.unwrap() as usize]));
        }
        let out = DensityDec.apply(&points, Severity::ALL[0], &mut rng(5)).unwrap();
        let gone: Vec<_> =
            (0..1024u32).filter(|i| !out.origin.contains(&Some(*i))).map(|i| points[i as usize]).collect();
        // The 75 deleted points are among the 100 nearest of one of the points.
        assert!(points.iter().any(|centre| {
            let mut by_distance = points.clone();
            by_distance.sort_by(|a, b| {
                let d = |p: &[f64; 3]| (0..3).map(|c| (p[c] - centre[c]).powi(2)).sum::<f64>();
                d(a).total_cmp(&d(b))
            });
            gone.iter().all(|p| by_distance[..100].contains(p))
        }));
    }

    #[test]
    fn the_deleted_are_random_in_their_cluster() {
        // Points in order along a line: a cluster is a run of indices, the deleted are not.
        let line: Vec<[f64; 3]> = (0..1024).map(|i| [f64::from(i) / 1024.0, 0.0, 0.0]).collect();
        let out = DensityDec.apply(&line, Severity::ALL[0], &mut rng(5)).unwrap();
        let gone: Vec<u32> = (0..1024).filter(|i| !out.origin.contains(&Some(*i))).collect();
        let (first, last) = (gone[0], gone[gone.len() - 1]);
        assert!((80..100).contains(&(last - first)), "{gone:?}");
        let middle = (first + last) / 2;
        let half = gone.iter().filter(|i| **i < middle).count();
        assert!((25..50).contains(&half), "{half}");
    }

    #[test]
    fn too_few_points_are_refused() {
        let error = DensityDec.apply(&cloud(31), Severity::ALL[4], &mut rng(5)).unwrap_err();
        assert_eq!(error, CorruptError::TooFew { corruption: "density_dec", have: 31, need: 32 });
        assert!(!DensityDec.apply(&cloud(32), Severity::ALL[4], &mut rng(5)).unwrap().points.is_empty());
    }
}
