//! What several tests share: numbers from a documented generator, tensors, small networks, poses.
#![allow(dead_code, clippy::expect_used, reason = "a part serves some test binaries, and only tests")]

use burn::tensor::{DType, Device, Tensor, TensorData};
use nalgebra::{Matrix3, Rotation3, Vector3};
use srrf_model::{
    BranchConfig, BranchRatios, InferenceConfig, IntegrationRule, LevelConfig, MatchingConfig, PfiConfig,
    SemConfig, SfeConfig, SrrfConfig,
};

/// splitmix64: the state grows by a constant, each output is a hash of it.
pub struct Numbers(pub u64);

impl Numbers {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [-1, 1), a multiple of 2^-23, so that `f32` and `f64` hold the same number.
    pub fn signed(&mut self) -> f64 {
        (self.bits() >> 40) as f64 / (1_u64 << 23) as f64 - 1.0
    }

    /// `count` of them.
    pub fn many(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|_| self.signed()).collect()
    }

    /// A rotation by up to `degrees` about a drawn axis.
    pub fn rotation(&mut self, degrees: f64) -> Matrix3<f64> {
        let axis = Vector3::new(self.signed(), self.signed(), self.signed()).normalize();
        *Rotation3::from_scaled_axis(axis * (degrees.to_radians() * self.signed().abs())).matrix()
    }

    /// A permutation of `0 .. n`.
    pub fn permutation(&mut self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        for i in (1..n).rev() {
            order.swap(i, (self.bits() % (i as u64 + 1)) as usize);
        }
        order
    }
}

/// An `f32` tensor.
pub fn tensor<const D: usize>(values: &[f64], shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::from_data(TensorData::new(values.to_vec(), shape), (device, DType::F32))
}

/// An `f64` tensor.
pub fn tensor64<const D: usize>(values: &[f64], shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::from_data(TensorData::new(values.to_vec(), shape), (device, DType::F64))
}

/// The numbers of a tensor, row by row.
pub fn values<const D: usize>(tensor: &Tensor<D>) -> Vec<f64> {
    tensor.try_to_vec_as::<f64>().expect("a float tensor")
}

/// Row-major numbers of a matrix.
pub fn row_major(matrix: &Matrix3<f64>) -> Vec<f64> {
    matrix.transpose().iter().copied().collect()
}

/// Largest absolute difference.
pub fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, |most, d| if d > most || d.is_nan() { d } else { most })
}

/// The paper's weighing by two thresholds.
pub fn ratios(dense_threshold: f64, skeleton_threshold: f64) -> BranchRatios {
    BranchRatios { dense_threshold, skeleton_threshold, sharpness: 1.0, skeleton_weight: 1.0 }
}

/// A network with small sizes, odd where they may be.
pub fn tiny() -> SrrfConfig {
    let level =
        |points, neighbours, widths: &[usize]| LevelConfig { points, neighbours, widths: widths.to_vec() };
    let pfi = |blocks| PfiConfig { blocks, heads: 3, feed_forward: 17, position_hidden: 11, squeeze: 4 };
    SrrfConfig {
        sem: SemConfig {
            levels: vec![level(31, 7, &[5, 9]), level(23, 5, &[13])],
            global: 7,
            head: vec![15, 11],
            skeleton_points: 19,
            logit_scale: 5.0,
        },
        dense: BranchConfig {
            tokens: 29,
            confidence: false,
            matching: MatchingConfig::default(),
            sfe: SfeConfig { layers: 2, neighbours: 7, width: 9, heads: 3, mlp: 13 },
            pfi: pfi(1),
        },
        skeleton: BranchConfig {
            tokens: 0,
            confidence: false,
            matching: MatchingConfig::default(),
            sfe: SfeConfig { layers: 3, neighbours: 5, width: 15, heads: 5, mlp: 7 },
            pfi: pfi(2),
        },
        integration: IntegrationRule::Nearest(ratios(0.05, 0.1)),
        inference: InferenceConfig::default(),
    }
}
