//! The derivative of a cloud's feature by a motion of the cloud, and its pseudo-inverse.

use burn::tensor::Tensor;
use nalgebra::SMatrix;
use srrf_model::fast::{Activation, linear};
use srrf_model::ops::{CopyError, rows, to_host};
use srrf_model::transform;

use super::PointNetLk;
use crate::se3::{constant, exp, identity, parts};

/// Step of the differences, in each coordinate of the twist.
const STEP: f64 = 1e-2;
/// Damping of the normal equations, as a share of their mean diagonal.
const DAMPING: f64 = 1e-6;

/// `(phi(P) - phi(exp(-h e_k) P)) / h` for each coordinate `k` of the twist.
///
/// # Shapes
/// - `cloud`: `[batch, n, 3]`, `feature`: `[batch, features]`; output: `[batch, features, 6]`
pub(super) fn finite_difference(network: &PointNetLk, cloud: &Tensor<3>, feature: &Tensor<2>) -> Tensor<3> {
    let ([batch, n, _], [_, features]) = (cloud.dims(), feature.dims());
    let twists: Vec<f64> = (0..36).map(|i| if i % 7 == 0 { -STEP } else { 0.0 }).collect();
    let (rotation, translation) = parts(exp(constant(&twists, [6, 6], cloud)));
    // Each cloud 6 times, moved along one coordinate each.
    let clouds = cloud.clone().unsqueeze_dim::<4>(1).repeat_dim(1, 6).reshape([batch * 6, n, 3]);
    let moved = transform(clouds, rotation.repeat_dim(0, batch), translation.repeat_dim(0, batch));
    let moved = network.feature(moved).reshape([batch, 6, features]);
    let change = feature.clone().unsqueeze_dim::<3>(1) - moved; // [batch, 6, features]
    change.transpose() / STEP
}

/// The derivative by the chain rule: feature `k` is that of one point `x`, so it changes with the
/// motion `(w, v)` as `grad . (w x x + v) = (x x grad) . w + grad . v`.
///
/// # Shapes
/// - `cloud`: `[batch, n, 3]`; output: `[batch, features, 6]`
pub(super) fn analytic(network: &PointNetLk, cloud: &Tensor<3>) -> Result<Tensor<3>, CopyError> {
    let [batch, n, _] = cloud.dims();
    let table = cloud.clone().reshape([batch * n, 3]);
    let embedded = network.embed(table.clone()).detach();
    let [_, features] = embedded.dims();
    let best = rows_of_maxima(&embedded, n)?; // batch * features
    let points = rows(table, &best);
    let Some((last, before)) = network.layers.split_last() else { return Ok(identity(batch, 6, cloud)) };

    // Forward to the last layer but one at these points, keeping where each ReLU lets through.
    let (mut x, mut open) = (points.clone(), Vec::with_capacity(before.len()));
    for layer in before {
        x = linear(layer, x, Activation::Relu);
        open.push(x.clone().detach().sign());
    }
    // Back from one feature each: its own column of the last layer, if its ReLU is open.
    let alive = embedded.reshape([batch, n, features]).max_dim(1).sign().reshape([batch * features, 1]);
    let mut gradient = last.weight.val().transpose().repeat_dim(0, batch) * alive;
    for (layer, open) in before.iter().zip(open).rev() {
        gradient = (gradient * open).matmul(layer.weight.val().transpose());
    }
    Ok(Tensor::cat(vec![cross(&points, &gradient), gradient], 1).reshape([batch, features, 6]))
}

/// The row of the largest value of each column, among the `n` rows of each cloud.
fn rows_of_maxima(x: &Tensor<2>, n: usize) -> Result<Vec<i64>, CopyError> {
    let [_, columns] = x.dims();
    let values: Vec<f32> = to_host(x)?;
    let mut best = Vec::new();
    for (cloud, values) in values.chunks_exact((n * columns).max(1)).enumerate() {
        let mut top = vec![(f32::NEG_INFINITY, 0); columns];
        for (i, row) in values.chunks_exact(columns).enumerate() {
            for (top, &v) in top.iter_mut().zip(row) {
                if v > top.0 {
                    *top = (v, i);
                }
            }
        }
        best.extend(top.into_iter().map(|(_, i)| (cloud * n + i) as i64));
    }
    Ok(best)
}

/// Row by row `a x b`, both `[rows, 3]`.
fn cross(a: &Tensor<2>, b: &Tensor<2>) -> Tensor<2> {
    let column = |t: &Tensor<2>, i: usize| t.clone().narrow(1, i % 3, 1);
    let parts = (0..3).map(|i| column(a, i + 1) * column(b, i + 2) - column(a, i + 2) * column(b, i + 1));
    Tensor::cat(parts.collect(), 1)
}

/// `(J^T J + damping)^-1 J^T`, differentiable.
///
/// # Shapes
/// - `jacobian`: `[batch, features, 6]`; output: `[batch, 6, features]`
pub(super) fn pseudo_inverse(jacobian: Tensor<3>) -> Result<Tensor<3>, CopyError> {
    let [batch, _, _] = jacobian.dims();
    let transposed = jacobian.clone().transpose();
    let normal = transposed.clone().matmul(jacobian);
    let diagonal = normal.clone() * identity(batch, 6, &normal);
    let mean = diagonal.sum_dim(2).sum_dim(1) / 6.0; // [batch, 1, 1]
    let damped =
        normal.clone() + identity(batch, 6, &normal) * (mean * DAMPING + f64::from(f32::MIN_POSITIVE));
    Ok(inverse(damped)?.matmul(transposed))
}

/// The inverse, from the host in `f64`. One Newton step, whose value is that of its start, carries the
/// derivative `-H^-1 dH H^-1`.
///
/// # Shapes
/// - `matrices` and output: `[batch, 6, 6]`
fn inverse(matrices: Tensor<3>) -> Result<Tensor<3>, CopyError> {
    let [batch, _, _] = matrices.dims();
    let values: Vec<f64> = to_host(&matrices)?;
    let bad = SMatrix::<f64, 6, 6>::repeat(f64::NAN);
    let inverses: Vec<f64> = values
        .chunks_exact(36)
        .flat_map(|m| {
            let inverse = SMatrix::<f64, 6, 6>::from_row_slice(m).try_inverse().unwrap_or(bad);
            inverse.transpose().iter().copied().collect::<Vec<_>>() // row-major
        })
        .collect();
    let found = constant(&inverses, [batch, 6, 6], &matrices);
    let change = matrices.clone() - matrices.detach(); // zero, with the derivative of H
    Ok(found.clone() - found.clone().matmul(change).matmul(found))
}

#[cfg(test)]
mod tests {
    use burn::tensor::{DType, Device, TensorData};
    use srrf_model::{NetworkConfig, init};

    use super::*;
    use crate::pointnetlk::PointNetLkConfig;

    fn cloud(batch: usize, n: usize, device: &Device) -> Tensor<3> {
        let values: Vec<f64> = (0..batch * n * 3).map(|i| ((i * i) as f64 * 0.37).sin()).collect();
        Tensor::from_data(TensorData::new(values, [batch, n, 3]), (device, DType::F32))
    }

    #[test]
    fn the_two_jacobians_agree() {
        let device = Device::flex();
        let config = PointNetLkConfig { widths: vec![9, 11, 23], ..PointNetLkConfig::default() };
        let network = init::seeded(config.init(&device), 5);
        let cloud = cloud(2, 31, &device);
        let feature = network.feature(cloud.clone());
        let differences = finite_difference(&network, &cloud, &feature).try_to_vec_as::<f64>().unwrap();
        let exact = analytic(&network, &cloud).unwrap().try_to_vec_as::<f64>().unwrap();
        let largest = exact.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        // A step of 0.01 turns a maximum over to another point, or a ReLU, here and there.
        let off = exact.iter().zip(&differences).filter(|(a, b)| (*a - *b).abs() > 0.02 * largest).count();
        assert!(largest > 0.05 && off * 10 < exact.len(), "{off} of {} are off", exact.len());
    }

    #[test]
    fn the_inverse_carries_its_derivative() {
        let device = Device::flex().autodiff();
        let entry = |shift: f64| -> Vec<f64> {
            (0..36)
                .map(|i| {
                    let (r, c) = (i / 6, i % 6);
                    let base = if r == c { 3.0 } else { ((r + c * 7) as f64).sin() };
                    base + if i == 8 { shift } else { 0.0 }
                })
                .collect()
        };
        let tensor = |shift| {
            Tensor::<3>::from_data(TensorData::new(entry(shift), [1, 6, 6]), (&device, DType::F64))
                .require_grad()
        };
        let weights =
            constant(&(0..36).map(|i| f64::from(i).cos()).collect::<Vec<_>>(), [1, 6, 6], &tensor(0.0));
        let value = |t: Tensor<3>| (inverse(t).unwrap() * weights.clone()).sum();
        let h = tensor(0.0);
        let product = inverse(h.clone()).unwrap().matmul(h.clone()).try_to_vec_as::<f64>().unwrap();
        assert!(product.iter().enumerate().all(|(i, v)| (v - f64::from(i % 7 == 0)).abs() < 1e-10));
        let gradient = h.grad(&value(h.clone()).backward()).unwrap().try_to_vec_as::<f64>().unwrap()[8];
        let (up, down) =
            (value(tensor(1e-4)).into_scalar::<f64>(), value(tensor(-1e-4)).into_scalar::<f64>());
        assert!((gradient - (up - down) / 2e-4).abs() < 1e-6, "{gradient}");
    }
}
