//! `cutout`: some regions are missing.

use rand::rngs::ChaCha8Rng;

use super::clusters::{MIN_POINTS, scaled, take};
use crate::card::{Card, Family, Strength};
use crate::corruption::{CorruptError, Corrupted, Corruption, check_points};
use crate::severity::Severity;

/// Points of a cluster, all of which are deleted.
pub const CLUSTER_POINTS: usize = 30;

/// Number of clusters.
pub const CLUSTERS: [usize; 5] = [2, 3, 5, 7, 10];

/// What the registry says of it.
pub(super) const CARD: Card = Card {
    name: "cutout",
    family: Family::Density,
    summary: "clusters of 30 points are removed",
    strength: Strength::Count("clusters", CLUSTERS),
    build: |_| Box::new(Cutout),
};

/// Small clusters are deleted whole. 1,024 points become 964, 934, 874, 814, 724.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cutout;

impl Corruption for Cutout {
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
        let mut pool: Vec<u32> = (0..points.len() as u32).collect();
        for _ in 0..severity.of(&CLUSTERS) {
            take(points, &mut pool, size, rng);
        }
        Ok(Corrupted::subset(points, &pool))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corruptions::testing::{cloud, rng};

    #[test]
    fn counts() {
        for (severity, count) in Severity::ALL.into_iter().zip([964, 934, 874, 814, 724]) {
            let out = Cutout.apply(&cloud(1024), severity, &mut rng(7)).unwrap();
            assert_eq!((out.points.len(), out.origin.len()), (count, count));
        }
        assert_eq!(Cutout.apply(&cloud(32), Severity::ALL[4], &mut rng(7)).unwrap().points.len(), 22);
    }
}
