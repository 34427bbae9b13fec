//! Rotations spread evenly over all of SO(3), the same at every call.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion};

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
