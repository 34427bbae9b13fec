//! Numbers to a [`Rigid`], with what can be wrong with them.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::{PoseFileError, QuaternionOrder};
use crate::Rigid;

/// How far `R^T R` may be from the identity in files: what rows of four decimals come to.
const TOLERANCE: f64 = 1e-3;
/// Rotations that are this exact stay as they are.
const EXACT: f64 = 1e-9;

/// A pose from 12 or 16 numbers, row by row.
pub(super) fn pose_of_matrix(numbers: &[f64]) -> Result<Rigid, PoseFileError> {
    if !numbers.iter().all(|number| number.is_finite()) {
        return Err(PoseFileError::NotFinite);
    }
    let at = |row: usize, column: usize| numbers.get(4 * row + column).copied().unwrap_or(f64::NAN);
    if let &[x, y, z, w] = numbers.get(12..).unwrap_or_default() {
        let row = [x, y, z, w];
        if far(&row, &[0.0, 0.0, 0.0, 1.0]) {
            let last_column = [at(0, 3), at(1, 3), at(2, 3), w];
            let transposed = !far(&last_column, &[0.0, 0.0, 0.0, 1.0]);
            return Err(if transposed {
                PoseFileError::Transposed { row }
            } else {
                PoseFileError::LastRow { row }
            });
        }
    }
    let rotation = rotation(Matrix3::from_fn(at))?;
    Ok(Rigid { rotation, translation: Vector3::new(at(0, 3), at(1, 3), at(2, 3)) })
}

fn far(have: &[f64; 4], want: &[f64; 4]) -> bool {
    have.iter().zip(want).any(|(have, want)| (have - want).abs() > 1e-9)
}

fn rotation(matrix: Matrix3<f64>) -> Result<Matrix3<f64>, PoseFileError> {
    let off = off_rotation(&matrix);
    if off > TOLERANCE {
        let lengths: [f64; 3] = std::array::from_fn(|column| matrix.column(column).norm());
        let scale = lengths.iter().sum::<f64>() / 3.0;
        return Err(if scale > 0.0 && scale.is_finite() && off_rotation(&(matrix / scale)) <= TOLERANCE {
            PoseFileError::Scale { scale: shortened(scale) }
        } else {
            PoseFileError::NotRotation { lengths: lengths.map(shortened), off }
        });
    }
    if matrix.determinant() < 0.0 {
        return Err(PoseFileError::Mirror);
    }
    if off < EXACT {
        return Ok(matrix);
    }
    Rigid::nearest_rotation(&matrix).ok_or(PoseFileError::NotFinite)
}

/// Greatest entry of `|R^T R - I|`; infinite where one is no number.
fn off_rotation(matrix: &Matrix3<f64>) -> f64 {
    let rest = matrix.transpose() * matrix - Matrix3::identity();
    rest.iter().fold(0.0, |most: f64, v| if v.is_nan() { f64::INFINITY } else { most.max(v.abs()) })
}

/// Six significant digits, for messages.
fn shortened(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// A pose from `tx ty tz` and a quaternion.
pub(super) fn pose_of_quaternion(numbers: [f64; 7], order: QuaternionOrder) -> Result<Rigid, PoseFileError> {
    if !numbers.iter().all(|number| number.is_finite()) {
        return Err(PoseFileError::NotFinite);
    }
    let [x, y, z, a, b, c, d] = numbers;
    let length = |four: [f64; 4]| four.iter().fold(0.0, |sum: f64, v| sum.hypot(*v));
    let (first, last) = (length([x, y, z, a]), length([a, b, c, d]));
    if (last - 1.0).abs() > TOLERANCE {
        let ahead = (first - 1.0).abs() <= TOLERANCE;
        return Err(match ahead {
            true => PoseFileError::QuaternionFirst { length: last },
            false => PoseFileError::Quaternion { length: last },
        });
    }
    let quaternion = match order {
        QuaternionOrder::Xyzw => Quaternion::new(d, a, b, c),
        QuaternionOrder::Wxyz => Quaternion::new(a, b, c, d),
    };
    let rotation = UnitQuaternion::new_normalize(quaternion).to_rotation_matrix().into_inner();
    Ok(Rigid { rotation, translation: Vector3::new(x, y, z) })
}
