//! The SVD head: rotations at every kind of input, and gradients against central differences in
//! `f64`.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]
#![allow(clippy::expect_used, reason = "helpers of tests")]

mod common;

use burn::tensor::{DType, Device, Tensor, TensorData};
use common::{Numbers, difference, row_major, tensor64, values};
use nalgebra::{Matrix3, Vector3};
use srrf_cloud::Rigid;
use srrf_model::{nearest_rotation, procrustes, weighted_procrustes};

/// The share of the largest singular value below which the head keeps no gap.
const MIN_GAP: f64 = 1e-3;

/// `A diag(s) B^T` with drawn rotations, so that the determinant has the sign of the product of `s`.
fn with_singular_values(s: [f64; 3], numbers: &mut Numbers) -> (Matrix3<f64>, Matrix3<f64>, Matrix3<f64>) {
    let (a, b) = (numbers.rotation(180.0), numbers.rotation(180.0));
    (a * Matrix3::from_diagonal(&Vector3::from(s)) * b.transpose(), a, b)
}

/// Gradient of `sum C o R(M)` by the head.
fn gradient(m: &Matrix3<f64>, c: &Matrix3<f64>) -> Matrix3<f64> {
    let device = Device::flex().autodiff();
    let input = tensor64::<3>(&row_major(m), [1, 3, 3], &device).require_grad();
    let weights = tensor64::<3>(&row_major(c), [1, 3, 3], &device);
    let grads = (nearest_rotation(input.clone()).unwrap() * weights).sum().backward();
    Matrix3::from_row_slice(&values(&input.grad(&grads).expect("a gradient")))
}

/// `sum C o R(M)`.
fn value(m: &Matrix3<f64>, c: &Matrix3<f64>) -> f64 {
    let input = tensor64::<3>(&row_major(m), [1, 3, 3], &Device::flex());
    Matrix3::from_row_slice(&values(&nearest_rotation(input).unwrap())).component_mul(c).sum()
}

/// Central difference of [`value`] along `direction`.
fn along(m: &Matrix3<f64>, c: &Matrix3<f64>, direction: &Matrix3<f64>, step: f64) -> f64 {
    (value(&(m + step * direction), c) - value(&(m - step * direction), c)) / (2.0 * step)
}

#[test]
fn gradient_of_the_rotation_is_that_of_finite_differences() {
    let mut numbers = Numbers(1);
    let kinds: [(&str, [f64; 3]); 11] = [
        ("well apart", [3.0, 2.0, 0.7]),
        ("large", [3e4, 2e3, 700.0]),
        ("small", [3e-5, 2e-5, 7e-6]),
        ("two close", [2.0, 2.0 - 1e-9, 0.5]),
        ("two equal", [2.0, 0.5, 0.5]),
        ("all equal", [1.5, 1.5, 1.5]),
        ("rank 2", [2.0, 1.0, 0.0]),
        ("rank 2, equal", [1.0, 1.0, 0.0]),
        ("reflected", [3.0, 2.0, -0.7]),
        ("reflected, nearer", [2.0, 1.0, -0.9]),
        ("reflected, two equal", [2.0, 2.0, -0.5]),
    ];
    for (kind, s) in kinds {
        for _ in 0..3 {
            let (m, _, _) = with_singular_values(s, &mut numbers);
            let c = Matrix3::from_row_slice(&numbers.many(9));
            let found = gradient(&m, &c);
            let scale = s[1] + s[2]; // the smallest p_i + p_j, which sets the size of the gradient
            let wanted = Matrix3::from_fn(|i, j| {
                let mut direction = Matrix3::zeros();
                direction[(i, j)] = 1.0;
                along(&m, &c, &direction, 1e-5 * scale)
            });
            let error = (found - wanted).abs().max() * scale;
            assert!(error < 1e-8, "{kind}: {error:e}\n{found}{wanted}");
            assert!(wanted.abs().max() * scale > 1e-3, "{kind}: the gradient is not zero");
        }
    }
}

#[test]
fn gradient_is_bounded_where_the_rotation_is_hardly_determined() {
    // A reflected matrix whose p_2 + p_3 is under the floor: the turn about the first axis has its
    // gradient cut down to floor size, the two other turns keep theirs.
    let mut numbers = Numbers(2);
    let gap = 1e-4;
    let (m, a, b) = with_singular_values([1.0, 0.5, gap - 0.5], &mut numbers);
    let c = Matrix3::from_row_slice(&numbers.many(9));
    let found = gradient(&m, &c);
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        let mut turn = Matrix3::zeros();
        (turn[(i, j)], turn[(j, i)]) = (1.0, -1.0);
        // In the frame of p = D s the direction is A D turn B^T, with D = diag(1, 1, -1) folded in A.
        let direction = a * turn * b.transpose();
        let wanted = along(&m, &c, &direction, 3e-3 * gap);
        let cut = if (i, j) == (1, 2) { gap / MIN_GAP } else { 1.0 };
        let ours = found.component_mul(&direction).sum();
        assert!(
            (ours - cut * wanted).abs() < 1e-4 * wanted.abs().max(1.0),
            "{i} {j}: {ours} {}",
            cut * wanted
        );
    }

    // Lines, reflections without a gap, and nothing at all: finite, and no larger than the floor allows.
    for (s, largest) in
        [([2.0, 0.0, 0.0], 2.0), ([2.0, 1.0, -1.0], 2.0), ([1.0, 1.0, -1.0], 1.0), ([1e-12, 0.0, 0.0], 1e-12)]
    {
        let (m, _, _) = with_singular_values(s, &mut numbers);
        let found = gradient(&m, &c);
        // |dR| <= |A D (K o (N - N^T)) B^T| <= max K * 2 |dM|, in Frobenius norms.
        let bound = 2.0 * c.norm() / (MIN_GAP * largest);
        assert!(found.norm() <= bound * (1.0 + 1e-9), "{s:?}: {} over {bound}", found.norm());
    }
    assert_eq!(gradient(&Matrix3::zeros(), &c), Matrix3::zeros(), "no points, no preferred turn");
}

#[test]
fn gradients_of_the_pose_are_those_of_finite_differences() {
    let (batch, points) = (5, 7);
    let mut numbers = Numbers(3);
    let size = batch * points * 3;
    let source = numbers.many(size);
    // Noisy images under drawn poses; pair 1 is mirrored, pair 2 lies near a plane, 3 on it, and
    // 4 is unrelated.
    let mut target = Vec::new();
    let mut source = source;
    for (i, cloud) in source.chunks_exact_mut(points * 3).enumerate() {
        let (rotation, t) = (numbers.rotation(120.0), Vector3::from_vec(numbers.many(3)));
        for p in cloud.chunks_exact_mut(3) {
            p[2] *= if i == 2 {
                1e-3
            } else if i == 3 {
                0.0
            } else {
                1.0
            };
            let mirrored = Vector3::new(if i == 1 { -p[0] } else { p[0] }, p[1], p[2]);
            let noise = if i == 3 { 0.0 } else { 0.1 };
            let image = rotation * mirrored + t + Vector3::from_vec(numbers.many(3)) * noise;
            let unrelated = numbers.many(3);
            target.extend(if i == 4 { unrelated } else { image.as_slice().to_vec() });
        }
    }
    let (c, d) = (numbers.many(batch * 9), numbers.many(batch * 3));
    let score = |source: Tensor<3>, target: Tensor<3>, device: &Device| {
        let (rotation, translation) = procrustes(source, target).unwrap();
        (rotation * tensor64::<3>(&c, [batch, 3, 3], device)).sum()
            + (translation * tensor64::<2>(&d, [batch, 3], device)).sum()
    };

    let device = Device::flex().autodiff();
    let x = tensor64::<3>(&source, [batch, points, 3], &device).require_grad();
    let y = tensor64::<3>(&target, [batch, points, 3], &device).require_grad();
    let grads = score(x.clone(), y.clone(), &device).backward();
    let plain = Device::flex();
    let at = |source: &[f64], target: &[f64]| {
        let cloud = |v: &[f64]| tensor64::<3>(v, [batch, points, 3], &plain);
        values(&score(cloud(source), cloud(target), &plain))[0]
    };
    for (name, found, of_source) in [("source", x.grad(&grads), true), ("target", y.grad(&grads), false)] {
        let found = values(&found.expect("a gradient"));
        let mut wanted = Vec::new();
        for i in 0..size {
            let moved = |step: f64| {
                let (mut s, mut t) = (source.clone(), target.clone());
                if of_source {
                    s[i] += step
                } else {
                    t[i] += step
                }
                at(&s, &t)
            };
            wanted.push((moved(1e-5) - moved(-1e-5)) / 2e-5);
        }
        let error = difference(&found, &wanted);
        assert!(error < 1e-7, "{name}: {error:e}");
    }
}

#[test]
fn rotations_are_proper_whatever_comes_in() {
    let mut numbers = Numbers(4);
    let mut matrices = vec![
        Matrix3::zeros(),
        Matrix3::identity(),
        -Matrix3::identity(),
        Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0)),
        Matrix3::repeat(1.0),
        Matrix3::repeat(1e-38),
        Matrix3::repeat(-1e-45),
        Matrix3::identity() * 1e37,
        Matrix3::repeat(f64::NAN),
        Matrix3::from_diagonal(&Vector3::new(f64::INFINITY, 1.0, 1.0)),
    ];
    for s in [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1e-9, -1e-9], [5.0, 5.0, -5.0], [1.0, 1e-20, 1e-20]] {
        matrices.push(with_singular_values(s, &mut numbers).0);
    }
    matrices.extend((0..200).map(|_| Matrix3::from_row_slice(&numbers.many(9))));
    let flat: Vec<f64> = matrices.iter().flat_map(row_major).collect();
    for (dtype, tolerance) in [(DType::F32, 1e-6), (DType::F64, 1e-13)] {
        for device in [Device::flex(), Device::flex().autodiff()] {
            let shape = [matrices.len(), 3, 3];
            let input = Tensor::<3>::from_data(TensorData::new(flat.clone(), shape), (&device, dtype));
            for (m, r) in matrices.iter().zip(values(&nearest_rotation(input).unwrap()).chunks_exact(9)) {
                let r = Matrix3::from_row_slice(r);
                let skew = (r.transpose() * r - Matrix3::identity()).abs().max();
                assert!((r.determinant() - 1.0).abs() < tolerance && skew < tolerance, "{m}{r}");
            }
        }
    }
}

#[test]
fn rotation_is_the_nearest_one() {
    let mut numbers = Numbers(5);
    for _ in 0..50 {
        let m = Matrix3::from_row_slice(&numbers.many(9));
        let best = value(&m, &m); // tr(R^T M)
        for _ in 0..50 {
            let other = numbers.rotation(180.0);
            assert!(other.component_mul(&m).sum() <= best + 1e-12);
        }
    }
}

#[test]
fn a_matrix_that_is_not_finite_shows_in_the_gradient_of_its_own_pair_only() {
    let device = Device::flex().autodiff();
    let mut numbers = Numbers(6);
    let mut flat = numbers.many(27);
    flat[13] = f64::NAN;
    let input = tensor64::<3>(&flat, [3, 3, 3], &device).require_grad();
    let rotation = nearest_rotation(input.clone()).unwrap();
    let identity = row_major(&Matrix3::identity());
    assert_eq!(values(&rotation)[9..18], identity[..]);
    let weights = tensor64::<3>(&numbers.many(27), [3, 3, 3], &device);
    let grads = (rotation * weights).sum().backward();
    let found = values(&input.grad(&grads).expect("a gradient"));
    assert!(found[..9].iter().chain(&found[18..]).all(|v| v.is_finite()));
    assert!(found[9..18].iter().any(|v| !v.is_finite()));
}

#[test]
fn known_poses_are_recovered() {
    let mut numbers = Numbers(7);
    for (dtype, tolerance) in [(DType::F32, 3e-6), (DType::F64, 1e-12)] {
        for points in [3, 4, 101] {
            for flat in [1.0, 0.0] {
                let pose = numbers.rotation(180.0);
                let turned = pose * Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0)); // 180 degrees more
                for rotation in [pose, turned, Matrix3::identity()] {
                    let t = Vector3::from_vec(numbers.many(3));
                    let cloud: Vec<Vector3<f64>> = (0..points)
                        .map(|_| Vector3::new(numbers.signed(), numbers.signed(), flat * numbers.signed()))
                        .collect();
                    let tensor = |points: Vec<f64>, n| {
                        Tensor::<3>::from_data(TensorData::new(points, [1, n, 3]), (&Device::flex(), dtype))
                    };
                    let source = tensor(cloud.iter().flatten().copied().collect(), points);
                    let target =
                        tensor(cloud.iter().flat_map(|p| (rotation * p + t).data.0[0]).collect(), points);
                    let (found, found_t) = procrustes(source, target).unwrap();
                    let error = difference(&values(&found), &row_major(&rotation));
                    assert!(error < tolerance * 100.0 / 4.0, "{points} points, {dtype:?}: {error:e}");
                    assert!(difference(&values(&found_t), t.as_slice()) < tolerance * 25.0);
                }
            }
        }
    }
}

#[test]
fn weighted_fit_is_that_of_the_host_and_differentiable_in_the_weights() {
    const N: usize = 17;
    let mut numbers = Numbers(31);
    let (x, y) = (numbers.many(N * 3), numbers.many(N * 3));
    let raw: Vec<f64> = numbers.many(N).iter().map(|v| v * v + 0.01).collect();
    let total: f64 = raw.iter().sum();
    let weights: Vec<f64> = raw.iter().map(|v| v / total).collect();
    let fit = |weights: &[f64], device: &Device| {
        let points = |v: &[f64]| tensor64::<3>(v, [1, N, 3], device);
        let mut w = tensor64::<3>(weights, [1, N, 1], device);
        if device.is_autodiff() {
            w = w.require_grad();
        }
        let (rotation, translation) = weighted_procrustes(points(&x), points(&y), w.clone()).unwrap();
        (w, rotation, translation)
    };
    let (_, rotation, translation) = fit(&weights, &Device::flex());
    let rows = |v: &[f64]| -> Vec<[f64; 3]> { v.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect() };
    let wanted = Rigid::fit(&rows(&x), &rows(&y), Some(&weights)).expect("a pose");
    assert!(difference(&values(&rotation), &row_major(&wanted.rotation)) < 1e-9);
    assert!(difference(&values(&translation), wanted.translation.as_slice()) < 1e-9);

    let c = numbers.many(9);
    let sum = |weights: &[f64]| -> f64 {
        let (_, rotation, translation) = fit(weights, &Device::flex());
        let turned: f64 = values(&rotation).iter().zip(&c).map(|(r, c)| r * c).sum();
        turned + values(&translation).iter().sum::<f64>()
    };
    let device = Device::flex().autodiff();
    let (w, rotation, translation) = fit(&weights, &device);
    let loss = (rotation * tensor64::<3>(&c, [1, 3, 3], &device)).sum() + translation.sum();
    let gradient = values(&w.grad(&loss.backward()).expect("a gradient"));
    for i in (0..N).step_by(4) {
        let moved = |step: f64| {
            let mut weights = weights.clone();
            weights[i] += step;
            sum(&weights)
        };
        let slope = (moved(1e-6) - moved(-1e-6)) / 2e-6;
        assert!((gradient[i] - slope).abs() < 1e-5 * (1.0 + slope.abs()), "{i}: {} {slope}", gradient[i]);
    }
}
