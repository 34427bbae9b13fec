//! From pairs of clouds to tensors and back: the frame in which the network works.

use burn::tensor::{Device, Tensor, TensorData};
use nalgebra::{Matrix3, Vector3};
use srrf_cloud::{PointCloud, Rigid};

use crate::ops::HostClouds;

/// Root mean square radius that clouds have inside the network. Clouds of ModelNet40 in the unit
/// sphere have about this one, so thresholds in network units read as shares of the radius.
const NETWORK_RMS: f64 = 0.6;

/// Where a pair's clouds lie in network units: each centred on its own mean, both divided by one
/// scale, so that the rotation stays what it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairFrame {
    source_mean: Vector3<f64>,
    target_mean: Vector3<f64>,
    scale: f64,
}

impl PairFrame {
    /// The frame of a pair.
    pub fn new(source: &PointCloud, target: &PointCloud) -> Self {
        let (source_mean, target_mean) = (source.centroid(), target.centroid());
        let mean_square = |cloud: &PointCloud, mean: Vector3<f64>| {
            cloud.points().iter().map(|p| (Vector3::from(*p) - mean).norm_squared()).sum::<f64>()
                / cloud.len() as f64
        };
        let rms = ((mean_square(source, source_mean) + mean_square(target, target_mean)) / 2.0).sqrt();
        let scale = if rms > 0.0 { rms / NETWORK_RMS } else { 1.0 };
        Self { source_mean, target_mean, scale }
    }

    /// Source coordinates in network units.
    pub fn source(&self, point: &[f64; 3]) -> [f64; 3] {
        ((Vector3::from(*point) - self.source_mean) / self.scale).into()
    }

    /// Target coordinates in network units.
    pub fn target(&self, point: &[f64; 3]) -> [f64; 3] {
        ((Vector3::from(*point) - self.target_mean) / self.scale).into()
    }

    /// A point of the source in network units, back in source coordinates.
    pub fn undo_source(&self, point: &[f64; 3]) -> [f64; 3] {
        (Vector3::from(*point) * self.scale + self.source_mean).into()
    }

    /// A point of the target in network units, back in target coordinates.
    pub fn undo_target(&self, point: &[f64; 3]) -> [f64; 3] {
        (Vector3::from(*point) * self.scale + self.target_mean).into()
    }

    /// A length in network units, in the unit of the clouds.
    pub fn undo_length(&self, length: f64) -> f64 {
        length * self.scale
    }

    /// A pose between the given clouds as the network sees it.
    pub fn to_network(&self, target_from_source: &Rigid) -> Rigid {
        let Rigid { rotation, translation } = target_from_source;
        let translation = (translation + rotation * self.source_mean - self.target_mean) / self.scale;
        Rigid { rotation: *rotation, translation }
    }

    /// A pose that the network found, between the given clouds.
    pub fn from_network(&self, pose: &Rigid) -> Rigid {
        let translation = self.scale * pose.translation + self.target_mean - pose.rotation * self.source_mean;
        Rigid { rotation: pose.rotation, translation }
    }
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
            pairs.iter().map(|(source, target)| PairFrame::new(source, target)).collect();
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
            let pose = frame.to_network(pose);
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
    pub fn poses(&self, rotation: &Tensor<3>, translation: &Tensor<2>) -> Vec<Option<Rigid>> {
        let rotations = rotation.try_to_vec_as::<f64>().unwrap_or_default();
        let translations = translation.try_to_vec_as::<f64>().unwrap_or_default();
        self.frames
            .iter()
            .zip(rotations.chunks_exact(9).zip(translations.chunks_exact(3)))
            .map(|(frame, (r, t))| {
                let rotation = Rigid::nearest_rotation(&Matrix3::from_row_slice(r))?;
                let translation = Vector3::from_column_slice(t);
                let pose = frame.from_network(&Rigid { rotation, translation });
                // Clouds whose coordinates overflow have no scale either.
                pose.translation.iter().all(|v| v.is_finite()).then_some(pose)
            })
            .collect()
    }
}
