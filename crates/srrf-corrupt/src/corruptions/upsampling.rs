//! `upsampling`: interpolation adds wrong points.

use rand::rngs::ChaCha8Rng;

use super::draws::{add, distinct, in_cube, share};
use crate::card::{Card, Family, Strength};
use crate::corruption::{CorruptError, Corrupted, Corruption, check_points};
use crate::severity::Severity;

/// One of so many points is copied.
pub const DIVISOR: [usize; 5] = [5, 4, 3, 2, 1];

/// What the registry says of it.
pub(super) const CARD: Card = Card {
    name: "upsampling",
    family: Family::Noise,
    summary: "points are added within 0.08 of others",
    strength: Strength::OneOf(DIVISOR),
    build: |variants| Box::new(Upsampling { linf: variants.upsampling_linf }),
};

/// Copies of distinct random points, each with an offset uniform in `[-linf, linf]^3`, are added:
/// 204, 256, 341, 512 or 1,024 to 1,024 points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Upsampling {
    /// Largest offset on each coordinate, canonical unit.
    pub linf: f64,
}

impl Corruption for Upsampling {
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
        let copied = distinct(points.len(), share(points, severity, &DIVISOR), rng);
        Ok(Corrupted::extended(points, copied.into_iter().map(|i| add(&points[i], &in_cube(self.linf, rng)))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corruptions::testing::{cloud, rng};

    #[test]
    fn counts_and_offsets() {
        let points = cloud(1024);
        for (severity, count) in Severity::ALL.into_iter().zip([1228, 1280, 1365, 1536, 2048]) {
            let out = Upsampling { linf: 0.08 }.apply(&points, severity, &mut rng(2)).unwrap();
            assert_eq!(out.points.len(), count);
            assert_eq!(out.points[..1024], points[..]);
            assert!(out.origin[1024..].iter().all(Option::is_none));
        }
        // At severity 5 every point is copied once, in order: the offsets can be read off.
        let out = Upsampling { linf: 0.08 }.apply(&points, Severity::ALL[4], &mut rng(2)).unwrap();
        let largest = (0..1024)
            .flat_map(|i| (0..3).map(move |c| (i, c)))
            .map(|(i, c)| (out.points[1024 + i][c] - points[i][c]).abs())
            .fold(0.0, f64::max);
        assert!(largest <= 0.08 && largest > 0.079, "{largest}");
    }
}
