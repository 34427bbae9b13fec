//! The draws that several corruptions share.

use rand::{Rng, RngExt, seq::index};

use crate::severity::Severity;

/// Uniform in `[-half_width, half_width)` on each coordinate.
pub(super) fn in_cube<R: Rng>(half_width: f64, rng: &mut R) -> [f64; 3] {
    std::array::from_fn(|_| (2.0 * rng.random::<f64>() - 1.0) * half_width)
}

/// `+1` or `-1`.
pub(super) fn sign<R: Rng>(rng: &mut R) -> f64 {
    if rng.random() { 1.0 } else { -1.0 }
}

/// `amount` (at most `length`) distinct indices under `length`, ascending.
pub(super) fn distinct<R: Rng>(length: usize, amount: usize, rng: &mut R) -> Vec<usize> {
    let mut chosen = index::sample(rng, length, amount.min(length)).into_vec();
    chosen.sort_unstable();
    chosen
}

/// One for each `d` points of `points`, and at least one, where `d` is the severity's divisor.
pub(super) fn share(points: &[[f64; 3]], severity: Severity, divisors: &[usize; 5]) -> usize {
    let count = match severity.beyond() {
        0 => points.len() / severity.of(divisors),
        _ => (points.len() as f64 * severity.share_of(divisors)) as usize,
    };
    count.max(1)
}

/// `a + b`.
pub(super) fn add(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] + b[c])
}
