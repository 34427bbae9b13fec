//! The custom operations on LibTorch: as few of its kernels, and as few passes over the memory, as their
//! mathematics needs. The backward passes, in `autodiff`, are those of the flex operations beside this folder.

mod autodiff;

use burn::backend::LibTorch;
use burn_tch::TchTensor;
use tch::{Kind, Tensor};

use super::backend::FastOps;
use super::group::Neighbours;
use super::group_norm;
use super::linear::Activation;

/// Burn's default of the layer norm, which the network uses.
const EPSILON: f64 = 1e-5;

fn linear(x: &TchTensor, weight: &TchTensor, bias: &TchTensor, activation: Activation) -> TchTensor {
    let mut y = bias.tensor.addmm(&x.tensor, &weight.tensor);
    match activation {
        Activation::None => {}
        Activation::Relu => drop(y.relu_()),
        Activation::Sigmoid => drop(y.sigmoid_()),
    }
    TchTensor::new(y)
}

/// `[clouds * n, parts * d]` as `[clouds, parts, n, d]`.
fn by_head(x: &Tensor, clouds: i64, parts: i64) -> Tensor {
    let (rows, width) = (x.size()[0], x.size()[1]);
    x.reshape([clouds, rows / clouds, parts, width / parts]).transpose(1, 2)
}

/// Back from [`by_head`].
fn by_row(x: &Tensor) -> Tensor {
    let size = x.size();
    x.transpose(1, 2).reshape([size[0] * size[2], size[1] * size[3]])
}

/// The output and the probabilities, `[clouds, heads, n, m]`.
fn attention(queries: &TchTensor, keys_values: &TchTensor, clouds: i64, heads: i64) -> (TchTensor, Tensor) {
    let q = by_head(&queries.tensor, clouds, heads);
    let scale = 1.0 / (q.size()[3] as f64).sqrt();
    let kv = by_head(&keys_values.tensor, clouds, 2 * heads);
    let (k, v) = (kv.narrow(1, 0, heads), kv.narrow(1, heads, heads));
    let probabilities = (q * scale).matmul(&k.transpose(2, 3)).softmax(-1, None::<Kind>);
    (TchTensor::new(by_row(&probabilities.matmul(&v))), probabilities)
}

/// The output, the normalised sum and the inverse deviation of each row.
fn add_norm(
    a: &TchTensor,
    b: &TchTensor,
    gamma: &TchTensor,
    beta: &TchTensor,
) -> (TchTensor, Tensor, Tensor) {
    let sum = &a.tensor + &b.tensor;
    let channels = [sum.size()[1]];
    let (normal, _, inverse) = sum.native_layer_norm(channels, None::<Tensor>, None::<Tensor>, EPSILON);
    let out = beta.tensor.addcmul(&normal, &gamma.tensor);
    (TchTensor::new(out), normal, inverse)
}

/// The output, the normalised values as `[rows, channels]` and the inverse deviation of each group.
fn group_norm_relu(
    x: &TchTensor,
    gamma: &TchTensor,
    beta: &TchTensor,
    clouds: i64,
    groups: i64,
) -> (TchTensor, Tensor, Tensor) {
    let (rows, channels) = (x.tensor.size()[0], x.tensor.size()[1]);
    let grouped = x.tensor.reshape([clouds, rows / clouds, groups, channels / groups]);
    let centred = &grouped - mean_of_groups(&grouped);
    let inverse = (mean_of_groups(&centred.square()) + group_norm::EPSILON).rsqrt();
    let normal = (centred * &inverse).reshape([rows, channels]);
    let mut out = beta.tensor.addcmul(&normal, &gamma.tensor);
    drop(out.relu_());
    (TchTensor::new(out), normal, inverse)
}

/// Mean over the points and the channels of a group, which keep their dimensions.
fn mean_of_groups(x: &Tensor) -> Tensor {
    x.mean_dim([1_i64, 3].as_slice(), true, None::<Kind>)
}

fn indices(neighbours: &[i64], like: &TchTensor) -> Tensor {
    Tensor::from_slice(neighbours).to_device(like.tensor.device())
}

/// The output, and the row numbers on the device.
fn gather_relu(table: &TchTensor, shift: &TchTensor, neighbours: &[i64]) -> (TchTensor, Tensor) {
    let (samples, width) = (shift.tensor.size()[0], shift.tensor.size()[1]);
    let rows = indices(neighbours, table);
    let picked = table.tensor.index_select(0, &rows).reshape([samples, -1, width]);
    let mut out = (picked - shift.tensor.unsqueeze(1)).reshape([-1, width]);
    drop(out.relu_());
    (TchTensor::new(out), rows)
}

/// The output, and the row that each of its numbers came from.
fn gather_max(table: &TchTensor, neighbours: &[i64], k: usize) -> (TchTensor, Tensor) {
    let width = table.tensor.size()[1];
    let rows = indices(neighbours, table);
    let picked = table.tensor.index_select(0, &rows).reshape([-1, k as i64, width]);
    let (out, place) = picked.max_dim(1, false);
    let from = rows.reshape([-1, k as i64]).gather(1, &place, false);
    (TchTensor::new(out), from)
}

impl FastOps for LibTorch {
    fn fast_linear(x: TchTensor, weight: TchTensor, bias: TchTensor, activation: Activation) -> TchTensor {
        linear(&x, &weight, &bias, activation)
    }

    fn fast_attention(queries: TchTensor, keys_values: TchTensor, clouds: usize, heads: usize) -> TchTensor {
        attention(&queries, &keys_values, clouds as i64, heads as i64).0
    }

    fn fast_add_norm(a: TchTensor, b: TchTensor, gamma: TchTensor, beta: TchTensor) -> TchTensor {
        add_norm(&a, &b, &gamma, &beta).0
    }

    fn fast_group_norm_relu(
        x: TchTensor,
        gamma: TchTensor,
        beta: TchTensor,
        clouds: usize,
        groups: usize,
    ) -> TchTensor {
        group_norm_relu(&x, &gamma, &beta, clouds as i64, groups as i64).0
    }

    fn fast_gather_relu(table: TchTensor, shift: TchTensor, neighbours: Neighbours) -> TchTensor {
        gather_relu(&table, &shift, &neighbours).0
    }

    fn fast_gather_max(table: TchTensor, neighbours: Neighbours, k: usize) -> TchTensor {
        gather_max(&table, &neighbours, k).0
    }
}
