//! [`FpfhCloud`]: a cloud made ready for matching by features, once for many pairs.

use std::borrow::Cow;
use std::sync::Arc;

use srrf_cloud::{
    CloudError, PointCloud, RegisterError, Solid, VoxelError, point_spacing, voxel_downsample_to,
};

use crate::fpfh::{Descriptor, NeighbourChoice, Oriented};
use crate::memo::Memo;

/// Thinned clouds that are kept with their descriptors: a pair uses one.
const KEPT_LEVELS: usize = 8;
/// Radii of the features that are kept.
const KEPT_RADII: usize = 4;
/// Sizes of voxels that are known to leave too many points.
const KEPT_COUNTS: usize = 256;

/// A cloud made ready for [`FpfhRansac::hypotheses`](crate::FpfhRansac::hypotheses). It is thinned and described as pairs
/// ask for it, and keeps what it made: a target serves many sources, from many threads, and a pair many radii. What is kept
/// changes no answer.
#[derive(Debug)]
pub struct FpfhCloud<'a> {
    cloud: Cow<'a, PointCloud>,
    spacing: f64,
    /// How many points a size of voxels was found to leave more than.
    too_fine: Memo<u64, usize>,
    levels: Memo<u64, ThinCloud>,
}

/// A cloud thinned by voxels of one size.
#[derive(Debug)]
pub(crate) struct ThinCloud {
    /// Shape `[n, 3]`.
    pub points: Vec<[f64; 3]>,
    oriented: Memo<(), Oriented>,
    described: Memo<(u64, NeighbourChoice), Vec<Descriptor>>,
}

impl<'a> FpfhCloud<'a> {
    /// Measures the spacing of `cloud`.
    ///
    /// # Errors
    /// Those of [`point_spacing`], of which clouds have none.
    pub fn new(cloud: Solid<'a>) -> Result<Self, CloudError> {
        Ok(Self {
            spacing: point_spacing(cloud.points())?,
            cloud: Cow::Borrowed(cloud.cloud()),
            too_fine: Memo::new(KEPT_COUNTS),
            levels: Memo::new(KEPT_LEVELS),
        })
    }

    /// The clouds of a pair.
    ///
    /// # Errors
    /// As [`FpfhCloud::new`], by side.
    pub fn pair(source: Solid<'a>, target: Solid<'a>) -> Result<(Self, Self), RegisterError> {
        let source = Self::new(source).map_err(RegisterError::Source)?;
        Ok((source, Self::new(target).map_err(RegisterError::Target)?))
    }

    /// The same with a copy of the cloud, to keep it.
    pub fn into_owned(self) -> FpfhCloud<'static> {
        FpfhCloud {
            cloud: Cow::Owned(self.cloud.into_owned()),
            spacing: self.spacing,
            too_fine: self.too_fine,
            levels: self.levels,
        }
    }

    /// Median distance between neighbours.
    pub(crate) fn spacing(&self) -> f64 {
        self.spacing
    }

    /// The cloud thinned by voxels of side `voxel`; `None` where more than `most` points are left.
    pub(crate) fn thinned(&self, voxel: f64, most: usize) -> Result<Option<Arc<ThinCloud>>, VoxelError> {
        let key = voxel.to_bits();
        let fits = |level: Arc<ThinCloud>| (level.points.len() <= most).then_some(level);
        if let Some(level) = self.levels.find(&key) {
            return Ok(fits(level));
        }
        if self.too_fine.find(&key).is_some_and(|tried| *tried >= most) {
            return Ok(None);
        }
        let Some(thin) = voxel_downsample_to(&self.cloud, voxel, most)? else {
            self.too_fine.keep(key, most);
            return Ok(None);
        };
        let level = ThinCloud {
            points: thin.into_points(),
            oriented: Memo::new(1),
            described: Memo::new(KEPT_RADII),
        };
        Ok(fits(self.levels.keep(key, level)))
    }
}

impl ThinCloud {
    /// The descriptors within `radius`, one a point.
    ///
    /// # Errors
    /// [`CloudError::TooFew`] under 3 points.
    pub fn described(&self, radius: f64, of: NeighbourChoice) -> Result<Arc<Vec<Descriptor>>, CloudError> {
        self.described.get((radius.to_bits(), of), || {
            let oriented = self.oriented.get((), || Oriented::new(&self.points))?;
            Ok(oriented.describe(radius, of))
        })
    }
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    use srrf_cloud::voxel_downsample;

    use super::*;
    use crate::fpfh::fpfh;

    fn cloud(n: usize) -> PointCloud {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        PointCloud::new((0..n).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect())
            .unwrap()
    }

    #[test]
    fn what_is_kept_is_what_would_be_made() {
        let cloud = cloud(701);
        let ready = FpfhCloud::new(Solid::new(&cloud).unwrap()).unwrap().into_owned();
        for voxel in [0.3, 0.2, 0.3] {
            let level = ready.thinned(voxel, 700).unwrap().unwrap();
            let thin = voxel_downsample(&cloud, voxel).unwrap();
            assert_eq!(level.points, thin.points());
            for radius in [0.5, 0.4, 0.5] {
                assert_eq!(
                    *level.described(radius, NeighbourChoice::Nearest).unwrap(),
                    fpfh(thin.points(), radius).unwrap()
                );
            }
        }
        let (one, two) =
            (ready.thinned(0.3, 700).unwrap().unwrap(), ready.thinned(0.3, 700).unwrap().unwrap());
        assert!(Arc::ptr_eq(&one, &two), "thinned once");
        let described = |level: &ThinCloud| level.described(0.5, NeighbourChoice::Nearest).unwrap();
        assert!(Arc::ptr_eq(&described(&one), &described(&two)), "described once");
    }

    #[test]
    fn what_is_kept_does_not_decide_what_is_too_many() {
        let cloud = cloud(701);
        let ready = FpfhCloud::new(Solid::new(&cloud).unwrap()).unwrap();
        let count = voxel_downsample(&cloud, 0.3).unwrap().len();
        for most in [count - 1, count, count - 1, count + 1] {
            assert_eq!(ready.thinned(0.3, most).unwrap().is_some(), count <= most, "{most}");
        }
        assert_eq!(ready.thinned(0.0, 9).unwrap_err(), VoxelError::Size(0.0));
    }
}
