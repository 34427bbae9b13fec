//! `impulse`: some points jump.

use rand::rngs::ChaCha8Rng;

use super::draws::{add, distinct, share, sign};
use crate::card::{Card, Family, Strength};
use crate::corruption::{CorruptError, Corrupted, Corruption, check_points};
use crate::severity::Severity;

/// One of so many points is displaced.
pub const DIVISOR: [usize; 5] = [30, 25, 20, 15, 10];

/// What the registry says of it.
pub(super) const CARD: Card = Card {
    name: "impulse",
    family: Family::Noise,
    summary: "points are displaced by 0.05 on every coordinate",
    strength: Strength::OneOf(DIVISOR),
    build: |variants| Box::new(Impulse { linf: variants.impulse_linf }),
};

/// A few distinct points (34, 40, 51, 68 or 102 of 1,024) are displaced by plus or minus `linf`
/// on every coordinate, with independent signs, as the reference code does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impulse {
    /// Displacement on each coordinate, canonical unit.
    pub linf: f64,
}

impl Corruption for Impulse {
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
        let mut moved = points.to_vec();
        for i in distinct(points.len(), share(points, severity, &DIVISOR), rng) {
            moved[i] = add(&points[i], &std::array::from_fn(|_| self.linf * sign(rng)));
        }
        Ok(Corrupted::moved(moved))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corruptions::testing::{cloud, displacements, rng};

    #[test]
    fn so_many_points_move_so_far() {
        let points = cloud(1024);
        for (severity, count) in Severity::ALL.into_iter().zip([34, 40, 51, 68, 102]) {
            let out = Impulse { linf: 0.05 }.apply(&points, severity, &mut rng(2)).unwrap();
            let moves = displacements(&points, &out);
            let moved: Vec<_> = moves.iter().filter(|d| **d != [0.0; 3]).collect();
            assert_eq!(moved.len(), count);
            assert!(moved.iter().all(|d| d.iter().all(|c| (c.abs() - 0.05).abs() < 1e-12)));
            assert!(moved.iter().any(|d| d[0] > 0.0 && d[1] < 0.0));
        }
    }
}
