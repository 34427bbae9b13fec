//! The differentiable SVD head: least-squares rigid motion, Eq. (1) to (4) of the paper, with the
//! determinant fix that the paper leaves out.
//!
//! The 3 x 3 problem is solved on the host in `f64`. Its gradient is exact and needs no custom
//! kernel: with `M = A S B^T`, `D = diag(1, 1, det(A B^T))` and `R = A D B^T`, a change `dM` turns
//! the optimum by
//!
//! ```text
//! dR = A D [ K o (N - N^T) ] B^T,   N = D A^T dM B,   K_ij = 1 / (p_i + p_j),   p = D s,
//! ```
//!
//! which is linear in `dM`. So `R0 + L(M - detach(M))` has the value `R0` and the derivative `L`
//! on every backend. Sums `p_i + p_j` are kept above `1e-3 p_1`, which bounds the gradient where
//! the rotation is not determined (lines, reflections); a matrix of zeros has gradient 0.

use burn::tensor::{Bool, Tensor, TensorData};
use nalgebra::{Matrix3, SVD, Vector3};

use crate::ops::{CopyError, to_host};

/// Smallest `p_i + p_j`, as a share of the largest singular value.
const MIN_GAP: f64 = 1e-3;
/// Largest singular value that counts as zero: the inverse of `MIN_GAP` times it still fits `f32`.
const ZERO: f64 = 1e-30;

/// The rotation nearest to each matrix: argmax of `tr(R^T M)` over SO(3), differentiable.
///
/// A matrix that is not finite gives the identity and a gradient that is not finite, so that the
/// training loop sees it and skips the step.
///
/// # Shapes
/// - `matrices`: `[batch, 3, 3]`
/// - output: `[batch, 3, 3]`, det = +1
///
/// # Errors
/// [`CopyError`] where the matrices cannot be copied to the host.
pub fn nearest_rotation(matrices: Tensor<3>) -> Result<Tensor<3>, CopyError> {
    let [batch, _, _] = matrices.dims();
    let device = matrices.device().without_autodiff();
    let values: Vec<f64> = to_host(&matrices)?;

    let mut parts: [Vec<f64>; 5] = Default::default(); // R0, A D, D A^T, B, K
    let mut unsolved = Vec::with_capacity(batch * 9);
    for m in values.chunks_exact(9) {
        let solved = Solved::new(&Matrix3::from_row_slice(m));
        unsolved.extend([solved.parts[1][(0, 0)].is_nan(); 9]);
        for (part, matrix) in parts.iter_mut().zip(solved.parts) {
            part.extend(matrix.transpose().iter()); // row-major
        }
    }
    let dtype = matrices.dtype();
    // In one copy: each would stop a GPU.
    let parts = Tensor::<3>::from_data(TensorData::new(parts.concat(), [5 * batch, 3, 3]), (&device, dtype));
    let [r0, ad, dat, b, k] = std::array::from_fn(|i| parts.clone().narrow(0, i * batch, batch));

    let change = matrices.clone() - matrices.detach(); // zero, with the derivative of M
    let n = dat.matmul(change).matmul(b.clone());
    let turn = k * (n.clone() - n.transpose());
    let rotation = r0.clone() + ad.matmul(turn).matmul(b.transpose());
    if !unsolved.contains(&true) {
        return Ok(rotation);
    }
    // The change of an unsolved matrix is NaN, not 0. Its factors turn any gradient into NaN, also
    // the 0 that comes back through the mask.
    let unsolved = Tensor::<3, Bool>::from_data(TensorData::new(unsolved, [batch, 3, 3]), &device);
    Ok(rotation.mask_where(unsolved, r0))
}

/// The constants of one 3 x 3 problem.
struct Solved {
    /// `R0, A D, D A^T, B, K`.
    parts: [Matrix3<f64>; 5],
}

impl Solved {
    fn new(m: &Matrix3<f64>) -> Self {
        let solved = m.iter().all(|v| v.is_finite()).then(|| SVD::new(*m, true, true));
        let Some(SVD { u: Some(a), v_t: Some(b_t), singular_values: s }) = solved else {
            let (one, bad) = (Matrix3::identity(), Matrix3::repeat(f64::NAN));
            return Self { parts: [one, bad, bad, one, one] };
        };
        // nalgebra sorts singular values in descending order, so the last one takes the sign.
        let d = Vector3::new(1.0, 1.0, (a * b_t).determinant().signum());
        let p = s.component_mul(&d);
        let k = match p[0] > ZERO {
            true => Matrix3::from_fn(|i, j| 1.0 / (p[i] + p[j]).max(MIN_GAP * p[0])),
            false => Matrix3::zeros(),
        };
        let ad = a * Matrix3::from_diagonal(&d);
        Self { parts: [ad * b_t, ad, ad.transpose(), b_t.transpose(), k] }
    }
}

/// The rigid motion that carries `source` onto `target`, point by point, in the least-squares sense.
///
/// # Shapes
/// - `source`, `target`: `[batch, points, 3]`
/// - output: rotation `[batch, 3, 3]` and translation `[batch, 3]`, `target ~ R source + t`
///
/// # Errors
/// [`CopyError`] where the cross-covariance cannot be copied to the host.
pub fn procrustes(source: Tensor<3>, target: Tensor<3>) -> Result<(Tensor<3>, Tensor<2>), CopyError> {
    let source_mean = source.clone().mean_dim(1); // [batch, 1, 3], Eq. (2)
    let target_mean = target.clone().mean_dim(1);
    // Eq. (3), transposed, so that Eq. (4) reads R = A D B^T: M = sum (y - ybar)(x - xbar)^T.
    let cross = (target - target_mean.clone()).transpose().matmul(source - source_mean.clone());
    let rotation = nearest_rotation(cross)?;
    let translation = target_mean - source_mean.matmul(rotation.clone().transpose()); // Eq. (4)
    Ok((rotation, translation.squeeze_dim::<2>(1)))
}

/// As [`procrustes`], where the points count by `weights`, which sum to 1 in each cloud. Differentiable
/// in the weights too.
///
/// # Shapes
/// - `source`, `target`: `[batch, points, 3]`, `weights`: `[batch, points, 1]`
/// - output: rotation `[batch, 3, 3]` and translation `[batch, 3]`, `target ~ R source + t`
///
/// # Errors
/// [`CopyError`] where the cross-covariance cannot be copied to the host.
pub fn weighted_procrustes(
    source: Tensor<3>,
    target: Tensor<3>,
    weights: Tensor<3>,
) -> Result<(Tensor<3>, Tensor<2>), CopyError> {
    let [_, points, _] = weights.dims();
    let source_mean = (source.clone() * weights.clone()).sum_dim(1); // [batch, 1, 3]
    let target_mean = (target.clone() * weights.clone()).sum_dim(1);
    let weighted = (target - target_mean.clone()) * weights * points as f64; // as many as unweighted
    let cross = weighted.transpose().matmul(source - source_mean.clone());
    let rotation = nearest_rotation(cross)?;
    let translation = target_mean - source_mean.matmul(rotation.clone().transpose());
    Ok((rotation, translation.squeeze_dim::<2>(1)))
}

/// `R p + t` for each point.
///
/// # Shapes
/// - `points`: `[batch, points, 3]`, `rotation`: `[batch, 3, 3]`, `translation`: `[batch, 3]`
/// - output: `[batch, points, 3]`
pub fn transform(points: Tensor<3>, rotation: Tensor<3>, translation: Tensor<2>) -> Tensor<3> {
    points.matmul(rotation.transpose()) + translation.unsqueeze_dim::<3>(1)
}
