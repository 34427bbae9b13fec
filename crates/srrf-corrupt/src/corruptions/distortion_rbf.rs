//! `distortion_rbf`: smooth warp by multiquadric radial basis functions.

use rand::rngs::ChaCha8Rng;

use super::rbf::{Kernel, SHIFT, draw_displacements};
use crate::card::{Card, Family, Strength};
use crate::corruption::{CorruptError, Corrupted, Corruption, check_points};
use crate::severity::Severity;

/// What the registry says of it.
pub(super) const CARD: Card = Card {
    name: "distortion_rbf",
    family: Family::Transformation,
    summary: "warp by 125 multiquadric basis functions",
    strength: Strength::Value("shift", SHIFT),
    build: |_| Box::new(DistortionRbf),
};

/// The warp with the basis function `phi(x) = sqrt(x^2 + r^2)`: see [`Kernel`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DistortionRbf;

impl Corruption for DistortionRbf {
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
        let displacements = draw_displacements(severity, rng);
        Ok(Corrupted::moved(Kernel::Multiquadric.deform(points, &displacements)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corruptions::testing::{cloud, rms_displacement, rng};

    #[test]
    fn strength() {
        // Measured on ModelNet40 shapes; spheres are near that.
        let points = cloud(256);
        let table = [0.020, 0.040, 0.061, 0.081, 0.102];
        for (severity, rms) in Severity::ALL.into_iter().zip(table) {
            let found = rms_displacement(&DistortionRbf, &points, severity, &mut rng(4), 40);
            assert!((found / rms - 1.0).abs() < 0.15, "{severity}: {found} against {rms}");
        }
    }
}
