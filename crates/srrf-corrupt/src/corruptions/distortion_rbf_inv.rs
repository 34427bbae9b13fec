//! `distortion_rbf_inv`: smooth warp by inverse multiquadric radial basis functions.

use rand::rngs::ChaCha8Rng;

use super::rbf::{Kernel, SHIFT, draw_displacements};
use crate::card::{Card, Family, Strength};
use crate::corruption::{CorruptError, Corrupted, Corruption, check_points};
use crate::severity::Severity;

/// What the registry says of it.
pub(super) const CARD: Card = Card {
    name: "distortion_rbf_inv",
    family: Family::Transformation,
    summary: "warp by 125 inverse multiquadric basis functions",
    strength: Strength::Value("shift", SHIFT),
    build: |_| Box::new(DistortionRbfInv),
};

/// The warp with the basis function `phi(x) = 1 / sqrt(x^2 + r^2)`: see [`Kernel`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DistortionRbfInv;

impl Corruption for DistortionRbfInv {
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
        Ok(Corrupted::moved(Kernel::InverseMultiquadric.deform(points, &displacements)?))
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
        let table = [0.019, 0.039, 0.058, 0.078, 0.098];
        for (severity, rms) in Severity::ALL.into_iter().zip(table) {
            let found = rms_displacement(&DistortionRbfInv, &points, severity, &mut rng(4), 40);
            assert!((found / rms - 1.0).abs() < 0.15, "{severity}: {found} against {rms}");
        }
    }
}
