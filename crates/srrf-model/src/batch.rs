//! From pairs of clouds to tensors and back: the frame in which the network works.

use burn::tensor::{Device, Tensor, TensorData};
use nalgebra::{Matrix3, Vector3};
use srrf_cloud::{PairFrame, PointCloud, Rigid};

use crate::ops::{CopyError, HostClouds, to_host};

/// Root mean square radius that clouds have inside the network. Clouds of ModelNet40 in the unit
/// sphere have about this one, so thresholds in network units read as shares of the radius.
const NETWORK_RMS: f64 = 0.6;

/// The frame in which the network sees a pair: each cloud centred on its own mean, both divided by one scale.
pub fn network_frame(source: &PointCloud, target: &PointCloud) -> PairFrame {
    PairFrame::with_radius(source, target, NETWORK_RMS)
}

/// A batch of pairs in network units, not yet on a device; every cloud has the same number of points.
#[derive(Debug, Clone)]
pub struct HostPairs {
    /// The sources, and then the targets.
    pub clouds: HostClouds,
    /// One frame a pair.
    pub frames: Vec<PairFrame>,
}

impl HostPairs {
    /// Pairs of clouds in network units. `None` unless there is a pair and all clouds have the same number
    /// of points.
    pub fn new(pairs: &[(&PointCloud, &PointCloud)]) -> Option<Self> {
        let points = pairs.first()?.0.len();
        if pairs.iter().any(|(source, target)| source.len() != points || target.len() != points) {
            return None;
        }
        let frames: Vec<PairFrame> =
            pairs.iter().map(|(source, target)| network_frame(source, target)).collect();
        let mut clouds = Vec::with_capacity(2 * pairs.len() * points);
        for ((x, _), frame) in pairs.iter().zip(&frames) {
            clouds.extend(x.points().iter().map(|p| frame.source(p).map(|v| v as f32)));
        }
        for ((_, y), frame) in pairs.iter().zip(&frames) {
            clouds.extend(y.points().iter().map(|p| frame.target(p).map(|v| v as f32)));
        }
        Some(Self { clouds: HostClouds::new(clouds, points), frames })
    }

    /// The pairs on a device.
    pub fn upload(&self, device: &Device) -> PairBatch {
        let shape = [self.frames.len(), self.clouds.per_cloud(), 3];
        let (source, target) = self.clouds.flat().split_at(shape.iter().product());
        let tensor = |values: &[f32]| Tensor::<3>::from_data(TensorData::new(values.to_vec(), shape), device);
        PairBatch { source: tensor(source), target: tensor(target), frames: self.frames.clone() }
    }
}

/// A batch of pairs on a device, every cloud with the same number of points.
#[derive(Debug, Clone)]
pub struct PairBatch {
    /// `[batch, points, 3]`, network units.
    pub source: Tensor<3>,
    /// `[batch, points, 3]`, network units.
    pub target: Tensor<3>,
    /// One frame a pair.
    pub frames: Vec<PairFrame>,
}

impl PairBatch {
    /// Brings pairs of clouds to the device. `None` unless there is a pair and all clouds have the
    /// same number of points.
    pub fn new(pairs: &[(&PointCloud, &PointCloud)], device: &Device) -> Option<Self> {
        HostPairs::new(pairs).map(|pairs| pairs.upload(device))
    }

    /// True poses, in network units, as tensors `[batch, 3, 3]` and `[batch, 3]`.
    pub fn truth(&self, target_from_source: &[Rigid]) -> (Tensor<3>, Tensor<2>) {
        let device = self.source.device();
        let (mut rotations, mut translations) = (Vec::new(), Vec::new());
        for (frame, pose) in self.frames.iter().zip(target_from_source) {
            let pose = frame.pose(pose);
            rotations.extend(pose.rotation.transpose().iter().map(|&v| v as f32)); // row-major
            translations.extend(pose.translation.iter().map(|&v| v as f32));
        }
        let batch = self.frames.len();
        (
            Tensor::from_data(TensorData::new(rotations, [batch, 3, 3]), &device),
            Tensor::from_data(TensorData::new(translations, [batch, 3]), &device),
        )
    }

    /// Poses that the network found, between the given clouds. The rotation is projected to SO(3)
    /// in `f64`; `None` for a pose that is not finite.
    ///
    /// # Shapes
    /// - `rotation`: `[batch, 3, 3]`, `translation`: `[batch, 3]`
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn poses(
        &self,
        rotation: &Tensor<3>,
        translation: &Tensor<2>,
    ) -> Result<Vec<Option<Rigid>>, CopyError> {
        let rotations: Vec<f64> = to_host(rotation)?;
        let translations: Vec<f64> = to_host(translation)?;
        let poses = self
            .frames
            .iter()
            .zip(rotations.chunks_exact(9).zip(translations.chunks_exact(3)))
            .map(|(frame, (r, t))| {
                let rotation = Rigid::nearest_rotation(&Matrix3::from_row_slice(r))?;
                let translation = Vector3::from_column_slice(t);
                let pose = frame.undo_pose(&Rigid { rotation, translation });
                // Clouds whose coordinates overflow have no scale either.
                pose.translation.iter().all(|v| v.is_finite()).then_some(pose)
            })
            .collect();
        Ok(poses)
    }
}
