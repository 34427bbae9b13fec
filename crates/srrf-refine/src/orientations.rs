//! Rotations spread evenly over all of SO(3), the same at every call.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion};
use rayon::prelude::*;

/// `n` rotations, evenly spread: super-Fibonacci spirals (Alexa, CVPR 2022).
pub(crate) fn orientations(n: usize) -> impl Iterator<Item = Matrix3<f64>> {
    // The positive root of psi^4 = psi + 4, from the paper.
    const PSI: f64 = 1.533_751_168_755_204_3;
    (0..n).map(move |i| {
        let s = i as f64 + 0.5;
        let (near, far) = ((s / n as f64).sqrt(), (1.0 - s / n as f64).sqrt());
        let alpha = std::f64::consts::TAU * s / std::f64::consts::SQRT_2;
        let beta = std::f64::consts::TAU * s / PSI;
        let q = Quaternion::new(far * beta.cos(), near * alpha.sin(), near * alpha.cos(), far * beta.sin());
        *UnitQuaternion::from_quaternion(q).to_rotation_matrix().matrix()
    })
}

/// Of the rotations `tried` those with the highest scores, at most `most`, best first: each scores at least the share `least` of what the
/// identity does, and is `apart` (radians) or more from the others and from the identity.
pub(crate) fn best_apart(
    tried: Vec<Matrix3<f64>>,
    score: impl Fn(&Matrix3<f64>) -> f64 + Sync,
    least: f64,
    apart: f64,
    most: usize,
) -> Vec<Matrix3<f64>> {
    let least = least * score(&Matrix3::identity());
    let mut scored: Vec<(f64, Matrix3<f64>)> = tried
        .into_par_iter()
        .map(|rotation| (score(&rotation), rotation))
        .filter(|(score, _)| *score >= least)
        .collect();
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut kept: Vec<Matrix3<f64>> = Vec::new();
    for (_, rotation) in scored {
        let near = |other: &Matrix3<f64>| angle(&(other.transpose() * rotation)) < apart;
        if kept.len() < most && !near(&Matrix3::identity()) && !kept.iter().any(near) {
            kept.push(rotation);
        }
    }
    kept
}

/// Angle of a rotation, radians.
pub(crate) fn angle(rotation: &Matrix3<f64>) -> f64 {
    ((rotation.trace() - 1.0) / 2.0).clamp(-1.0, 1.0).acos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_are_close_and_none_is_far() {
        let all: Vec<Matrix3<f64>> = orientations(500).collect();
        let angle = |a: &Matrix3<f64>, b: &Matrix3<f64>| {
            (((a.transpose() * b).trace() - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees()
        };
        let nearest = |to: &Matrix3<f64>, without: usize| {
            let others = all.iter().enumerate().filter(|(i, _)| *i != without);
            others.map(|(_, r)| angle(to, r)).fold(180.0, f64::min)
        };
        let gaps: Vec<f64> = (0..500).map(|i| nearest(&all[i], i)).collect();
        assert!(gaps.iter().all(|gap| (12.0..35.0).contains(gap)), "{gaps:?}");
        // Any other rotation has one within reach.
        assert!(orientations(333).all(|r| nearest(&r, usize::MAX) < 30.0));
    }
}
