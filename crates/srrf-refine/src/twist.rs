//! [`Twist`]: a motion in one of the six directions of a rigid pose.

use nalgebra::{Matrix3, Rotation3, Vector3, Vector6};
use serde::Serialize;
use srrf_cloud::Rigid;

/// What kind of motion a twist is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MotionKind {
    /// A translation along a direction.
    Slide,
    /// A rotation about an axis.
    Turn,
    /// A rotation about an axis with a translation along it.
    Screw,
}

/// Motions that turn by less than this share of what they shift count as slides.
const SLIDE: f64 = 0.2;
/// Motions that shift along their axis by less than this share of what they turn count as turns.
const TURN: f64 = 0.05;

/// A constant motion in the target frame: `step` of it turns by `step * rotation` (radians) about `centre`, and shifts by
/// `step * translation` along the way. Unit of the clouds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Twist {
    /// Axis times radians for each step.
    pub rotation: Vector3<f64>,
    /// Velocity of `centre` for each step.
    pub translation: Vector3<f64>,
    /// What the two are about.
    pub centre: Vector3<f64>,
}

impl Twist {
    /// From six numbers, the rotation times `radius` first: a step of a unit vector moves points that lie `radius` from the centre by
    /// about 1.
    pub(crate) fn scaled(numbers: &Vector6<f64>, radius: f64, centre: Vector3<f64>) -> Self {
        let [x, y, z, a, b, c]: [f64; 6] = (*numbers).into();
        Self { rotation: Vector3::new(x, y, z) / radius, translation: Vector3::new(a, b, c), centre }
    }

    /// The motion after `step`.
    pub fn at(&self, step: f64) -> Rigid {
        let w = self.rotation * step;
        let turn = Rotation3::new(w).into_inner();
        let angle = w.norm();
        let hat = w.cross_matrix();
        // Exponential map of SE(3), with its series near zero.
        let (first, second) = if angle < 1e-4 {
            (0.5 - angle * angle / 24.0, 1.0 / 6.0 - angle * angle / 120.0)
        } else {
            ((1.0 - angle.cos()) / angle.powi(2), (angle - angle.sin()) / angle.powi(3))
        };
        let along = Matrix3::identity() + first * hat + second * hat * hat;
        let translation = self.centre - turn * self.centre + along * self.translation * step;
        Rigid { rotation: turn, translation }
    }

    /// The same motion, of clouds whose target stands `by` farther.
    pub fn shifted(&self, by: &Vector3<f64>) -> Self {
        Self { centre: self.centre + by, ..*self }
    }

    /// What kind of motion it is for clouds of this radius.
    pub fn kind(&self, radius: f64) -> MotionKind {
        let turned = self.rotation.norm() * radius;
        let along = self.pitch().abs() * self.rotation.norm();
        if turned < SLIDE * self.translation.norm() {
            MotionKind::Slide
        } else if along < TURN * turned {
            MotionKind::Turn
        } else {
            MotionKind::Screw
        }
    }

    /// Unit vector of the axis, or of the direction of a slide.
    pub fn direction(&self, kind: MotionKind) -> Vector3<f64> {
        let along = if kind == MotionKind::Slide { self.translation } else { self.rotation };
        along.try_normalize(0.0).unwrap_or_else(Vector3::z)
    }

    /// The point of the axis that is nearest to the centre.
    pub fn axis_point(&self) -> Vector3<f64> {
        let squared = self.rotation.norm_squared();
        let aside =
            if squared > 0.0 { self.rotation.cross(&self.translation) / squared } else { Vector3::zeros() };
        self.centre + aside
    }

    /// Translation along the axis for each radian; 0 without a rotation.
    pub fn pitch(&self) -> f64 {
        let squared = self.rotation.norm_squared();
        if squared > 0.0 { self.rotation.dot(&self.translation) / squared } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_screw_about_an_axis_beside_the_centre() {
        // About the line through (2, 0, 0) along z, 3 up for each radian.
        let twist = Twist {
            rotation: Vector3::z(),
            translation: Vector3::new(0.0, -2.0, 3.0),
            centre: Vector3::zeros(),
        };
        assert!((twist.axis_point() - Vector3::new(2.0, 0.0, 0.0)).norm() < 1e-12);
        assert!((twist.pitch() - 3.0).abs() < 1e-12);
        assert_eq!(twist.kind(1.0), MotionKind::Screw);
        assert_eq!(twist.kind(100.0), MotionKind::Turn);
        let half = twist.at(std::f64::consts::PI);
        let moved: Vector3<f64> = half.apply(&[0.0, 0.0, 0.0]).into();
        let want = Vector3::new(4.0, 0.0, 3.0 * std::f64::consts::PI);
        assert!((moved - want).norm() < 1e-9, "{moved}");
        let there = twist.shifted(&Vector3::x()).at(0.7).apply(&[1.0, 0.0, 0.0]);
        let here = Vector3::from(twist.at(0.7).apply(&[0.0; 3])) + Vector3::x();
        assert!((Vector3::from(there) - here).norm() < 1e-12);
    }

    #[test]
    fn small_steps_are_those_of_the_series() {
        let twist = Twist {
            rotation: Vector3::new(0.3, -0.2, 0.9),
            translation: Vector3::new(1.0, 2.0, -1.0),
            centre: Vector3::new(5.0, 1.0, 2.0),
        };
        let twice = twist.at(4e-5).compose(&twist.at(4e-5)).compose(&twist.at(4e-5));
        let once = twist.at(1.2e-4);
        assert!((twice.rotation - once.rotation).norm() < 1e-12);
        assert!((twice.translation - once.translation).norm() < 1e-12);
        assert_eq!(Twist { rotation: Vector3::zeros(), ..twist }.kind(1.0), MotionKind::Slide);
    }
}
