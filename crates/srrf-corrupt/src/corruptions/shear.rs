//! `shear`: motion during the scan.

use rand::{Rng, RngExt, rngs::ChaCha8Rng};

use super::draws::sign;
use crate::card::{Card, Family, Strength};
use crate::corruption::{CorruptError, Corrupted, Corruption, check_points};
use crate::severity::Severity;

/// Mean magnitude of a coefficient.
pub const COEFFICIENT: [f64; 5] = [0.05, 0.10, 0.15, 0.20, 0.25];

/// A magnitude is uniform within this distance of its mean.
pub const HALF_BAND: f64 = 0.05;

/// What the registry says of it.
pub(super) const CARD: Card = Card {
    name: "shear",
    family: Family::Transformation,
    summary: "a shear of x and z",
    strength: Strength::Value("coefficient", COEFFICIENT),
    build: |_| Box::new(Shear),
};

/// A linear shear of the x and z axes; y stays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shear;

/// The four coefficients: `x' = x + x_from_y y + x_from_z z`, `z' = z + z_from_x x + z_from_y y`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    /// Part of y that is added to x.
    pub x_from_y: f64,
    /// Part of z that is added to x.
    pub x_from_z: f64,
    /// Part of x that is added to z.
    pub z_from_x: f64,
    /// Part of y that is added to z.
    pub z_from_y: f64,
}

impl Coefficients {
    /// Each a random sign times a magnitude within 0.05 of the severity's.
    pub fn draw<R: Rng>(severity: Severity, rng: &mut R) -> Self {
        let mean = severity.of(&COEFFICIENT);
        let mut coefficient = || sign(rng) * (mean + HALF_BAND * (2.0 * rng.random::<f64>() - 1.0));
        Self {
            x_from_y: coefficient(),
            x_from_z: coefficient(),
            z_from_x: coefficient(),
            z_from_y: coefficient(),
        }
    }

    /// The sheared point.
    pub fn apply(&self, [x, y, z]: &[f64; 3]) -> [f64; 3] {
        [x + self.x_from_y * y + self.x_from_z * z, *y, z + self.z_from_x * x + self.z_from_y * y]
    }
}

impl Corruption for Shear {
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
        let coefficients = Coefficients::draw(severity, rng);
        Ok(Corrupted::moved(points.iter().map(|p| coefficients.apply(p)).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corruptions::testing::rng;

    #[test]
    fn coefficients_stay_in_their_band_and_take_both_signs() {
        for (severity, mean) in Severity::ALL.into_iter().zip([0.05, 0.10, 0.15, 0.20, 0.25]) {
            let mut rng = rng(11);
            let draws: Vec<f64> = (0..500)
                .flat_map(|_| {
                    let c = Coefficients::draw(severity, &mut rng);
                    [c.x_from_y, c.x_from_z, c.z_from_x, c.z_from_y]
                })
                .collect();
            assert!(draws.iter().all(|d| (d.abs() - mean).abs() <= 0.05));
            // 2,000 fair signs: three standard deviations are 67.
            let positive = draws.iter().filter(|d| **d > 0.0).count();
            assert!(positive.abs_diff(1000) < 100, "{positive}");
            let average = draws.iter().map(|d| d.abs()).sum::<f64>() / 2000.0;
            assert!((average - mean).abs() < 0.003, "{average}");
        }
    }

    #[test]
    fn axes_go_where_the_names_say() {
        let c = Coefficients { x_from_y: 0.1, x_from_z: 0.2, z_from_x: 0.3, z_from_y: 0.4 };
        assert_eq!(c.apply(&[1.0, 0.0, 0.0]), [1.0, 0.0, 0.3]);
        assert_eq!(c.apply(&[0.0, 1.0, 0.0]), [0.1, 1.0, 0.4]);
        assert_eq!(c.apply(&[0.0, 0.0, 1.0]), [0.2, 0.0, 1.0]);
    }
}
