//! Euler angles in the convention of DCP, by which the field compares rotations.

use nalgebra::{Matrix3, Rotation3, Vector3};

/// Angles `(a, b, c)` of `R = Rx(a) Ry(b) Rz(c)`, in radians.
///
/// This is DCP's convention: its scorer compares the extrinsic `zyx` angles `[c, b, a]` of the
/// rotation that maps source to target, over all three angles and all samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EulerXyz {
    /// `[a, b, c]`, in radians.
    pub angles_rad: [f64; 3],
}

impl EulerXyz {
    /// From `[a, b, c]` in degrees.
    pub fn from_deg(angles_deg: [f64; 3]) -> Self {
        Self { angles_rad: angles_deg.map(f64::to_radians) }
    }

    /// `[a, b, c]` in degrees.
    pub fn to_deg(self) -> [f64; 3] {
        self.angles_rad.map(f64::to_degrees)
    }

    /// `R = Rx(a) Ry(b) Rz(c)`.
    pub fn to_matrix(self) -> Matrix3<f64> {
        let [a, b, c] = self.angles_rad;
        (Rotation3::from_axis_angle(&Vector3::x_axis(), a)
            * Rotation3::from_axis_angle(&Vector3::y_axis(), b)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), c))
        .into_inner()
    }

    /// The angles of a rotation matrix: `a = atan2(-r23, r33)`, `b = asin(r13)`,
    /// `c = atan2(-r12, r11)`; `b` in [-90, 90] degrees, the others in (-180, 180].
    pub fn from_matrix(r: &Matrix3<f64>) -> Self {
        let a = (-r[(1, 2)]).atan2(r[(2, 2)]);
        let b = r[(0, 2)].clamp(-1.0, 1.0).asin();
        let c = (-r[(0, 1)]).atan2(r[(0, 0)]);
        Self { angles_rad: [a, b, c] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        for angles in [[24.69661, 32.18352, 27.12435], [-170.0, 80.0, 5.0], [0.0, -89.0, 179.0]] {
            let back = EulerXyz::from_matrix(&EulerXyz::from_deg(angles).to_matrix()).to_deg();
            assert!((0..3).all(|i| (back[i] - angles[i]).abs() < 1e-9), "{angles:?} {back:?}");
        }
    }

    #[test]
    fn order_of_the_factors() {
        // Rx(90) Ry(0) Rz(90) maps x to Rx(90) y = z.
        let r = EulerXyz::from_deg([90.0, 0.0, 90.0]).to_matrix();
        assert!((r * Vector3::x() - Vector3::z()).norm() < 1e-12);
    }
}
