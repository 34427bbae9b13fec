//! [`Camera`]: from places to pixels.

use nalgebra::{Matrix3, Vector3};

use crate::Up;

/// Half of the camera's angle of view, as a slope.
const SLOPE: f64 = 0.315_298_788_878_984_2; // 17.5 degrees
/// Where it stands, seen from the middle of what it looks at: x to the right, y up, z towards the reader.
const FROM: [f64; 3] = [0.55, 0.42, 1.0];
/// How far beyond what must be seen the picture reaches.
const MARGIN: f64 = 1.06;

/// A camera that looks at a set of points.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    /// Rows: to the right, up, towards the reader.
    axes: Matrix3<f64>,
    /// What it looks at, along the axes.
    centre: Vector3<f64>,
    /// From there to the camera.
    distance: f64,
    /// Radius of what it looks at.
    reach: f64,
    size: [f64; 2],
}

impl Camera {
    /// The camera of a picture of `size` pixels that shows all of `points`; there must be one at least.
    pub fn around(points: &[[f64; 3]], up: Up, size: [usize; 2]) -> Self {
        let to_screen = screen(up);
        let back = Vector3::from(FROM).normalize();
        let right = Vector3::y().cross(&back).normalize();
        let axes = Matrix3::from_rows(&[right, back.cross(&right), back].map(|a| a.transpose())) * to_screen;
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in points {
            let p = axes * Vector3::from(*p);
            for c in 0..3 {
                (low[c], high[c]) = (low[c].min(p[c]), high[c].max(p[c]));
            }
        }
        let middle: [f64; 3] = std::array::from_fn(|c| low[c] / 2.0 + high[c] / 2.0);
        let centre = Vector3::from(middle);
        let size = size.map(|s| s as f64);
        let aspect = size[0] / size[1];
        let (mut distance, mut reach) = (0.0f64, 0.0f64);
        for p in points {
            let d = axes * Vector3::from(*p) - centre;
            distance = distance.max(d.z + MARGIN * d.y.abs().max(d.x.abs() / aspect) / SLOPE);
            reach = reach.max(d.norm());
        }
        // All in one place: it is in the middle.
        let distance = if distance > 0.0 && distance.is_finite() { distance } else { 1.0 };
        Self { axes, centre, distance, reach, size }
    }

    /// The pixel of a place, its distance along the view, and how far back it is among what is seen, from 0 to 1. None behind the
    /// camera.
    pub fn project(&self, point: &[f64; 3]) -> Option<([f64; 2], f32, f64)> {
        let d = self.axes * Vector3::from(*point) - self.centre;
        let depth = self.distance - d.z;
        if depth.is_nan() || depth <= 1e-3 * self.distance {
            return None;
        }
        let [width, height] = self.size;
        let scale = height / 2.0 / SLOPE / depth;
        let back = if self.reach > 0.0 { ((1.0 - d.z / self.reach) / 2.0).clamp(0.0, 1.0) } else { 0.0 };
        Some(([width / 2.0 + scale * d.x, height / 2.0 - scale * d.y], depth as f32, back))
    }
}

/// Turns the axes so that `up` is the screen's y.
fn screen(up: Up) -> Matrix3<f64> {
    let rows = match up {
        Up::Y => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        Up::MinusY => [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]],
        Up::Z => [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
        Up::MinusZ => [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
        Up::X => [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        Up::MinusX => [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
    };
    Matrix3::from_row_slice(rows.as_flattened())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn up_is_up_and_all_is_seen() {
        for up in Up::ALL {
            assert!((screen(up).determinant() - 1.0).abs() < 1e-12, "{up:?}: no mirror image");
            let axis = up.name().trim_start_matches('-');
            let sign = if up.name().starts_with('-') { -1.0 } else { 1.0 };
            let mut high = [0.0; 3];
            high[["x", "y", "z"].iter().position(|a| *a == axis).unwrap()] = 5.0 * sign;
            let points = [[0.0; 3], high, [1.0, 2.0, 3.0], [-4.0, 0.5, 2.0]];
            let camera = Camera::around(&points, up, [300, 200]);
            let at = points.map(|p| camera.project(&p).unwrap().0);
            assert!(at[1][1] < at[0][1] - 10.0, "{up:?}: {at:?}");
            assert!(at.iter().all(|[x, y]| (0.0..300.0).contains(x) && (0.0..200.0).contains(y)), "{at:?}");
            let spread =
                at.iter().map(|p| p[1]).fold(0.0, f64::max) - at.iter().map(|p| p[1]).fold(200.0, f64::min);
            let wide =
                at.iter().map(|p| p[0]).fold(0.0, f64::max) - at.iter().map(|p| p[0]).fold(300.0, f64::min);
            assert!(spread > 120.0 || wide > 180.0, "{up:?}: the picture is filled, {at:?}");
        }
    }

    #[test]
    fn one_place_is_in_the_middle() {
        let camera = Camera::around(&[[5e5; 3]; 2], Up::Z, [30, 20]);
        assert_eq!(camera.project(&[5e5; 3]).unwrap().0, [15.0, 10.0]);
    }
}
