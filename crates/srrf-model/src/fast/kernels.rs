//! Matrix products and row-wise loops on plain slices, single-threaded: shards run side by side.

use burn::tensor::TensorData;
use burn_flex::FlexTensor;
use gemm::Parallelism;

pub use crate::ops::simd::vectorized;

/// The values of a tensor in row-major order, and the tensor that holds them.
pub fn contiguous(tensor: FlexTensor) -> FlexTensor {
    tensor.to_contiguous()
}

/// The values of a contiguous `f32` tensor; empty for any other, which no caller passes.
pub fn values(tensor: &FlexTensor) -> &[f32] {
    tensor.as_slice::<f32>().unwrap_or_default()
}

/// A tensor of these values.
pub fn tensor<const D: usize>(values: Vec<f32>, shape: [usize; D]) -> FlexTensor {
    FlexTensor::from_data(TensorData::new(values, shape))
}

/// A matrix inside a slice: element `(i, j)` is at `start + i * row + j * column`.
#[derive(Clone, Copy)]
pub struct Matrix {
    pub start: usize,
    pub rows: usize,
    pub columns: usize,
    pub row: usize,
    pub column: usize,
}

impl Matrix {
    /// All of a row-major `rows x columns` slice.
    pub fn new(rows: usize, columns: usize) -> Self {
        Self { start: 0, rows, columns, row: columns, column: 1 }
    }

    /// The transpose.
    pub fn t(self) -> Self {
        Self { rows: self.columns, columns: self.rows, row: self.column, column: self.row, ..self }
    }

    /// `rows` rows from `row` on, `columns` columns from `column` on.
    pub fn part(self, row: usize, rows: usize, column: usize, columns: usize) -> Self {
        Self { start: self.start + row * self.row + column * self.column, rows, columns, ..self }
    }

    /// One more than the largest index in use.
    fn end(&self) -> usize {
        match self.rows * self.columns {
            0 => self.start,
            _ => self.start + (self.rows - 1) * self.row + (self.columns - 1) * self.column + 1,
        }
    }
}

/// `out = scale * a b`, or `out += scale * a b` where `add`.
///
/// # Panics
/// Where the sizes do not fit each other or the slices: a bug of the caller.
pub fn matmul(
    (out, o): (&mut [f32], Matrix),
    add: bool,
    scale: f32,
    (a, ma): (&[f32], Matrix),
    (b, mb): (&[f32], Matrix),
) {
    assert!(o.rows == ma.rows && o.columns == mb.columns && ma.columns == mb.rows);
    assert!(o.end() <= out.len() && ma.end() <= a.len() && mb.end() <= b.len());
    // SAFETY: all three matrices lie inside their slices (checked above), and `out` is borrowed
    // exclusively, so it overlaps neither of the others.
    unsafe {
        gemm::gemm(
            o.rows,
            o.columns,
            ma.columns,
            out.as_mut_ptr().add(o.start),
            o.column as isize,
            o.row as isize,
            add,
            a.as_ptr().add(ma.start),
            ma.column as isize,
            ma.row as isize,
            b.as_ptr().add(mb.start),
            mb.column as isize,
            mb.row as isize,
            1.0_f32,
            scale,
            false,
            false,
            false,
            Parallelism::None,
        );
    }
}

/// `e^x` to 2 units in the last place, 0 below -87, without a call, so that loops of it vectorise.
/// Cody-Waite reduction and the minimax polynomial of Cephes' `expf`.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    let x = x.clamp(-87.0, 88.0);
    // Adding 1.5 * 2^23 rounds to the nearest integer and leaves it in the low bits.
    let shifted = x * std::f32::consts::LOG2_E + 12_582_912.0;
    let n = shifted - 12_582_912.0;
    let r = (x - n * 0.693_359_4) - n * -2.121_944_4e-4;
    let mut p = 1.987_569_1e-4_f32;
    for c in [1.398_2e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 0.5] {
        p = p * r + c;
    }
    let p = p * r * r + r + 1.0;
    f32::from_bits(p.to_bits().wrapping_add(shifted.to_bits() << 23))
}

/// Replaces each row of `columns` values by its softmax.
pub fn softmax_rows(x: &mut [f32], columns: usize) {
    vectorized(
        #[inline(always)]
        || {
            for row in x.chunks_exact_mut(columns) {
                let mut lanes = [f32::NEG_INFINITY; 16];
                let chunks = row.chunks_exact(16);
                let mut top = chunks.remainder().iter().fold(f32::NEG_INFINITY, |a, &v| a.max(v));
                for chunk in chunks {
                    for (lane, &v) in lanes.iter_mut().zip(chunk) {
                        *lane = if v > *lane { v } else { *lane };
                    }
                }
                top = lanes.iter().fold(top, |a, &v| a.max(v));
                for v in row.iter_mut() {
                    *v = exp(*v - top);
                }
                let scale = 1.0 / sum(row);
                for v in row.iter_mut() {
                    *v *= scale;
                }
            }
        },
    );
}

/// Sum of the values, in 16 lanes.
#[inline(always)]
pub fn sum(x: &[f32]) -> f32 {
    let mut lanes = [0.0_f32; 16];
    let chunks = x.chunks_exact(16);
    let rest: f32 = chunks.remainder().iter().sum();
    for chunk in chunks {
        for (lane, &v) in lanes.iter_mut().zip(chunk) {
            *lane += v;
        }
    }
    rest + lanes.iter().sum::<f32>()
}

/// Sum of the products of two slices, in 16 lanes.
#[inline(always)]
pub fn dot(x: &[f32], y: &[f32]) -> f32 {
    let mut lanes = [0.0_f32; 16];
    let (xs, ys) = (x.chunks_exact(16), y.chunks_exact(16));
    let rest: f32 = xs.remainder().iter().zip(ys.remainder()).map(|(a, b)| a * b).sum();
    for (x, y) in xs.zip(ys) {
        for ((lane, &a), &b) in lanes.iter_mut().zip(x).zip(y) {
            *lane += a * b;
        }
    }
    rest + lanes.iter().sum::<f32>()
}

/// Adds each row of `columns` values to `out`.
pub fn add_rows(out: &mut [f32], x: &[f32], columns: usize) {
    vectorized(
        #[inline(always)]
        || {
            for row in x.chunks_exact(columns) {
                for (o, &v) in out.iter_mut().zip(row) {
                    *o += v;
                }
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_is_that_of_the_library() {
        for i in -8700..=8800 {
            let x = i as f32 * 0.01;
            let (ours, true_value) = (f64::from(exp(x)), f64::from(x).exp());
            assert!((ours / true_value - 1.0).abs() < 4e-7, "{x}: {ours} {true_value}");
        }
        assert_eq!(exp(0.0), 1.0);
        assert!(exp(-1e30) < 1e-37);
    }

    #[test]
    fn products_of_parts_agree_with_loops() {
        let value = |i: usize| ((i * 7919) % 101) as f32 / 50.0 - 1.0;
        let a: Vec<f32> = (0..9 * 14).map(value).collect();
        let b: Vec<f32> = (0..11 * 5).map(|i| value(i + 3)).collect();
        let ma = Matrix::new(9, 14).part(2, 6, 3, 11).t().t();
        let mb = Matrix::new(5, 11).t(); // 11 x 5
        let mo = Matrix::new(7, 8).part(1, 6, 2, 5);
        let mut out: Vec<f32> = (0..7 * 8).map(|i| value(i + 40)).collect();
        let before = out.clone();
        matmul((&mut out, mo), true, 0.5, (&a, ma), (&b, mb));
        let at = |m: &Matrix, i: usize, j: usize| m.start + i * m.row + j * m.column;
        for i in 0..7 {
            for j in 0..8 {
                let mut wanted = before[i * 8 + j];
                if (1..7).contains(&i) && (2..7).contains(&j) {
                    let product: f32 = (0..11).map(|k| a[at(&ma, i - 1, k)] * b[at(&mb, k, j - 2)]).sum();
                    wanted += 0.5 * product;
                }
                assert!((out[i * 8 + j] - wanted).abs() < 1e-5);
            }
        }
    }
}
