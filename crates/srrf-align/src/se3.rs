//! Motions near each other: the exponential map of SE(3), its inverse, the adjoint and the left Jacobian.
//!
//! A twist holds the rotation first (radians), then the translation. Source: Barfoot, "State estimation for robotics",
//! 2017, sections 7.1 and 7.2, with the two halves of the twist swapped.

use nalgebra::{Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector3, Vector6};
use srrf_cloud::Rigid;

/// Below this angle (radians) series take over.
const SMALL: f64 = 1e-4;

/// The motion of a twist.
pub fn exp(twist: &Vector6<f64>) -> Rigid {
    let (turn, shift) = halves(twist);
    let angle = turn.norm();
    let cross = turn.cross_matrix();
    let (first, second) = if angle < SMALL {
        (0.5 - angle * angle / 24.0, 1.0 / 6.0 - angle * angle / 120.0)
    } else {
        ((1.0 - angle.cos()) / angle.powi(2), (angle - angle.sin()) / angle.powi(3))
    };
    let along = Matrix3::identity() + first * cross + second * cross * cross;
    Rigid { rotation: Rotation3::new(turn).into_inner(), translation: along * shift }
}

/// The twist of a motion, its rotation at most half a turn.
pub fn log(motion: &Rigid) -> Vector6<f64> {
    let rotation = Rotation3::from_matrix_unchecked(motion.rotation);
    let turn = UnitQuaternion::from_rotation_matrix(&rotation).scaled_axis();
    let angle = turn.norm();
    let cross = turn.cross_matrix();
    let second = if angle < SMALL {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        let half = 0.5 * angle;
        (1.0 - half * half.cos() / half.sin()) / (angle * angle)
    };
    let back = Matrix3::identity() - 0.5 * cross + second * cross * cross;
    join(&turn, &(back * motion.translation))
}

/// The adjoint: `motion exp(x) motion^-1 = exp(adjoint(motion) x)`.
pub fn adjoint(motion: &Rigid) -> Matrix6<f64> {
    let mut out = Matrix6::zeros();
    out.fixed_view_mut::<3, 3>(0, 0).copy_from(&motion.rotation);
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(&motion.rotation);
    out.fixed_view_mut::<3, 3>(3, 0).copy_from(&(motion.translation.cross_matrix() * motion.rotation));
    out
}

/// The inverse of the left Jacobian: `log(exp(d) exp(x)) ~ x + inverse_left_jacobian(x) d` for small `d`.
/// `None` where it does not exist (turns by a whole turn).
pub fn inverse_left_jacobian(twist: &Vector6<f64>) -> Option<Matrix6<f64>> {
    let (turn, shift) = halves(twist);
    let mut ad = Matrix6::zeros();
    let cross = turn.cross_matrix();
    ad.fixed_view_mut::<3, 3>(0, 0).copy_from(&cross);
    ad.fixed_view_mut::<3, 3>(3, 3).copy_from(&cross);
    ad.fixed_view_mut::<3, 3>(3, 0).copy_from(&shift.cross_matrix());
    // The left Jacobian is sum ad^n / (n + 1)!, which converges everywhere.
    let (mut sum, mut term) = (Matrix6::identity(), Matrix6::identity());
    for n in 1..60 {
        term = term * ad / f64::from(n + 1);
        sum += term;
        if term.amax() < 1e-17 * sum.amax() {
            break;
        }
    }
    sum.try_inverse()
}

/// Rotation and translation of a twist.
pub fn halves(twist: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (twist.fixed_rows::<3>(0).into_owned(), twist.fixed_rows::<3>(3).into_owned())
}

fn join(turn: &Vector3<f64>, shift: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
}

/// A pure translation.
pub fn shift(by: &Vector3<f64>) -> Rigid {
    Rigid { translation: *by, ..Rigid::identity() }
}

/// How far a motion moves the points of a body: the root mean square over a body of this `radius` (root mean square) whose mean is
/// at the origin.
pub fn displacement(motion: &Rigid, radius: f64) -> f64 {
    let angle = motion.angle_to_deg(&Rigid::identity()).to_radians();
    // A point at a distance r from the axis moves by 2 sin(angle / 2) r; over a ball two thirds of r^2 are across the axis.
    let turn = 2.0 * (0.5 * angle).sin() * radius * (2.0f64 / 3.0).sqrt();
    turn.hypot(motion.translation.norm())
}

/// The nearest motion: products of many rotations drift by rounding.
pub fn tidied(motion: &Rigid) -> Rigid {
    let rotation = Rigid::nearest_rotation(&motion.rotation).unwrap_or(motion.rotation);
    Rigid { rotation, ..*motion }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn twists() -> Vec<Vector6<f64>> {
        let mut all: Vec<Vector6<f64>> = (0..9)
            .map(|i| {
                let s = f64::from(i);
                Vector6::new(s.sin(), (1.3 * s).cos(), 0.4 * s - 1.0, 3.0 * s, -2.0, (0.7 * s).sin())
            })
            .collect();
        all.push(Vector6::new(1e-7, 0.0, -2e-6, 1.0, 2.0, 3.0));
        all.push(Vector6::zeros());
        all
    }

    fn near(a: &Rigid, b: &Rigid) -> f64 {
        (a.to_matrix4() - b.to_matrix4()).norm()
    }

    #[test]
    fn exp_and_log_undo_each_other() {
        for twist in twists() {
            let motion = exp(&twist);
            assert!(near(&exp(&log(&motion)), &motion) < 1e-9, "{twist}");
            if twist.fixed_rows::<3>(0).norm() < 3.1 {
                assert!((log(&motion) - twist).norm() < 1e-8, "{twist}");
            }
        }
        // Nearly half a turn.
        let half = exp(&Vector6::new(0.0, std::f64::consts::PI - 1e-7, 0.0, 1.0, 0.0, 2.0));
        assert!(near(&exp(&log(&half)), &half) < 1e-6);
    }

    #[test]
    fn adjoint_carries_a_twist_through_a_motion() {
        let (motion, small) = (exp(&twists()[3]), 0.1 * twists()[5]);
        let left = motion.compose(&exp(&small)).compose(&motion.inverse());
        assert!(near(&left, &exp(&(adjoint(&motion) * small))) < 1e-9);
    }

    #[test]
    fn jacobian_agrees_with_finite_differences() {
        for twist in twists() {
            // Where the turn is more than half a turn, log wraps.
            if twist.fixed_rows::<3>(0).norm() > 3.0 {
                continue;
            }
            let jacobian = inverse_left_jacobian(&twist).unwrap();
            let motion = exp(&twist);
            for i in 0..6 {
                let h = 1e-6 * Vector6::ith(i, 1.0);
                let slope = (log(&exp(&h).compose(&motion)) - log(&exp(&-h).compose(&motion))) / 2e-6;
                assert!((slope - jacobian.column(i)).norm() < 1e-6, "{twist} {i}");
            }
        }
    }

    #[test]
    fn displacement_is_that_of_the_points() {
        // The corners of a cube of radius sqrt(3), turned about an axis through opposite corners and shifted.
        let corners = (0..8).map(|i| Vector3::from_fn(|c, _| if i >> c & 1 == 1 { 1.0 } else { -1.0 }));
        let motion = Rigid {
            rotation: Rotation3::new(Vector3::new(0.2, 0.2, 0.2)).into_inner(),
            translation: Vector3::new(0.3, -0.1, 0.2),
        };
        let squares: f64 =
            corners.map(|p| (Vector3::from(motion.apply(&p.into())) - p).norm_squared()).sum::<f64>() / 8.0;
        assert!((squares.sqrt() - displacement(&motion, 3f64.sqrt())).abs() < 1e-12);
    }
}
