//! Whether single precision is enough for a cloud.

use super::FormatError;

/// The share of the cloud's size by which rounding may move a point: a hundredth of a millimetre
/// on ten metres.
pub(super) const TOLERANCE: f64 = 1e-6;

/// Refuses points that 32-bit floats would move by more than a millionth of the cloud's size (the
/// diagonal of its bounding box), such as map coordinates.
///
/// # Errors
/// [`FormatError::Unwritable`], which says by how much.
pub(super) fn check_single(points: &[[f64; 3]], format: &str) -> Result<(), FormatError> {
    let (worst, size) = rounding(points);
    if worst.is_finite() && worst <= TOLERANCE * size {
        return Ok(());
    }
    Err(FormatError::Unwritable(format!(
        "{format} holds single precision, which would move points by up to {worst:.1e} on a cloud of size \
         {size:.1e}; write .ply or .pcd, which hold double precision, or subtract an offset first"
    )))
}

/// By how much single precision moves a coordinate at most, and the diagonal of the bounding box. Points with NaN or
/// infinity do not count.
pub(super) fn rounding(points: &[[f64; 3]]) -> (f64, f64) {
    let finite = || points.iter().filter(|p| p.iter().all(|c| c.is_finite()));
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let mut worst = 0.0f64;
    for point in finite() {
        for axis in 0..3 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
            worst = worst.max((point[axis] - f64::from(point[axis] as f32)).abs());
        }
    }
    let size = (0..3).map(|axis| (high[axis] - low[axis]).max(0.0)).fold(0.0, f64::hypot);
    (worst, size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fits_and_what_does_not() {
        assert_eq!(check_single(&[[0.1, 2.0, 3.0], [80.0, -80.0, f64::NAN], [80.0, 3.0, 1.0]], "x"), Ok(()));
        assert_eq!(check_single(&[[4_812_345.0, 2.0, 3.0]], "x"), Ok(()), "exact");
        assert_eq!(check_single(&[], "x"), Ok(()));
        assert!(check_single(&[[4_812_345.678, 0.0, 0.0], [4_812_346.0, 9.0, 9.0]], "x").is_err());
        assert!(check_single(&[[1e300, 0.0, 0.0]], "x").is_err(), "overflow");
        assert!(check_single(&[[1e308, 0.0, 0.0], [-1e308, 0.0, 0.0]], "x").is_err(), "overflow of the size");
    }
}
