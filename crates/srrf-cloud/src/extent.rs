//! Whether the coordinates of a cloud can be computed with.

use std::ops::RangeInclusive;

use crate::{CloudError, PointCloud};

/// Widths whose squares, and sums of them, are ordinary numbers.
const WIDTHS: RangeInclusive<f64> = 1e-100..=1e100;
/// Points so many times farther out than half of the cloud leave seven digits of the others.
const STRAY: f64 = 1e9;
/// Points that say how far out half of the cloud lies.
const SAMPLE: usize = 4096;

/// Refuses clouds whose lengths cannot be computed, and points beside which all others would coincide.
pub(crate) fn check(cloud: &PointCloud) -> Result<(), CloudError> {
    let points = cloud.points();
    // Halves, since a difference of two numbers may be larger than the largest one.
    let half_width = (0..3)
        .map(|c| {
            let range = points
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p[c]), high.max(p[c])]);
            0.5 * range[1] - 0.5 * range[0]
        })
        .fold(0.0, f64::max);
    // Points that coincide are told so elsewhere.
    if half_width == 0.0 {
        return Ok(());
    }
    let step = points.len().div_ceil(SAMPLE);
    let middle = |mut values: Vec<f64>| {
        let at = values.len() / 2;
        *values.select_nth_unstable_by(at, f64::total_cmp).1
    };
    let centre: [f64; 3] =
        std::array::from_fn(|c| middle(points.iter().step_by(step).map(|p| p[c]).collect()));
    let out = |p: &[f64; 3]| (0..3).map(|c| (0.5 * p[c] - 0.5 * centre[c]).abs()).fold(0.0, f64::max);
    let usual = middle(points.iter().step_by(step).map(out).collect());
    if usual > 0.0 && half_width / usual > STRAY {
        let stray = |p: &[f64; 3]| out(p) / usual > 0.5 * STRAY;
        if let Some(index) = points.iter().position(stray) {
            let count = points.iter().filter(|p| stray(p)).count();
            return Err(CloudError::Stray { count, index, point: points[index] });
        }
    }
    if !WIDTHS.contains(&(2.0 * half_width)) {
        return Err(CloudError::OutOfRange { size: 2.0 * half_width });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(points: &[[f64; 3]]) -> Result<(), CloudError> {
        check(&PointCloud::new(points.to_vec()).unwrap())
    }

    fn ball(size: f64) -> Vec<[f64; 3]> {
        (0..50)
            .map(|i| [f64::from(i), f64::from(i * i % 50), f64::from(i * 7 % 50)].map(|c| c * size))
            .collect()
    }

    #[test]
    fn ordinary_clouds_pass_wherever_they_lie() {
        for size in [1e-30, 1e-3, 1.0, 1e6, 1e30] {
            assert_eq!(checked(&ball(size)), Ok(()));
        }
        let far: Vec<[f64; 3]> = ball(0.01).into_iter().map(|p| [p[0] + 5e5, p[1] + 4e6, p[2]]).collect();
        assert_eq!(checked(&far), Ok(()));
        // Half of the points in one place, and impulse noise.
        let mut heap = vec![[0.0; 3]; 100];
        heap.push([1.0, 2.0, 3.0]);
        assert_eq!(checked(&heap), Ok(()));
        let mut noisy = ball(1.0);
        noisy.push([1e5, 0.0, 0.0]);
        assert_eq!(checked(&noisy), Ok(()));
    }

    #[test]
    fn what_cannot_be_computed_is_named() {
        for size in [1e155, 1e300, 1e-155] {
            assert!(matches!(checked(&ball(size)), Err(CloudError::OutOfRange { .. })), "{size}");
        }
        let mut stray = ball(1.0);
        stray.insert(3, [0.0, -1e160, 0.0]);
        let error = checked(&stray).unwrap_err();
        assert_eq!(error, CloudError::Stray { count: 1, index: 3, point: [0.0, -1e160, 0.0] });
        stray.push([1.7e308, 0.0, 0.0]);
        stray.push([-1.7e308, 0.0, 0.0]);
        assert!(matches!(checked(&stray), Err(CloudError::Stray { .. })));
    }
}
