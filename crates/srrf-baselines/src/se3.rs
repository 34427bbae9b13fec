//! Rigid motions as tensors: the exponential of a twist, quaternions, composition.

use burn::tensor::{Tensor, TensorData};

/// Halvings of the twist before the series, and squarings after it.
const SQUARINGS: i32 = 4;
/// Terms of the series: a twist of norm 4 is then right to 1e-8.
const TERMS: usize = 7;

/// The motion `exp(twist)` of twists `(w, v)`, by scaling and squaring of the series of the matrix
/// exponential, so that nothing is singular at 0.
///
/// # Shapes
/// - `twists`: `[batch, 6]`, rotation first; output: `[batch, 4, 4]`
pub(crate) fn exp(twists: Tensor<2>) -> Tensor<3> {
    let [batch, _] = twists.dims();
    // Row k holds the generator of coordinate k.
    let mut basis = vec![0.0_f64; 6 * 16];
    for (k, (row, column, sign)) in [(0, (2, 1, 1.0)), (1, (0, 2, 1.0)), (2, (1, 0, 1.0))].into_iter() {
        basis[k * 16 + row * 4 + column] = sign;
        basis[k * 16 + column * 4 + row] = -sign;
    }
    for k in 3..6 {
        basis[k * 16 + (k - 3) * 4 + 3] = 1.0;
    }
    let basis = constant(&basis, [6, 16], &twists);
    let x = (twists / 2_f64.powi(SQUARINGS)).matmul(basis).reshape([batch, 4, 4]);
    let one = identity(batch, 4, &x);
    let mut sum = one.clone();
    for n in (1..=TERMS).rev() {
        sum = one.clone() + x.clone().matmul(sum) / n as f64;
    }
    for _ in 0..SQUARINGS {
        sum = sum.clone().matmul(sum);
    }
    sum
}

/// The identity of the type and device of `like`: `[batch, n, n]`.
pub(crate) fn identity(batch: usize, n: usize, like: &Tensor<3>) -> Tensor<3> {
    let values: Vec<f64> = (0..n * n).map(|i| f64::from(i % (n + 1) == 0)).collect();
    constant(&values, [1, n, n], like).repeat_dim(0, batch)
}

/// A tensor off the graph, of the type and device of `like`.
pub(crate) fn constant<const D: usize, const E: usize>(
    values: &[f64],
    shape: [usize; D],
    like: &Tensor<E>,
) -> Tensor<D> {
    let device = like.device().without_autodiff();
    Tensor::from_data(TensorData::new(values.to_vec(), shape), (&device, like.dtype()))
}

/// Rotation and translation of motions: `[batch, 4, 4]` to `[batch, 3, 3]` and `[batch, 3]`.
pub(crate) fn parts(motion: Tensor<3>) -> (Tensor<3>, Tensor<2>) {
    let upper = motion.narrow(1, 0, 3);
    (upper.clone().narrow(2, 0, 3), upper.narrow(2, 3, 1).squeeze_dim::<2>(2))
}

/// `second` after `first`, each rotation `[batch, 3, 3]` and translation `[batch, 3]`.
pub(crate) fn compose(
    second: (Tensor<3>, Tensor<2>),
    first: (Tensor<3>, Tensor<2>),
) -> (Tensor<3>, Tensor<2>) {
    let moved = first.1.unsqueeze_dim::<3>(1).matmul(second.0.clone().transpose()).squeeze_dim::<2>(1);
    (second.0.matmul(first.0), moved + second.1)
}

/// Rotations of quaternions, real part first, of any length but 0.
///
/// # Shapes
/// - `quaternions`: `[batch, 4]`, output: `[batch, 3, 3]`
pub(crate) fn rotation_of(quaternions: Tensor<2>) -> Tensor<3> {
    let [batch, _] = quaternions.dims();
    let length = quaternions.clone().square().sum_dim(1).clamp_min(1e-12).sqrt();
    let q = quaternions / length;
    let [w, x, y, z] = [0, 1, 2, 3].map(|i| q.clone().narrow(1, i, 1));
    let (xx, yy, zz) = (x.clone().square(), y.clone().square(), z.clone().square());
    let (xy, xz, yz) = (x.clone() * y.clone(), x.clone() * z.clone(), y.clone() * z.clone());
    let (wx, wy, wz) = (w.clone() * x, w.clone() * y, w * z);
    let diagonal = |a: Tensor<2>, b: Tensor<2>| (a + b) * -2.0 + 1.0;
    let rows = vec![
        diagonal(yy.clone(), zz.clone()),
        (xy.clone() - wz.clone()) * 2.0,
        (xz.clone() + wy.clone()) * 2.0,
        (xy + wz) * 2.0,
        diagonal(xx.clone(), zz),
        (yz.clone() - wx.clone()) * 2.0,
        (xz - wy) * 2.0,
        (yz + wx) * 2.0,
        diagonal(xx, yy),
    ];
    Tensor::cat(rows, 1).reshape([batch, 3, 3])
}

#[cfg(test)]
mod tests {
    use burn::tensor::Device;
    use nalgebra::{Isometry3, Quaternion, Rotation3, UnitQuaternion, Vector3};

    use super::*;

    fn values<const D: usize>(t: &Tensor<D>) -> Vec<f64> {
        t.try_to_vec_as::<f64>().unwrap()
    }

    #[test]
    fn the_exponential_agrees_with_rodrigues_and_its_slope_at_0_is_the_generator() {
        let device = Device::flex();
        // Pure rotations, and a pure translation.
        let twists = [0.7, -1.9, 0.4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.3, -0.2, 4.0];
        let found = exp(Tensor::from_data(TensorData::new(twists.to_vec(), [2, 6]), &device));
        let found = values(&found);
        let wanted = Rotation3::from_scaled_axis(Vector3::new(0.7, -1.9, 0.4)).to_homogeneous();
        for (i, v) in wanted.transpose().iter().enumerate() {
            assert!((found[i] - v).abs() < 1e-5, "{i}");
        }
        let wanted = Isometry3::translation(0.3, -0.2, 4.0).to_homogeneous();
        for (i, v) in wanted.transpose().iter().enumerate() {
            assert!((found[16 + i] - v).abs() < 1e-5, "{i}");
        }
        // A screw: its square is the exponential of twice the twist.
        let screw = |s: f64| {
            let t: Vec<f64> = [0.5, 0.2, -0.8, 0.1, 0.9, -0.4].iter().map(|v| v * s).collect();
            exp(Tensor::from_data(TensorData::new(t, [1, 6]), &device))
        };
        let (a, b) = (values(&screw(1.0).matmul(screw(1.0))), values(&screw(2.0)));
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-5));
    }

    #[test]
    fn quaternions_need_no_unit_length() {
        let q = Quaternion::new(0.8, -0.3, 1.1, 0.6);
        let wanted = UnitQuaternion::from_quaternion(q).to_rotation_matrix();
        let data = TensorData::new(vec![0.8, -0.3, 1.1, 0.6], [1, 4]);
        let found = values(&rotation_of(Tensor::from_data(data, &Device::flex())));
        for (f, w) in found.iter().zip(wanted.matrix().transpose().iter()) {
            assert!((f - w).abs() < 1e-6);
        }
    }

    #[test]
    fn composition_is_that_of_4_by_4_matrices() {
        let device = Device::flex();
        let motion = |t: [f64; 6]| exp(Tensor::from_data(TensorData::new(t.to_vec(), [1, 6]), &device));
        let (a, b) = (motion([0.1, 0.5, -0.3, 1.0, 0.2, 0.7]), motion([-0.4, 0.2, 0.9, -0.5, 0.3, 0.1]));
        let (rotation, translation) = compose(parts(b.clone()), parts(a.clone()));
        let wanted = parts(b.matmul(a));
        let near = |x: Vec<f64>, y: Vec<f64>| x.iter().zip(&y).all(|(x, y)| (x - y).abs() < 1e-5);
        assert!(near(values(&rotation), values(&wanted.0)) && near(values(&translation), values(&wanted.1)));
    }
}
