//! What the tests of several corruptions share.

use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use rand_distr::StandardNormal;

use crate::corruption::{Corrupted, Corruption};
use crate::severity::Severity;

pub(crate) fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// `n` points on an ellipsoid within the unit sphere: a shape like those of the data, whose
/// rms radius is about 0.6.
pub(crate) fn cloud(n: usize) -> Vec<[f64; 3]> {
    let mut rng = rng(77);
    (0..n)
        .map(|_| {
            let g: [f64; 3] = std::array::from_fn(|_| rng.sample(StandardNormal));
            let norm = g.iter().map(|c| c * c).sum::<f64>().sqrt();
            [g[0] / norm, 0.6 * g[1] / norm, 0.3 * g[2] / norm]
        })
        .collect()
}

/// Output minus input, for corruptions that move points and add none.
pub(crate) fn displacements(points: &[[f64; 3]], out: &Corrupted) -> Vec<[f64; 3]> {
    assert_eq!(out.points.len(), points.len());
    assert!(out.origin.iter().enumerate().all(|(i, o)| *o == Some(i as u32)));
    points.iter().zip(&out.points).map(|(p, q)| std::array::from_fn(|c| q[c] - p[c])).collect()
}

/// Root mean square length of the displacements over all points of `rounds` draws.
pub(crate) fn rms_displacement(
    corruption: &dyn Corruption,
    points: &[[f64; 3]],
    severity: Severity,
    rng: &mut ChaCha8Rng,
    rounds: usize,
) -> f64 {
    let sum: f64 = (0..rounds)
        .map(|_| {
            let out = corruption.apply(points, severity, rng).unwrap();
            displacements(points, &out).as_flattened().iter().map(|d| d * d).sum::<f64>()
        })
        .sum();
    (sum / (rounds * points.len()) as f64).sqrt()
}
