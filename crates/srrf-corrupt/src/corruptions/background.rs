//! `background`: clutter around the shape.

use rand::rngs::ChaCha8Rng;

use super::draws::{in_cube, share};
use crate::card::{Card, Family, Strength};
use crate::corruption::{CorruptError, Corrupted, Corruption, check_points};
use crate::severity::Severity;

/// One point is added for each so many points, in the cube `[-1, 1]^3`.
pub const DIVISOR: [usize; 5] = [45, 40, 35, 30, 20];

/// What the registry says of it.
pub(super) const CARD: Card = Card {
    name: "background",
    family: Family::Noise,
    summary: "points are added in the cube around",
    strength: Strength::OneOf(DIVISOR),
    build: |_| Box::new(Background),
};

/// Points uniform in the cube `[-1, 1]^3` are added: 22, 25, 29, 34 or 51 to 1,024 points. The
/// cube bounds the unit sphere, not the shape; the paper's "bounding cube" is read so because the
/// reference code does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Background;

impl Corruption for Background {
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
        let count = share(points, severity, &DIVISOR);
        Ok(Corrupted::extended(points, (0..count).map(|_| in_cube(1.0, rng))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corruptions::testing::{cloud, rng};

    #[test]
    fn counts_and_cube() {
        let points = cloud(1024);
        for (severity, count) in Severity::ALL.into_iter().zip([1046, 1049, 1053, 1058, 1075]) {
            let out = Background.apply(&points, severity, &mut rng(2)).unwrap();
            assert_eq!(out.points.len(), count);
            assert_eq!(out.points[..1024], points[..]);
            assert!(out.origin[1024..].iter().all(Option::is_none));
            let added = out.points[1024..].as_flattened();
            assert!(added.iter().all(|c| c.abs() <= 1.0));
            // The clutter fills the cube: the rms of U(-1, 1) is 0.577.
            let rms = (added.iter().map(|c| c * c).sum::<f64>() / added.len() as f64).sqrt();
            assert!((rms - 0.577).abs() < 0.12, "{rms}");
        }
    }
}
