//! The same operations from Burn's own, for every backend and number type.

use burn::nn::{LayerNorm, Linear};
use burn::tensor::Tensor;
use burn::tensor::activation::{relu, sigmoid, softmax};

use super::linear::Activation;
use crate::ops::{on_cubecl, rows};

/// `act(x W + b)`; shapes as in [`super::linear`].
pub fn linear(layer: &Linear, x: Tensor<2>, activation: Activation) -> Tensor<2> {
    let [count, inputs] = x.dims();
    let parts = match on_cubecl(&x.device().without_autodiff()) {
        true => even_parts(count),
        false => 1,
    };
    let y = match parts {
        1 => layer.forward(x),
        _ => {
            let y = layer.forward(x.reshape([parts, count / parts, inputs]));
            let [_, _, outputs] = y.dims();
            y.reshape([count, outputs])
        }
    };
    match activation {
        Activation::None => y,
        Activation::Relu => relu(y),
        Activation::Sigmoid => sigmoid(y),
    }
}

/// In how many equal parts to take `count` rows, so that the sums over all rows of the backward pass are
/// made side by side, and then over the parts: CubeCL's kernels give each sum to one unit. A power of 2 near
/// the root, or 1 where that does not divide the rows.
fn even_parts(count: usize) -> usize {
    let most = 1 << count.trailing_zeros().min(10);
    let root = (count as f64).sqrt().log2().round() as u32;
    if count < 4096 { 1 } else { most.min(1 << root) }
}

/// Multi-head attention; shapes as in [`super::attention`].
pub fn attention(queries: Tensor<2>, keys_values: Tensor<2>, clouds: usize, heads: usize) -> Tensor<2> {
    let ([rows, width], [memory_rows, _]) = (queries.dims(), keys_values.dims());
    let (n, m, per_head) = (rows / clouds, memory_rows / clouds, width / heads);
    let q = queries / (per_head as f64).sqrt();
    let q = q.reshape([clouds, n, heads, per_head]).swap_dims(1, 2); // [clouds, heads, n, d]
    let kv = keys_values.reshape([clouds, m, 2 * heads, per_head]).swap_dims(1, 2);
    let k = kv.clone().narrow(1, 0, heads); // [clouds, heads, m, d]
    let v = kv.narrow(1, heads, heads);
    let weights = softmax(q.matmul(k.transpose()), 3); // [clouds, heads, n, m]
    weights.matmul(v).swap_dims(1, 2).reshape([rows, width])
}

/// `LN(a + b)`; shapes as in [`super::add_norm`].
pub fn add_norm(norm: &LayerNorm, a: Tensor<2>, b: Tensor<2>) -> Tensor<2> {
    norm.forward(a + b)
}

/// Group norm and ReLU; shapes as in [`super::group_norm_relu`].
pub fn group_norm_relu(
    x: Tensor<2>,
    gamma: Tensor<1>,
    beta: Tensor<1>,
    clouds: usize,
    groups: usize,
) -> Tensor<2> {
    let [rows, channels] = x.dims();
    let grouped = x.reshape([clouds, rows / clouds, groups, channels / groups]);
    let mean = grouped.clone().mean_dim(3).mean_dim(1);
    let centred = grouped - mean;
    let variance = centred.clone().square().mean_dim(3).mean_dim(1);
    let normal = (centred / (variance + super::group_norm::EPSILON).sqrt()).reshape([rows, channels]);
    relu(normal * gamma.unsqueeze::<2>() + beta.unsqueeze::<2>())
}

/// Gathering with a shift; shapes as in [`super::gather_relu`].
pub fn gather_relu(table: Tensor<2>, shift: Tensor<2>, neighbours: &[i64]) -> Tensor<2> {
    let [samples, width] = shift.dims();
    let k = neighbours.len() / samples.max(1);
    let grouped = rows(table, neighbours).reshape([samples, k, width]);
    relu(grouped - shift.unsqueeze_dim::<3>(1)).reshape([samples * k, width])
}

/// The maximum over neighbours; shapes as in [`super::gather_max`].
pub fn gather_max(table: Tensor<2>, neighbours: &[i64], k: usize) -> Tensor<2> {
    let [_, width] = table.dims();
    let grouped = rows(table, neighbours).reshape([neighbours.len() / k, k, width]);
    grouped.max_dim(1).squeeze_dim::<2>(1)
}
