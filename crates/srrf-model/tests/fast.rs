//! The custom operations against the composition of Burn's own operations in `f64`, forward and
//! backward, and against finite differences of their own output. Sizes are odd and pairwise distinct.
//!
//! Tolerances: `f32` sums of up to 50 products of numbers below 1 carry relative errors of some 1e-6,
//! so 2e-5 of the largest entry. Central differences with a step of 1/64 have errors of its square
//! times the third derivative, below 1, and of the rounding of the output over the step: 1e-3.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use burn::nn::{LayerNorm, LayerNormConfig, Linear, LinearConfig};
use burn::tensor::{DType, Device, Tensor, TensorData};
use common::{Numbers, values};
use srrf_model::fast::{self, Activation, composed};

const EXACT: f64 = 2e-5;
const STEP: f64 = 1.0 / 64.0;
const DIFFERENCES: f64 = 1e-3;

/// Inputs of an operation: values and shape, two dimensions each.
type Input = (Vec<f64>, [usize; 2]);

fn input(seed: u64, shape: [usize; 2]) -> Input {
    (Numbers(seed).many(shape[0] * shape[1]), shape)
}

fn leaf((values, shape): &Input, dtype: DType, device: &Device) -> Tensor<2> {
    Tensor::<2>::from_data(TensorData::new(values.clone(), *shape), (device, dtype)).require_grad()
}

/// Output of `operation` and the gradients of `sum(output * weights)` in every input.
fn run(
    inputs: &[Input],
    (device, dtype): (&Device, DType),
    operation: &dyn Fn(&[Tensor<2>]) -> Tensor<2>,
) -> (Vec<f64>, Vec<Vec<f64>>) {
    let device = device.clone().autodiff();
    let leaves: Vec<Tensor<2>> = inputs.iter().map(|input| leaf(input, dtype, &device)).collect();
    let output = operation(&leaves);
    let shape = output.dims();
    let weights = Numbers(99).many(shape[0] * shape[1]);
    let weights = Tensor::<2>::from_data(TensorData::new(weights, shape), (&device, dtype));
    let gradients = (output.clone() * weights).sum().backward();
    let found = leaves.iter().map(|leaf| values(&leaf.grad(&gradients).unwrap())).collect();
    (values(&output.detach()), found)
}

fn assert_close(name: &str, ours: &[f64], wanted: &[f64], tolerance: f64) {
    assert_eq!(ours.len(), wanted.len(), "{name}");
    let largest = wanted.iter().fold(1e-3_f64, |a, v| a.max(v.abs()));
    let apart = ours.iter().zip(wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart <= tolerance * largest, "{name}: {apart} apart, largest {largest}");
    assert!(wanted.iter().any(|v| v.abs() > 1e-3), "{name}: nothing to compare");
}

/// Holds `fast` against `composed` in `f64` and against finite differences of itself.
fn check(
    inputs: &[Input],
    fast: &dyn Fn(&[Tensor<2>]) -> Tensor<2>,
    composed: &dyn Fn(&[Tensor<2>]) -> Tensor<2>,
) {
    for device in devices() {
        check_on(&device, inputs, fast, composed);
    }
}

/// The devices that have custom operations.
fn devices() -> Vec<Device> {
    let more = cfg!(feature = "libtorch").then(|| srrf_model::device("libtorch").unwrap());
    std::iter::once(Device::flex()).chain(more).collect()
}

fn check_on(
    device: &Device,
    inputs: &[Input],
    fast: &dyn Fn(&[Tensor<2>]) -> Tensor<2>,
    composed: &dyn Fn(&[Tensor<2>]) -> Tensor<2>,
) {
    let (output, gradients) = run(inputs, (device, DType::F32), fast);
    let (wanted_output, wanted_gradients) = run(inputs, (&Device::flex(), DType::F64), composed);
    assert_close("output", &output, &wanted_output, EXACT);
    for (i, (ours, wanted)) in gradients.iter().zip(&wanted_gradients).enumerate() {
        assert_close(&format!("gradient of input {i}"), ours, wanted, EXACT);
    }

    let weights = Numbers(99).many(output.len());
    let value = |inputs: &[Input]| -> f64 {
        let tensors: Vec<Tensor<2>> = inputs
            .iter()
            .map(|(v, shape)| {
                Tensor::<2>::from_data(TensorData::new(v.clone(), *shape), (device, DType::F32))
            })
            .collect();
        values(&fast(&tensors)).iter().zip(&weights).map(|(o, w)| o * w).sum()
    };
    for (i, ours) in gradients.iter().enumerate() {
        let largest = ours.iter().fold(1e-3_f64, |a, v| a.max(v.abs()));
        for at in (0..ours.len()).step_by(1 + ours.len() / 13) {
            let mut moved = inputs.to_vec();
            moved[i].0[at] += STEP;
            let above = value(&moved);
            moved[i].0[at] -= 2.0 * STEP;
            let slope = (above - value(&moved)) / (2.0 * STEP);
            let apart = (slope - ours[at]).abs();
            assert!(apart < DIFFERENCES * largest.max(1.0), "input {i} at {at}: {slope} {}", ours[at]);
        }
    }
}

/// A module whose parameters are the given tensors is made anew on each call, so that gradients reach
/// them: a linear layer as a function of `x`, its weight and its bias (as one row).
fn linear_of(tensors: &[Tensor<2>]) -> Linear {
    let [inputs, outputs] = tensors[1].dims();
    let mut layer = LinearConfig::new(inputs, outputs).init(&tensors[1].device());
    layer.weight = layer.weight.map(|_| tensors[1].clone());
    layer.bias = layer.bias.map(|bias| bias.map(|_| tensors[2].clone().reshape([outputs])));
    layer
}

fn norm_of(tensors: &[Tensor<2>]) -> LayerNorm {
    let [_, channels] = tensors[2].dims();
    let mut norm = LayerNormConfig::new(channels).init(&tensors[2].device());
    norm.gamma = norm.gamma.map(|_| tensors[2].clone().reshape([channels]));
    norm.beta = norm.beta.map(|beta| beta.map(|_| tensors[3].clone().reshape([channels])));
    norm
}

#[test]
fn linear_layers_with_each_activation() {
    let inputs = [input(1, [23, 7]), input(2, [7, 19]), input(3, [1, 19])];
    for activation in [Activation::None, Activation::Sigmoid] {
        check(&inputs, &|t| fast::linear(&linear_of(t), t[0].clone(), activation), &|t| {
            composed::linear(&linear_of(t), t[0].clone(), activation)
        });
    }
    // ReLU has a kink, where differences say nothing: held against the composition only.
    let relu = |t: &[Tensor<2>]| fast::linear(&linear_of(t), t[0].clone(), Activation::Relu);
    let wanted = |t: &[Tensor<2>]| composed::linear(&linear_of(t), t[0].clone(), Activation::Relu);
    let (ours, wanted) = (
        run(&inputs, (&Device::flex(), DType::F32), &relu),
        run(&inputs, (&Device::flex(), DType::F64), &wanted),
    );
    assert_close("relu", &ours.0, &wanted.0, EXACT);
    assert!(ours.0.contains(&0.0) && ours.0.iter().any(|&v| v > 0.5));
    for (a, b) in ours.1.iter().zip(&wanted.1) {
        assert_close("gradient of relu", a, b, EXACT);
    }
}

#[test]
fn attention_to_another_cloud() {
    // 2 clouds, 3 heads of 5 channels, 11 queries and 13 keys a cloud.
    let inputs = [input(4, [2 * 11, 15]), input(5, [2 * 13, 30])];
    check(&inputs, &|t| fast::attention(t[0].clone(), t[1].clone(), 2, 3), &|t| {
        composed::attention(t[0].clone(), t[1].clone(), 2, 3)
    });
}

#[test]
fn residual_and_layer_norm() {
    let inputs = [input(6, [21, 37]), input(7, [21, 37]), input(8, [1, 37]), input(9, [1, 37])];
    check(&inputs, &|t| fast::add_norm(&norm_of(t), t[0].clone(), t[1].clone()), &|t| {
        composed::add_norm(&norm_of(t), t[0].clone(), t[1].clone())
    });
}

#[test]
fn group_norm_and_relu() {
    // 3 clouds of 7 rows, 5 groups of 3 channels.
    let inputs = [input(12, [3 * 7, 15]), input(13, [1, 15]), input(14, [1, 15])];
    let flat = |t: &Tensor<2>| t.clone().reshape([15]);
    let ours = |t: &[Tensor<2>]| fast::group_norm_relu(t[0].clone(), flat(&t[1]), flat(&t[2]), 3, 5);
    let wanted = |t: &[Tensor<2>]| composed::group_norm_relu(t[0].clone(), flat(&t[1]), flat(&t[2]), 3, 5);
    let (ours, wanted) = (
        run(&inputs, (&Device::flex(), DType::F32), &ours),
        run(&inputs, (&Device::flex(), DType::F64), &wanted),
    );
    assert_close("group norm", &ours.0, &wanted.0, EXACT);
    assert!(ours.0.contains(&0.0) && ours.0.iter().any(|&v| v > 0.5));
    for (a, b) in ours.1.iter().zip(&wanted.1) {
        assert_close("gradient of group norm", a, b, EXACT);
    }
}

#[test]
fn gathering_neighbours() {
    let neighbours: Vec<i64> = (0..9 * 4).map(|i| (i * i + 3 * i) % 17).collect();
    let inputs = [input(10, [17, 5]), input(11, [9, 5])];
    let relu = |t: &[Tensor<2>]| fast::gather_relu(t[0].clone(), t[1].clone(), &neighbours);
    let wanted = |t: &[Tensor<2>]| composed::gather_relu(t[0].clone(), t[1].clone(), &neighbours);
    let (ours, wanted) = (
        run(&inputs, (&Device::flex(), DType::F32), &relu),
        run(&inputs, (&Device::flex(), DType::F64), &wanted),
    );
    assert_close("gathered", &ours.0, &wanted.0, EXACT);
    for (a, b) in ours.1.iter().zip(&wanted.1) {
        assert_close("gradient of gathering", a, b, EXACT);
    }
    let largest = |t: &[Tensor<2>]| fast::gather_max(t[0].clone(), &neighbours, 4);
    let wanted = |t: &[Tensor<2>]| composed::gather_max(t[0].clone(), &neighbours, 4);
    let (ours, wanted) = (
        run(&inputs[..1], (&Device::flex(), DType::F32), &largest),
        run(&inputs[..1], (&Device::flex(), DType::F64), &wanted),
    );
    assert_close("largest", &ours.0, &wanted.0, EXACT);
    assert_close("gradient of the largest", &ours.1[0], &wanted.1[0], EXACT);
}

#[test]
fn numbers_that_are_not_finite_come_through() {
    let device = Device::flex();
    let bad = || Tensor::<2>::from_data(TensorData::new(vec![f32::NAN, 1.0, 2.0, 3.0], [2, 2]), &device);
    let has_nan = |t: Tensor<2>| values(&t).iter().any(|v| v.is_nan());
    let layer = LinearConfig::new(2, 3).init(&device);
    for activation in [Activation::None, Activation::Relu, Activation::Sigmoid] {
        assert!(has_nan(fast::linear(&layer, bad(), activation)), "{activation:?}");
    }
    assert!(has_nan(fast::gather_max(bad(), &[0, 1], 2)));
    assert!(has_nan(fast::gather_relu(bad(), Tensor::zeros([1, 2], &device), &[0, 1])));
    assert!(has_nan(fast::attention(bad(), Tensor::ones([2, 4], &device), 1, 1)));
    let ones = || Tensor::ones([2], &device);
    assert!(has_nan(fast::group_norm_relu(bad(), ones(), ones(), 1, 2)));
    let norm = LayerNormConfig::new(2).init(&device);
    assert!(has_nan(fast::add_norm(&norm, bad(), Tensor::ones([2, 2], &device))));
}
