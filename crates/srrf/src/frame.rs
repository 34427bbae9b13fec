//! The frame in which a pair is registered: each cloud about a centre of its own, in the input's unit.

use nalgebra::Vector3;
use srrf_cloud::{CloudError, PointCloud, Rigid, Solid};

/// A cloud moved to its own centre, and where that is.
#[derive(Debug, Clone)]
pub struct Centred {
    /// The cloud about the origin.
    pub cloud: PointCloud,
    /// What was subtracted.
    pub centre: Vector3<f64>,
}

impl Centred {
    /// Moves `cloud` to the middle of its bounding box, which, unlike a sum over millions of large
    /// coordinates, is exact to the last digit.
    ///
    /// # Errors
    /// [`CloudError`] for a cloud that spans more than the largest number.
    pub fn new(cloud: &PointCloud) -> Result<Self, CloudError> {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in cloud.points() {
            for c in 0..3 {
                low[c] = low[c].min(p[c]);
                high[c] = high[c].max(p[c]);
            }
        }
        let centre: [f64; 3] = std::array::from_fn(|c| low[c] / 2.0 + high[c] / 2.0);
        let moved = cloud.points().iter().map(|p| std::array::from_fn(|c| p[c] - centre[c])).collect();
        Ok(Self { cloud: PointCloud::new(moved)?, centre: centre.into() })
    }

    /// The centred cloud, checked to determine a rotation.
    ///
    /// # Errors
    /// As [`Solid::new`].
    pub fn solid(&self) -> Result<Solid<'_>, CloudError> {
        Solid::new(&self.cloud)
    }
}

/// A pose between the inputs, from one between the centred clouds.
pub fn to_input(pose: &Rigid, source: &Centred, target: &Centred) -> Rigid {
    let translation = (target.centre - pose.rotation * source.centre) + pose.translation;
    Rigid { rotation: pose.rotation, translation }
}

/// A pose between the centred clouds, from one between the inputs.
pub fn from_input(pose: &Rigid, source: &Centred, target: &Centred) -> Rigid {
    let translation = (pose.rotation * source.centre - target.centre) + pose.translation;
    Rigid { rotation: pose.rotation, translation }
}

#[cfg(test)]
mod tests {
    use srrf_cloud::EulerXyz;

    use super::*;

    #[test]
    fn poses_come_back_far_from_the_origin() {
        let points = vec![[5e5, 4e6, 120.0], [5e5 + 2.0, 4e6 + 1.0, 121.5], [5e5 - 1.0, 4e6 + 3.0, 119.0]];
        let source = PointCloud::new(points).unwrap();
        let motion = Rigid {
            rotation: EulerXyz::from_deg([1.0, 2.0, 30.0]).to_matrix(),
            translation: [3e5, -2e5, 4.0].into(),
        };
        let target = source.transformed(&motion);
        let (s, t) = (Centred::new(&source).unwrap(), Centred::new(&target).unwrap());
        assert!(s.cloud.points().iter().flatten().all(|v| v.abs() < 3.0));
        let local = from_input(&motion, &s, &t);
        for (a, b) in s.cloud.points().iter().zip(t.cloud.points()) {
            assert!((Vector3::from(local.apply(a)) - Vector3::from(*b)).norm() < 1e-8);
        }
        let back = to_input(&local, &s, &t);
        assert!((back.to_matrix4() - motion.to_matrix4()).norm() < 1e-8);
    }
}
