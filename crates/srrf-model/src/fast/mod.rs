//! Custom operations for the blocks where the time goes: a linear layer with its activation,
//! multi-head attention, the sum of two tensors under a layer norm, group norm, and the gathering of
//! neighbours. Each is one node of the graph with a hand-written backward pass, on Burn's flex backend and
//! on LibTorch, in `f32`; every other backend and number type takes the composition of Burn's own operations
//! in [`composed`].
//!
//! The two ways are the same mathematics; `tests/fast.rs` holds them against each other and against
//! finite differences.

mod add_norm;
mod attention;
#[cfg_attr(feature = "libtorch", allow(deprecated, reason = "see `device`"))]
mod backend;
pub mod composed;
mod group;
mod group_norm;
mod kernels;
#[cfg(feature = "libtorch")]
#[allow(deprecated, reason = "see `device`")]
mod libtorch;
mod linear;

use burn::backend::Dispatch;
use burn::nn::{LayerNorm, Linear};
use burn::tensor::{DType, Device, Tensor};

use backend::FastOps;
pub use linear::Activation;

/// Whether the custom operations serve `tensor`.
fn served<const D: usize>(tensor: &Tensor<D>) -> bool {
    let device = tensor.device().without_autodiff();
    tensor.dtype() == DType::F32 && (device == Device::flex() || on_libtorch(&device))
}

/// Whether the device is one of LibTorch's.
fn on_libtorch(device: &Device) -> bool {
    match device.as_dispatch() {
        #[cfg(feature = "libtorch")]
        burn::backend::DispatchDevice::LibTorch(_) => true,
        _ => false,
    }
}

/// `act(x W + b)`.
///
/// # Shapes
/// - `x`: `[rows, inputs]`
/// - output: `[rows, outputs]`
pub fn linear(layer: &Linear, x: Tensor<2>, activation: Activation) -> Tensor<2> {
    match &layer.bias {
        Some(bias) if served(&x) => {
            let (weight, bias) = (layer.weight.val().into_dispatch(), bias.val().into_dispatch());
            Tensor::from_dispatch(<Dispatch as FastOps>::fast_linear(
                x.into_dispatch(),
                weight,
                bias,
                activation,
            ))
        }
        _ => composed::linear(layer, x, activation),
    }
}

/// Multi-head attention of each cloud's queries over its memory, heads side by side in the channels:
/// `Concat(A_1 .. A_h)`, each `A_i = softmax(Q K^T / sqrt(d_K)) V`.
///
/// # Shapes
/// - `queries`: `[clouds * n, width]`, `keys_values`: `[clouds * m, 2 * width]`, keys first
/// - output: `[clouds * n, width]`
pub fn attention(queries: Tensor<2>, keys_values: Tensor<2>, clouds: usize, heads: usize) -> Tensor<2> {
    if !served(&queries) {
        return composed::attention(queries, keys_values, clouds, heads);
    }
    let (queries, keys_values) = (queries.into_dispatch(), keys_values.into_dispatch());
    Tensor::from_dispatch(<Dispatch as FastOps>::fast_attention(queries, keys_values, clouds, heads))
}

/// `LN(a + b)`, the layer norm over the channels. `norm` must have Burn's default epsilon, 1e-5.
///
/// # Shapes
/// - `a`, `b` and output: `[rows, channels]`
pub fn add_norm(norm: &LayerNorm, a: Tensor<2>, b: Tensor<2>) -> Tensor<2> {
    match &norm.beta {
        Some(beta) if served(&a) => {
            let (a, b) = (a.into_dispatch(), b.into_dispatch());
            let (gamma, beta) = (norm.gamma.val().into_dispatch(), beta.val().into_dispatch());
            Tensor::from_dispatch(<Dispatch as FastOps>::fast_add_norm(a, b, gamma, beta))
        }
        _ => composed::add_norm(norm, a, b),
    }
}

/// Group norm with a ReLU behind it: the channels of each cloud in `groups` groups, each brought to mean
/// 0 and deviation 1 over its channels and all rows of the cloud, then scaled and shifted by channel.
///
/// # Shapes
/// - `x` and output: `[clouds * n, channels]`; `gamma`, `beta`: `[channels]`
pub fn group_norm_relu(
    x: Tensor<2>,
    gamma: Tensor<1>,
    beta: Tensor<1>,
    clouds: usize,
    groups: usize,
) -> Tensor<2> {
    if !served(&x) {
        return composed::group_norm_relu(x, gamma, beta, clouds, groups);
    }
    let (x, gamma, beta) = (x.into_dispatch(), gamma.into_dispatch(), beta.into_dispatch());
    Tensor::from_dispatch(<Dispatch as FastOps>::fast_group_norm_relu(x, gamma, beta, clouds, groups))
}

/// `relu(table[j] - shift[i])` for each neighbour `j` of each sample `i`.
///
/// # Shapes
/// - `table`: `[rows, width]`, `shift`: `[samples, width]`, `neighbours`: `samples * k` row numbers
/// - output: `[samples * k, width]`
pub fn gather_relu(table: Tensor<2>, shift: Tensor<2>, neighbours: &[i64]) -> Tensor<2> {
    if !served(&table) {
        return composed::gather_relu(table, shift, neighbours);
    }
    let (table, shift) = (table.into_dispatch(), shift.into_dispatch());
    Tensor::from_dispatch(<Dispatch as FastOps>::fast_gather_relu(table, shift, neighbours.into()))
}

/// The largest of each channel over the `k` neighbours of each sample.
///
/// # Shapes
/// - `table`: `[rows, width]`, `neighbours`: `samples * k` row numbers
/// - output: `[samples, width]`
pub fn gather_max(table: Tensor<2>, neighbours: &[i64], k: usize) -> Tensor<2> {
    if !served(&table) {
        return composed::gather_max(table, neighbours, k);
    }
    let table = table.into_dispatch();
    Tensor::from_dispatch(<Dispatch as FastOps>::fast_gather_max(table, neighbours.into(), k))
}
