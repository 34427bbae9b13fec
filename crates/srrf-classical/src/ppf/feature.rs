//! [`PairFeature`]: what two oriented points are to each other, whatever the motion. [`LocalFrame`]: where the first of them stands.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use srrf_cloud::Rigid;

/// Bins of the distance, each one step wide.
const FAR: usize = 22;
/// Bins of the angle between the first normal and the way to the second point.
const FIRST: usize = 12;
/// Bins of the angles of the second normal, whose sign is not known.
const SECOND: usize = 6;
const BETWEEN: usize = 6;

/// Number of different keys.
pub(super) const KEYS: usize = FAR * FIRST * SECOND * BETWEEN;

/// Distance and angles of two oriented points (Drost et al. 2010, section 3.1). The second normal has no sign.
#[derive(Debug, Clone, Copy)]
pub(super) struct PairFeature {
    distance: f64,
    first: f64,
    second: f64,
    between: f64,
}

impl PairFeature {
    /// None of a point with itself.
    pub fn of(p: &Vector3<f64>, n: &Vector3<f64>, q: &Vector3<f64>, m: &Vector3<f64>) -> Option<Self> {
        let way = q - p;
        let distance = way.norm();
        let way = way.try_normalize(0.0)?;
        let angle = |cosine: f64| cosine.clamp(-1.0, 1.0).acos();
        Some(Self {
            distance,
            first: angle(n.dot(&way)),
            second: angle(m.dot(&way).abs()),
            between: angle(n.dot(m).abs()),
        })
    }

    /// Its bin; none where it is too far.
    pub fn key(&self, step: f64) -> Option<usize> {
        let bin =
            |value: f64, range: f64, bins: usize| ((value / range * bins as f64) as usize).min(bins - 1);
        let far = (self.distance / step) as usize;
        let angles = (bin(self.first, PI, FIRST) * SECOND + bin(self.second, FRAC_PI_2, SECOND)) * BETWEEN
            + bin(self.between, FRAC_PI_2, BETWEEN);
        (far < FAR).then_some(far * FIRST * SECOND * BETWEEN + angles)
    }
}

/// An oriented point as a frame of its own, whose x axis is the normal.
#[derive(Debug, Clone, Copy)]
pub(super) struct LocalFrame {
    origin: Vector3<f64>,
    /// Own from outer.
    rotation: Matrix3<f64>,
}

impl LocalFrame {
    pub fn at(point: &Vector3<f64>, normal: &Vector3<f64>) -> Self {
        let across = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
        let y = normal.cross(&across).normalize();
        let z = normal.cross(&y);
        Self {
            origin: *point,
            rotation: Matrix3::from_rows(&[normal.transpose(), y.transpose(), z.transpose()]),
        }
    }

    /// The turn about the normal from the y axis to a point, in (-pi, pi].
    pub fn turn(&self, other: &Vector3<f64>) -> f64 {
        let own = self.rotation * (other - self.origin);
        own.z.atan2(own.y)
    }

    /// The motion that lays `part` onto this frame, turned about the normal.
    pub fn onto(&self, part: &Self, turn: f64) -> Rigid {
        let about = Rotation3::from_axis_angle(&Unit::new_unchecked(Vector3::x()), turn);
        let rotation = self.rotation.transpose() * about.matrix() * part.rotation;
        Rigid { rotation, translation: self.origin - rotation * part.origin }
    }
}

#[cfg(test)]
mod tests {
    use srrf_cloud::EulerXyz;

    use super::*;

    fn motion() -> Rigid {
        let rotation = EulerXyz::from_deg([40.0, -110.0, 73.0]).to_matrix();
        Rigid { rotation, translation: [0.4, -2.0, 7.0].into() }
    }

    #[test]
    fn features_follow_any_motion_and_the_second_normal_has_no_sign() {
        let (p, q) = (Vector3::new(0.1, 0.2, 0.3), Vector3::new(0.5, -0.4, 0.9));
        let (n, m) = (Vector3::new(1.0, 2.0, -0.5).normalize(), Vector3::new(-0.3, 1.0, 0.7).normalize());
        let pose = motion();
        let moved = |v: &Vector3<f64>| Vector3::from(pose.apply(&(*v).into()));
        let key = |f: Option<PairFeature>| f.unwrap().key(0.06).unwrap();
        let own = key(PairFeature::of(&p, &n, &q, &m));
        assert_eq!(
            own,
            key(PairFeature::of(&moved(&p), &(pose.rotation * n), &moved(&q), &(pose.rotation * m)))
        );
        assert_eq!(own, key(PairFeature::of(&p, &n, &q, &-m)));
        assert_ne!(own, key(PairFeature::of(&p, &-n, &q, &m)));
        assert!(own < KEYS);
        assert_eq!(PairFeature::of(&p, &n, &q, &m).unwrap().key(0.03), None, "22 steps away");
        assert!(PairFeature::of(&p, &n, &p, &m).is_none());
    }

    #[test]
    fn a_frame_and_a_turn_give_the_motion_back() {
        let pose = motion();
        let (point, other) = (Vector3::new(0.3, 0.1, -0.2), Vector3::new(1.0, 0.7, 0.4));
        for normal in [Vector3::new(0.9, 0.1, 0.2).normalize(), Vector3::new(0.1, -1.0, 0.3).normalize()] {
            let moved = |v: &Vector3<f64>| Vector3::from(pose.apply(&(*v).into()));
            let (part, scene) =
                (LocalFrame::at(&point, &normal), LocalFrame::at(&moved(&point), &(pose.rotation * normal)));
            let turn = scene.turn(&moved(&other)) - part.turn(&other);
            let found = scene.onto(&part, turn);
            assert!(found.angle_to_deg(&pose) < 1e-5 && (found.translation - pose.translation).norm() < 1e-9);
        }
    }
}
