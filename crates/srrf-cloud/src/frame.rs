//! [`PairFrame`]: the coordinates in which a pair is worked on, and the way back.

use nalgebra::Vector3;

use crate::{PointCloud, Rigid};

/// Where the clouds of a pair lie while they are worked on: each about an origin of its own, both divided by one scale,
/// so that a rotation stays what it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairFrame {
    source_origin: Vector3<f64>,
    target_origin: Vector3<f64>,
    scale: f64,
    order: Order,
}

/// Which two of the three terms of a translation are added first. Both are right but for the last digit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    /// The turned origin of the source joins the translation: what weights were trained and tables made with.
    Translation,
    /// The two origins meet: on map coordinates they nearly cancel, and a small translation keeps its digits.
    Origins,
}

impl PairFrame {
    /// The frame about two origins (such as the means of the clouds), in the unit of the clouds.
    pub fn about(source_origin: Vector3<f64>, target_origin: Vector3<f64>) -> Self {
        Self { source_origin, target_origin, scale: 1.0, order: Order::Translation }
    }

    /// As [`PairFrame::about`], for origins of any size, such as map coordinates (see [`PointCloud::middle`]).
    pub fn about_far(source_origin: Vector3<f64>, target_origin: Vector3<f64>) -> Self {
        Self { order: Order::Origins, ..Self::about(source_origin, target_origin) }
    }

    /// The frame in which each cloud has its mean at the origin, and both together have the root mean square radius
    /// `radius`. Clouds of coinciding points keep their scale.
    pub fn with_radius(source: &PointCloud, target: &PointCloud, radius: f64) -> Self {
        let (source_mean, target_mean) = (source.centroid(), target.centroid());
        let mean_square = |cloud: &PointCloud, mean: Vector3<f64>| {
            cloud.points().iter().map(|p| (Vector3::from(*p) - mean).norm_squared()).sum::<f64>()
                / cloud.len() as f64
        };
        let rms = ((mean_square(source, source_mean) + mean_square(target, target_mean)) / 2.0).sqrt();
        let scale = if rms > 0.0 { rms / radius } else { 1.0 };
        Self { scale, ..Self::about(source_mean, target_mean) }
    }

    /// A point of the source, in this frame.
    pub fn source(&self, point: &[f64; 3]) -> [f64; 3] {
        ((Vector3::from(*point) - self.source_origin) / self.scale).into()
    }

    /// A point of the target, in this frame.
    pub fn target(&self, point: &[f64; 3]) -> [f64; 3] {
        ((Vector3::from(*point) - self.target_origin) / self.scale).into()
    }

    /// A pose between the clouds, in this frame.
    pub fn pose(&self, target_from_source: &Rigid) -> Rigid {
        let Rigid { rotation, translation } = *target_from_source;
        let turned = rotation * self.source_origin;
        let translation = match self.order {
            Order::Translation => translation + turned - self.target_origin,
            Order::Origins => (turned - self.target_origin) + translation,
        };
        Rigid { rotation, translation: translation / self.scale }
    }

    /// A source point of this frame, in the coordinates of the source.
    pub fn undo_source(&self, point: &[f64; 3]) -> [f64; 3] {
        (Vector3::from(*point) * self.scale + self.source_origin).into()
    }

    /// A target point of this frame, in the coordinates of the target.
    pub fn undo_target(&self, point: &[f64; 3]) -> [f64; 3] {
        (Vector3::from(*point) * self.scale + self.target_origin).into()
    }

    /// A length of this frame, in the unit of the clouds.
    pub fn undo_length(&self, length: f64) -> f64 {
        length * self.scale
    }

    /// A pose of this frame, between the clouds.
    pub fn undo_pose(&self, pose: &Rigid) -> Rigid {
        let Rigid { rotation, translation } = *pose;
        let (translation, turned) = (self.scale * translation, rotation * self.source_origin);
        let translation = match self.order {
            Order::Translation => translation + self.target_origin - turned,
            Order::Origins => (self.target_origin - turned) + translation,
        };
        Rigid { rotation, translation }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::EulerXyz;

    fn motion(translation: [f64; 3]) -> Rigid {
        Rigid { rotation: EulerXyz::from_deg([1.0, 2.0, 30.0]).to_matrix(), translation: translation.into() }
    }

    fn gap(a: [f64; 3], b: [f64; 3]) -> f64 {
        (Vector3::from(a) - Vector3::from(b)).norm()
    }

    fn cloud() -> PointCloud {
        let points = vec![[5e5, 4e6, 120.0], [5e5 + 2.0, 4e6 + 1.0, 121.5], [5e5 - 1.0, 4e6 + 3.0, 119.0]];
        PointCloud::new(points).unwrap()
    }

    #[test]
    fn points_and_poses_agree_and_come_back_in_every_frame() {
        let (source, truth) = (cloud(), motion([3e5, -2e5, 4.0]));
        let target = source.transformed(&truth);
        let frames = [
            PairFrame::about(source.centroid(), target.centroid()),
            PairFrame::about_far(source.middle(), target.middle()),
            PairFrame::with_radius(&source, &target, 0.6),
        ];
        for frame in frames {
            let local = frame.pose(&truth);
            for (p, q) in source.points().iter().zip(target.points()) {
                let (a, b) = (frame.source(p), frame.target(q));
                assert!(a.iter().all(|v| v.abs() < 4.0));
                assert!(gap(local.apply(&a), b) < 1e-8);
                assert!(gap(frame.undo_source(&a), *p) < 1e-8);
                assert!(gap(frame.undo_target(&b), *q) < 1e-8);
            }
            assert!((frame.undo_pose(&local).to_matrix4() - truth.to_matrix4()).norm() < 1e-8);
        }
    }

    #[test]
    fn the_radius_is_the_one_asked_for() {
        let (source, target) = (cloud(), cloud().transformed(&motion([1.0, 2.0, 3.0])));
        let frame = PairFrame::with_radius(&source, &target, 0.6);
        let squares = |points: Vec<[f64; 3]>| points.iter().flatten().map(|v| v * v).sum::<f64>();
        let a = squares(source.points().iter().map(|p| frame.source(p)).collect());
        let b = squares(target.points().iter().map(|p| frame.target(p)).collect());
        assert!((((a + b) / 6.0).sqrt() - 0.6).abs() < 1e-12);
        let (p, q) = (source.points()[0], source.points()[1]);
        let (length, local) = (gap(p, q), gap(frame.source(&p), frame.source(&q)));
        assert!((frame.undo_length(local) - length).abs() < 1e-9);
    }

    #[test]
    fn a_small_motion_keeps_its_digits_on_a_map() {
        let small = Rigid { translation: [1e-3, 0.0, 2e-3].into(), ..Rigid::identity() };
        let origin = Vector3::new(5e5, 4e6, 120.0);
        let frame = PairFrame::about_far(origin, origin);
        assert_eq!(frame.undo_pose(&frame.pose(&small)), small);
    }
}
