//! `cutout`: some regions are missing.

use rand::rngs::ChaCha8Rng;

use super::clusters::{scaled, take};
use crate::corruption::check;
use crate::parameters::{CUTOUT_CLUSTER_POINTS, CUTOUT_CLUSTERS, DENSITY_MIN_POINTS};
use crate::{CorruptError, Corrupted, Corruption, Severity};

/// Small clusters are deleted whole. 1,024 points become 964, 934, 874, 814, 724.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cutout;

impl Corruption for Cutout {
    fn name(&self) -> &'static str {
        "cutout"
    }

    fn apply(
        &self,
        points: &[[f64; 3]],
        severity: Severity,
        rng: &mut ChaCha8Rng,
    ) -> Result<Corrupted, CorruptError> {
        check(points, self.name(), DENSITY_MIN_POINTS)?;
        let size = scaled(CUTOUT_CLUSTER_POINTS, points.len());
        let mut pool: Vec<u32> = (0..points.len() as u32).collect();
        for _ in 0..severity.of(&CUTOUT_CLUSTERS) {
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
