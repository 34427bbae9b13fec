//! Where matches are to be expected: near where the pass before left the points.

use burn::tensor::{Tensor, TensorData};

use srrf_cloud::PairFrame;

use crate::ops::squared_distances;

/// A Gaussian about each source point, as the pose of the pass before placed it, for where its match lies. Not in the
/// paper, whose network is applied once and knows nothing of the pose. Without it matches are by features alone; the narrower
/// it is, the more they are ICP's nearest points.
///
/// Clouds come to the network centred on their own means, which takes the translation away. Where they overlap in part,
/// their means are not the same place; the prior is about the placed points, not about the centred ones.
#[derive(Debug, Clone, PartialEq)]
pub struct PositionPrior {
    /// Standard deviation along each axis, network units.
    deviation: f64,
    /// What brings a centred source point of each pair to where it was placed among the centred target points.
    shifts: Vec<[f64; 3]>,
}

impl PositionPrior {
    /// The prior of pairs whose sources are placed by the pass before. `deviation` is the standard deviation along
    /// each axis, in network units (clouds of a root mean square radius of 0.6).
    pub fn new(deviation: f64, frames: &[PairFrame]) -> Self {
        let shift = |frame: &PairFrame| frame.target(&frame.undo_source(&[0.0; 3]));
        Self { deviation, shifts: frames.iter().map(shift).collect() }
    }

    /// Its logarithm without the constant, `-|x_i + shift - y_j|^2 / (2 deviation^2)`, which scores of matches take in.
    ///
    /// # Shapes
    /// - `source`: `[batch, n, 3]`, `target`: `[batch, m, 3]`; output: `[batch, n, m]`
    pub fn log_density(&self, source: Tensor<3>, target: Tensor<3>) -> Tensor<3> {
        let shifts = TensorData::new(self.shifts.concat(), [self.shifts.len(), 1, 3]);
        let device = source.device().without_autodiff();
        let shifts = Tensor::<3>::from_data(shifts, (&device, source.dtype()));
        squared_distances(&(source + shifts), &target) * (-0.5 / self.deviation.powi(2))
    }
}
