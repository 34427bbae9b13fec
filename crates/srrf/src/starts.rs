//! Orientations from which the network sees the source when nothing is known of its turn.

use nalgebra::{Matrix3, Vector3};
use srrf_cloud::Rigid;

/// The 24 rotations of a cube, the identity first: every rotation is within 62.8 degrees of one.
pub fn cube_rotations() -> Vec<Matrix3<f64>> {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let mut all = Vec::with_capacity(24);
    for first in 0..6 {
        for second in 0..6 {
            if first % 3 == second % 3 {
                continue;
            }
            let signed = |i: usize| axes[i % 3] * if i < 3 { 1.0 } else { -1.0 };
            let (x, y) = (signed(first), signed(second));
            all.push(Matrix3::from_columns(&[x, y, x.cross(&y)]));
        }
    }
    all
}

/// The pose that turns the source about its own centre, both clouds being centred.
pub fn turned(rotation: Matrix3<f64>) -> Rigid {
    Rigid { rotation, translation: Vector3::zeros() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twenty_four_different_rotations() {
        let all = cube_rotations();
        assert_eq!(all.len(), 24);
        assert_eq!(all[0], Matrix3::identity());
        for (i, a) in all.iter().enumerate() {
            assert!((a.determinant() - 1.0).abs() < 1e-12);
            assert!(all[..i].iter().all(|b| (a - b).norm() > 0.5));
        }
    }
}
