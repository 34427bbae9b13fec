//! [`CentredCloud`]: a cloud about the middle of its box.

use nalgebra::Vector3;

use crate::{CloudError, PairFrame, PointCloud, Solid};

/// A cloud that determines a rotation, moved to the middle of its bounding box: map coordinates become small numbers and
/// keep their digits.
#[derive(Debug, Clone, PartialEq)]
pub struct CentredCloud {
    cloud: PointCloud,
    origin: Vector3<f64>,
}

impl CentredCloud {
    /// Moves and checks `cloud`.
    ///
    /// # Errors
    /// As [`Solid::new`]; [`CloudError::NotFinite`] for a cloud that spans more than the largest number.
    pub fn new(cloud: &PointCloud) -> Result<Self, CloudError> {
        let origin = cloud.middle();
        let moved = cloud.points().iter().map(|p| std::array::from_fn(|c| p[c] - origin[c])).collect();
        let cloud = PointCloud::new(moved)?;
        Solid::new(&cloud)?;
        Ok(Self { cloud, origin })
    }

    /// The cloud about the origin.
    pub fn cloud(&self) -> Solid<'_> {
        Solid::promised(&self.cloud)
    }

    /// What was subtracted: the middle of the bounding box.
    pub fn origin(&self) -> Vector3<f64> {
        self.origin
    }

    /// The frame of this cloud as the source, and of `target`.
    pub fn frame_to(&self, target: &Self) -> PairFrame {
        PairFrame::about_far(self.origin, target.origin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_numbers_on_a_map_and_the_way_back() {
        let points = vec![[5e5, 4e6, 120.0], [5e5 + 2.0, 4e6 + 1.0, 121.5], [5e5 - 1.0, 4e6 + 3.0, 119.0]];
        let cloud = PointCloud::new(points).unwrap();
        let centred = CentredCloud::new(&cloud).unwrap();
        assert!(centred.cloud().points().iter().flatten().all(|v| v.abs() < 2.0));
        let frame = centred.frame_to(&centred);
        for (local, p) in centred.cloud().points().iter().zip(cloud.points()) {
            assert_eq!(&frame.undo_source(local), p);
            assert_eq!(&frame.source(p), local);
        }
    }

    #[test]
    fn lines_and_too_wide_clouds_are_refused() {
        let line = PointCloud::new((0..9).map(|i| [f64::from(i), 0.0, 4e6]).collect()).unwrap();
        assert_eq!(CentredCloud::new(&line), Err(CloudError::Collinear));
        let few = PointCloud::new(vec![[0.0; 3], [1.0; 3]]).unwrap();
        assert_eq!(CentredCloud::new(&few), Err(CloudError::TooFew { have: 2, need: 3 }));
    }
}
