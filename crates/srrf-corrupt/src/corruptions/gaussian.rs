//! `gaussian`: noise of a sensor.

use rand::{RngExt, rngs::ChaCha8Rng};
use rand_distr::StandardNormal;

use crate::card::{Card, Family, Strength};
use crate::corruption::{CorruptError, Corrupted, Corruption, check_points};
use crate::severity::Severity;

/// Standard deviation of the noise on each coordinate.
pub const SIGMA: [f64; 5] = [0.010, 0.015, 0.020, 0.025, 0.030];

/// Coordinates are clipped to plus and minus this (paper: "constrained within the range of -1 to 1"; the code
/// clips the coordinates, not the noise).
pub const CLIP: f64 = 1.0;

/// What the registry says of it.
pub(super) const CARD: Card = Card {
    name: "gaussian",
    family: Family::Noise,
    summary: "Gaussian noise on every coordinate, clipped to 1",
    strength: Strength::Value("sigma", SIGMA),
    build: |_| Box::new(Gaussian),
};

/// Independent Gaussian noise on every coordinate, after which the coordinates are clipped to
/// `[-1, 1]`. The clip is why this corruption must run in the canonical frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gaussian;

impl Corruption for Gaussian {
    fn name(&self) -> &'static str {
        CARD.name
    }

    fn apply(
        &self,
        points: &[[f64; 3]],
        severity: Severity,
        rng: &mut ChaCha8Rng,
    ) -> Result<Corrupted, CorruptError> {
        check_points(points, self.name(), 1)?;
        let sigma = severity.of(&SIGMA);
        let mut noisy: Vec<[f64; 3]> =
            points.iter().map(|p| p.map(|c| c + sigma * rng.sample::<f64, _>(StandardNormal))).collect();
        clip(&mut noisy);
        Ok(Corrupted::moved(noisy))
    }
}

/// Clips every coordinate to `[-1, 1]`.
pub fn clip(points: &mut [[f64; 3]]) {
    for c in points.as_flattened_mut() {
        *c = c.clamp(-CLIP, CLIP);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corruptions::testing::{cloud, displacements, rng};

    #[test]
    fn spread_and_clip() {
        let points: Vec<[f64; 3]> = cloud(8192).into_iter().map(|p| p.map(|c| 0.8 * c)).collect();
        for (severity, sigma) in Severity::ALL.into_iter().zip([0.010, 0.015, 0.020, 0.025, 0.030]) {
            let moves = displacements(&points, &Gaussian.apply(&points, severity, &mut rng(2)).unwrap());
            let all = moves.as_flattened();
            // The relative standard error of an rms over 24,576 normal draws is 0.45 %.
            let rms = (all.iter().map(|d| d * d).sum::<f64>() / all.len() as f64).sqrt();
            assert!((rms / sigma - 1.0).abs() < 0.02, "{rms}");
        }
        let edge = vec![[1.0, -1.0, 0.0]; 100];
        let out = Gaussian.apply(&edge, Severity::ALL[4], &mut rng(2)).unwrap();
        assert!(out.points.as_flattened().iter().all(|c| c.abs() <= 1.0));
        assert!(out.points.iter().any(|p| p[0] == 1.0) && out.points.iter().any(|p| p[1] == -1.0));
    }
}
