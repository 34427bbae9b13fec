//! `uniform`: noise of a bounded, even distribution.

use rand::rngs::ChaCha8Rng;

use super::draws::{add, in_cube};
use crate::card::{Card, Family, Strength};
use crate::corruption::{CorruptError, Corrupted, Corruption, check_points};
use crate::severity::Severity;

/// Largest noise on each coordinate.
pub const HALF_WIDTH: [f64; 5] = [0.01, 0.02, 0.03, 0.04, 0.05];

/// What the registry says of it.
pub(super) const CARD: Card = Card {
    name: "uniform",
    family: Family::Noise,
    summary: "uniform noise on every coordinate",
    strength: Strength::Value("half width", HALF_WIDTH),
    build: |_| Box::new(Uniform),
};

/// Independent uniform noise on every coordinate of every point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Uniform;

impl Corruption for Uniform {
    fn name(&self) -> &'static str {
        CARD.name
    }

    fn is_box_normalized(&self) -> bool {
        true
    }

    fn apply(
        &self,
        points: &[[f64; 3]],
        severity: Severity,
        rng: &mut ChaCha8Rng,
    ) -> Result<Corrupted, CorruptError> {
        check_points(points, self.name(), 1)?;
        let half_width = severity.of(&HALF_WIDTH);
        Ok(Corrupted::moved(points.iter().map(|p| add(p, &in_cube(half_width, rng))).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corruptions::testing::{cloud, displacements, rng};

    #[test]
    fn bounded_centred_and_of_the_right_spread() {
        let points = cloud(8192);
        for (severity, width) in Severity::ALL.into_iter().zip([0.01, 0.02, 0.03, 0.04, 0.05]) {
            let moves = displacements(&points, &Uniform.apply(&points, severity, &mut rng(2)).unwrap());
            let all = moves.as_flattened();
            assert!(all.iter().all(|d| d.abs() <= width));
            let n = all.len() as f64;
            // Standard errors over 24,576 draws: 0.6 % of the width for the mean, 0.3 % for the rms.
            assert!((all.iter().sum::<f64>() / n).abs() < 0.02 * width);
            let rms = (all.iter().map(|d| d * d).sum::<f64>() / n).sqrt();
            assert!((rms / (width / 3f64.sqrt()) - 1.0).abs() < 0.02, "{rms}");
        }
    }
}
