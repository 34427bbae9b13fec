//! [`PointCloud`]: a checked list of points.

use nalgebra::Vector3;

use crate::Rigid;

/// Why a list of points is not a usable cloud.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CloudError {
    /// There are no points.
    #[error("the cloud is empty")]
    Empty,
    /// A coordinate is NaN or infinite.
    #[error("point {index} has a coordinate that is not finite: {point:?}")]
    NotFinite {
        /// Index of the first such point.
        index: usize,
        /// Its coordinates.
        point: [f64; 3],
    },
    /// Too few points for what was asked.
    #[error("the cloud has {have} points, at least {need} are needed")]
    TooFew {
        /// Number of points there are.
        have: usize,
        /// Number of points needed.
        need: usize,
    },
    /// All points lie on one line (or coincide), so that no rotation can be found.
    #[error("the points lie on one line (or coincide): a rotation cannot be determined from them")]
    Collinear,
    /// The cloud is too large or too small to compute with: squares of its lengths would be lost.
    #[error("the cloud is {size:e} wide: lengths from 1e-100 to 1e100 can be computed with")]
    OutOfRange {
        /// Largest side of its bounding box, unit of the points.
        size: f64,
    },
    /// Some points lie so far out that the others would coincide.
    #[error(
        "{count} of the points lie over a billion times farther out than half of the cloud (the first is point {index}, {point:?}): \
         the others lose their digits"
    )]
    Stray {
        /// How many.
        count: usize,
        /// Index of the first.
        index: usize,
        /// Its coordinates.
        point: [f64; 3],
    },
}

/// A non-empty cloud of finite points, in the unit of its source.
#[derive(Debug, Clone, PartialEq)]
pub struct PointCloud {
    points: Vec<[f64; 3]>,
}

impl PointCloud {
    /// Checks `points` (shape `[n, 3]`) and takes them.
    ///
    /// # Errors
    /// [`CloudError::Empty`] without points, [`CloudError::NotFinite`] at the first NaN or infinity.
    pub fn new(points: Vec<[f64; 3]>) -> Result<Self, CloudError> {
        if points.is_empty() {
            return Err(CloudError::Empty);
        }
        match points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
            Some(index) => Err(CloudError::NotFinite { index, point: points[index] }),
            None => Ok(Self { points }),
        }
    }

    /// Takes points that are known to be finite, at least one.
    pub(crate) fn from_finite(points: Vec<[f64; 3]>) -> Self {
        debug_assert!(!points.is_empty() && points.iter().flatten().all(|c| c.is_finite()));
        Self { points }
    }

    /// The points, shape `[n, 3]`.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// The points, moved out.
    pub fn into_points(self) -> Vec<[f64; 3]> {
        self.points
    }

    /// Number of points, at least 1.
    #[allow(clippy::len_without_is_empty, reason = "a cloud is never empty")]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Mean of the points.
    pub fn centroid(&self) -> Vector3<f64> {
        self.points.iter().map(|p| Vector3::from(*p)).sum::<Vector3<f64>>() / self.len() as f64
    }

    /// Middle of the bounding box: unlike a mean over millions of large coordinates, it is exact to the last digit.
    pub fn middle(&self) -> Vector3<f64> {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in &self.points {
            for c in 0..3 {
                low[c] = low[c].min(p[c]);
                high[c] = high[c].max(p[c]);
            }
        }
        std::array::from_fn::<f64, 3, _>(|c| low[c] / 2.0 + high[c] / 2.0).into()
    }

    /// The cloud moved by `pose`: each point `p` becomes `R p + t`.
    pub fn transformed(&self, pose: &Rigid) -> Self {
        Self { points: self.points.iter().map(|p| pose.apply(p)).collect() }
    }

    /// The cloud with its coordinates multiplied by `factor`, as for another unit of length.
    ///
    /// # Errors
    /// [`CloudError::NotFinite`] where a coordinate becomes too large, or the factor is NaN or infinite.
    pub fn scaled(&self, factor: f64) -> Result<Self, CloudError> {
        Self::new(self.points.iter().map(|p| p.map(|c| c * factor)).collect())
    }

    /// The cloud centred on its mean and scaled so that its farthest point has norm 1, with what
    /// is needed to undo it.
    ///
    /// A cloud of coinciding points is centred and keeps scale 1.
    pub fn to_unit_sphere(&self) -> (Self, UnitSphere) {
        let centre = self.centroid();
        let radius = self.points.iter().map(|p| (Vector3::from(*p) - centre).norm()).fold(0.0, f64::max);
        let frame = UnitSphere { centre, radius: if radius > 0.0 { radius } else { 1.0 } };
        (Self { points: self.points.iter().map(|p| frame.apply(p)).collect() }, frame)
    }
}

/// The frame in which a cloud is centred on its mean and has radius 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitSphere {
    /// Mean of the original points, original unit.
    pub centre: Vector3<f64>,
    /// Distance of the farthest original point from the mean, original unit; never 0.
    pub radius: f64,
}

impl UnitSphere {
    /// Original coordinates to unit-sphere coordinates.
    pub fn apply(&self, point: &[f64; 3]) -> [f64; 3] {
        ((Vector3::from(*point) - self.centre) / self.radius).into()
    }

    /// Unit-sphere coordinates back to original coordinates.
    pub fn undo(&self, point: &[f64; 3]) -> [f64; 3] {
        (Vector3::from(*point) * self.radius + self.centre).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_what_is_not_a_cloud() {
        assert_eq!(PointCloud::new(vec![]), Err(CloudError::Empty));
        let bad = PointCloud::new(vec![[0.0; 3], [0.0, f64::NAN, 1.0]]);
        assert!(matches!(bad, Err(CloudError::NotFinite { index: 1, .. })));
    }

    #[test]
    fn scaled_for_another_unit() {
        let cloud = PointCloud::new(vec![[1.0, -2.0, 3.5], [1e300, 0.0, 0.0]]).unwrap();
        assert_eq!(cloud.scaled(0.5).unwrap().points(), [[0.5, -1.0, 1.75], [5e299, 0.0, 0.0]]);
        assert!(matches!(cloud.scaled(1e9), Err(CloudError::NotFinite { index: 1, .. })));
        assert!(cloud.scaled(f64::NAN).is_err());
    }

    #[test]
    fn unit_sphere_is_undone() {
        let cloud =
            PointCloud::new(vec![[500_000.0, 2.0, 3.0], [500_004.0, 2.5, 9.0], [500_001.0, -7.0, 3.0]])
                .unwrap();
        let (unit, frame) = cloud.to_unit_sphere();
        let largest = unit.points().iter().map(|p| Vector3::from(*p).norm()).fold(0.0, f64::max);
        assert!((largest - 1.0).abs() < 1e-12);
        for (p, q) in cloud.points().iter().zip(unit.points()) {
            let back = frame.undo(q);
            assert!((0..3).all(|c| (back[c] - p[c]).abs() < 1e-9));
        }
    }
}
