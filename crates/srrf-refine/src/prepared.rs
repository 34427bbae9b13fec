//! [`RefineCloud`]: a cloud centred, thinned, indexed, with normals.

use nalgebra::Vector3;
use srrf_cloud::{CloudError, KnnIndex, PairFrame, PointCloud, Solid, estimate_normals, spacing_of, thin_to};

use crate::RefineConfig;

/// One resolution of a cloud.
#[derive(Debug)]
pub(crate) struct CloudLevel {
    /// The centred points and their tree.
    pub index: KnnIndex,
    /// Unit normals, one a point.
    pub normals: Vec<Vector3<f64>>,
    /// Median distance to the nearest other point.
    pub spacing: f64,
}

impl CloudLevel {
    fn new(points: &[[f64; 3]], neighbours: usize) -> Result<Self, CloudError> {
        let index = KnnIndex::new(points)?;
        let normals = estimate_normals(points, neighbours)?.into_iter().map(Vector3::from).collect();
        let spacing = spacing_of(&index);
        Ok(Self { index, normals, spacing })
    }

    /// Shape `[n, 3]`.
    pub fn points(&self) -> &[[f64; 3]] {
        self.index.points()
    }
}

/// A cloud made ready for refinement.
#[derive(Debug)]
pub(crate) struct RefineCloud {
    /// Mean of the points, in the coordinates of the input; levels are relative to it.
    pub centre: Vector3<f64>,
    /// Root mean square distance of the points from the centre.
    pub radius: f64,
    /// Few points, for starts and first iterations; `None` where the cloud is small anyway.
    coarse: Option<CloudLevel>,
    fine: CloudLevel,
}

impl RefineCloud {
    pub fn new(cloud: Solid<'_>, config: &RefineConfig) -> Result<Self, CloudError> {
        let centre = cloud.centroid();
        let centred: Vec<[f64; 3]> =
            cloud.points().iter().map(|p| (Vector3::from(*p) - centre).into()).collect();
        let squares: f64 = centred.iter().map(|p| Vector3::from(*p).norm_squared()).sum();
        let radius = (squares / centred.len() as f64).sqrt();
        let centred = PointCloud::new(centred)?;
        let level =
            |most| CloudLevel::new(thin_to(&centred, most, radius).points(), config.normal_neighbours);
        let fine = level(config.max_points)?;
        let coarse = if fine.points().len() > config.coarse_points {
            Some(level(config.coarse_points)?)
        } else {
            None
        };
        Ok(Self { centre, radius, coarse, fine })
    }

    /// The frame of this cloud as the source, and of `target`: both about their means.
    pub fn frame_to(&self, target: &Self) -> PairFrame {
        PairFrame::about(self.centre, target.centre)
    }

    /// A cloud of tests, with the default settings.
    #[cfg(test)]
    pub fn of(cloud: &PointCloud) -> Self {
        Self::new(Solid::new(cloud).unwrap(), &RefineConfig::default()).unwrap()
    }

    pub fn coarse(&self) -> &CloudLevel {
        self.coarse.as_ref().unwrap_or(&self.fine)
    }

    pub fn fine(&self) -> &CloudLevel {
        &self.fine
    }

    pub fn has_coarse(&self) -> bool {
        self.coarse.is_some()
    }
}
