//! [`Rigid`]: a rotation and a translation in `f64`.

use nalgebra::{Matrix3, Matrix4, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// A rigid motion `p -> R p + t`. Variables of this type carry the frames in their names:
/// `target_from_source` maps source coordinates into the target frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rigid {
    /// The rotation matrix, in SO(3).
    pub rotation: Matrix3<f64>,
    /// The translation, in the unit of the clouds.
    pub translation: Vector3<f64>,
}

impl Rigid {
    /// The motion that changes nothing.
    pub fn identity() -> Self {
        Self { rotation: Matrix3::identity(), translation: Vector3::zeros() }
    }

    /// `R p + t`.
    pub fn apply(&self, point: &[f64; 3]) -> [f64; 3] {
        (self.rotation * Vector3::from(*point) + self.translation).into()
    }

    /// The rotation as a unit quaternion `[x, y, z, w]` with `w >= 0`.
    pub fn quaternion_xyzw(&self) -> [f64; 4] {
        let rotation = Rotation3::from_matrix_unchecked(self.rotation);
        let q = UnitQuaternion::from_rotation_matrix(&rotation).into_inner();
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        [sign * q.i, sign * q.j, sign * q.k, sign * q.w]
    }

    /// The motion that undoes this one.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, translation: -(rotation * self.translation) }
    }

    /// `self` after `other`: with `self = c_from_b` and `other = b_from_a` this is `c_from_a`.
    pub fn compose(&self, other: &Self) -> Self {
        Self {
            rotation: self.rotation * other.rotation,
            translation: self.rotation * other.translation + self.translation,
        }
    }

    /// The 4 x 4 homogeneous matrix.
    pub fn to_matrix4(&self) -> Matrix4<f64> {
        let mut matrix = Matrix4::identity();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.rotation);
        matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&self.translation);
        matrix
    }

    /// Angle in degrees of the rotation that leads from `other` to `self` (isotropic rotation
    /// error), between 0 and 180.
    ///
    /// By `atan2` of sine and cosine, which keeps its digits near 0 and near 180 degrees.
    pub fn angle_to_deg(&self, other: &Self) -> f64 {
        let between = self.rotation.transpose() * other.rotation;
        let axis = Vector3::new(
            between[(2, 1)] - between[(1, 2)],
            between[(0, 2)] - between[(2, 0)],
            between[(1, 0)] - between[(0, 1)],
        );
        axis.norm().atan2(between.trace() - 1.0).to_degrees()
    }

    /// The rotation of SO(3) nearest to `matrix` in the Frobenius norm, by SVD with the
    /// determinant fix `U diag(1, 1, det(U V^T)) V^T`. `None` if the matrix is not finite.
    pub fn nearest_rotation(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
        if !matrix.iter().all(|v| v.is_finite()) {
            return None;
        }
        let svd = matrix.svd(true, true);
        let (u, v_t) = (svd.u?, svd.v_t?);
        // nalgebra sorts the singular values in descending order: the last is the one to flip.
        let sign = (u * v_t).determinant().signum();
        Some(u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t)
    }

    /// The motion that minimises `sum_i w_i |R source_i + t - target_i|^2` (Eq. 1 to 4 of the
    /// paper, with the determinant fix that it leaves out). Weights must not be negative.
    ///
    /// `None` for fewer than 3 points, slices of unequal length, no weight, or numbers that are
    /// not finite. Where the points determine no rotation (a line), one of the minimisers is
    /// returned.
    pub fn fit(source: &[[f64; 3]], target: &[[f64; 3]], weights: Option<&[f64]>) -> Option<Self> {
        let n = source.len();
        if n < 3 || target.len() != n || weights.is_some_and(|w| w.len() != n) {
            return None;
        }
        let weight = |i: usize| weights.map_or(1.0, |w| w[i]);
        let total: f64 = (0..n).map(weight).sum();
        if total.is_nan() || total <= 0.0 {
            return None;
        }
        let mean = |points: &[[f64; 3]]| -> Vector3<f64> {
            points.iter().enumerate().map(|(i, p)| Vector3::from(*p) * weight(i)).sum::<Vector3<f64>>()
                / total
        };
        let (source_mean, target_mean) = (mean(source), mean(target)); // Eq. (2)
        let mut cross = Matrix3::zeros(); // Eq. (3), transposed: sum w (y - ybar)(x - xbar)^T
        for i in 0..n {
            cross += weight(i)
                * (Vector3::from(target[i]) - target_mean)
                * (Vector3::from(source[i]) - source_mean).transpose();
        }
        let rotation = Self::nearest_rotation(&cross)?; // Eq. (4)
        Some(Self { rotation, translation: target_mean - rotation * source_mean })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::EulerXyz;

    fn pose() -> Rigid {
        Rigid {
            rotation: EulerXyz::from_deg([24.0, -31.0, 170.0]).to_matrix(),
            translation: Vector3::new(0.3, -2.0, 1.5),
        }
    }

    #[test]
    fn inverse_and_composition() {
        let both = pose().compose(&pose().inverse());
        assert!((both.to_matrix4() - Matrix4::identity()).norm() < 1e-12);
        assert!(pose().angle_to_deg(&pose()) < 1e-7);
        assert!(
            (pose().angle_to_deg(&Rigid::identity()) - pose().inverse().angle_to_deg(&Rigid::identity()))
                .abs()
                < 1e-9
        );
    }

    #[test]
    fn fit_finds_the_pose_and_never_reflects() {
        let source: Vec<[f64; 3]> = (0..11)
            .map(|i| {
                let s = i as f64;
                [s.sin(), (1.7 * s).cos(), (0.3 * s * s).sin()]
            })
            .collect();
        let target: Vec<[f64; 3]> = source.iter().map(|p| pose().apply(p)).collect();
        let found = Rigid::fit(&source, &target, None).unwrap();
        assert!((found.to_matrix4() - pose().to_matrix4()).norm() < 1e-10);

        let mirrored: Vec<[f64; 3]> = source.iter().map(|p| [-p[0], p[1], p[2]]).collect();
        let found = Rigid::fit(&source, &mirrored, None).unwrap();
        assert!((found.rotation.determinant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn weights_silence_an_outlier() {
        let mut source = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut target: Vec<[f64; 3]> = source.iter().map(|p| pose().apply(p)).collect();
        source.push([9.0, 9.0, 9.0]);
        target.push([-50.0, 0.0, 3.0]);
        let found = Rigid::fit(&source, &target, Some(&[1.0, 1.0, 1.0, 1.0, 0.0])).unwrap();
        assert!((found.to_matrix4() - pose().to_matrix4()).norm() < 1e-10);
        assert_eq!(Rigid::fit(&source[..2], &target[..2], None), None);
        assert_eq!(Rigid::fit(&source, &target, Some(&[0.0; 5])), None);
    }
}
