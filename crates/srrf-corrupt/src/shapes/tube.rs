//! [`Tube`]: a round rod along a polyline, of varying thickness.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;
use rand::{Rng, RngExt};

/// A ball of varying radius swept along a polyline; its ends are round.
#[derive(Debug, Clone)]
pub(crate) struct Tube {
    path: Vec<Vector3<f64>>,
    radii: Vec<f64>,
    /// The segments, then the two ends.
    running_area: Vec<f64>,
}

impl Tube {
    /// `path` and `radii` of the same length, 2 or more; the shorter of them counts.
    pub fn new(path: &[[f64; 3]], radii: &[f64]) -> Self {
        let n = path.len().min(radii.len());
        let path: Vec<Vector3<f64>> = path[..n].iter().map(|p| Vector3::from(*p)).collect();
        let radii = radii[..n].to_vec();
        let mut running_area = Vec::with_capacity(n + 1);
        let mut total = 0.0;
        for k in 1..n {
            let slant = (path[k] - path[k - 1]).norm().hypot(radii[k] - radii[k - 1]);
            total += PI * (radii[k] + radii[k - 1]) * slant;
            running_area.push(total);
        }
        for end in [radii.first(), radii.last()] {
            total += TAU * end.map_or(0.0, |r| r * r);
            running_area.push(total);
        }
        Self { path, radii, running_area }
    }

    pub fn area(&self) -> f64 {
        self.running_area.last().copied().unwrap_or(0.0)
    }

    /// A point drawn by area. On the inner side of bends the segments run into each other; points
    /// inside the tube are drawn again.
    pub fn sample(&self, rng: &mut impl Rng) -> Vector3<f64> {
        let mut point = self.draw(rng);
        for _ in 0..8 {
            if !self.within(&point, 0.98) {
                break;
            }
            point = self.draw(rng);
        }
        point
    }

    fn draw(&self, rng: &mut impl Rng) -> Vector3<f64> {
        let at = rng.random::<f64>() * self.area();
        let k = self.running_area.partition_point(|&area| area <= at);
        let segments = self.path.len() - 1;
        if k >= segments {
            let (end, before) = if k == segments { (0, 1) } else { (segments, segments - 1) };
            let outward = (self.path[end] - self.path[before]).normalize();
            let direction = unit_vector(rng);
            let direction = if direction.dot(&outward) < 0.0 { -direction } else { direction };
            return self.path[end] + direction * self.radii[end];
        }
        let (a, b, r0, r1) = (self.path[k], self.path[k + 1], self.radii[k], self.radii[k + 1]);
        let u: f64 = rng.random();
        let along = if (r1 - r0).abs() > 1e-9 * (r0 + r1) {
            ((r0 * r0 + u * (r1 * r1 - r0 * r0)).sqrt() - r0) / (r1 - r0)
        } else {
            u
        };
        let axis = (b - a).normalize();
        let side = axis.cross(&perpendicular_seed(&axis)).normalize();
        let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
        a + (b - a) * along + (side * cos + axis.cross(&side) * sin) * (r0 + along * (r1 - r0))
    }

    /// Whether `p` lies strictly inside.
    pub fn contains(&self, p: &Vector3<f64>) -> bool {
        self.within(p, 1.0)
    }

    fn within(&self, p: &Vector3<f64>, share: f64) -> bool {
        self.path.windows(2).zip(self.radii.windows(2)).any(|(ends, r)| {
            let axis = ends[1] - ends[0];
            let along = ((p - ends[0]).dot(&axis) / axis.norm_squared()).clamp(0.0, 1.0);
            let radius = share * (r[0] + along * (r[1] - r[0]));
            (p - ends[0] - axis * along).norm_squared() < radius * radius
        })
    }

    /// Points whose hull holds the surface.
    pub fn hull(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        self.path.iter().zip(&self.radii).flat_map(|(p, &r)| {
            let corner = |x: f64, y: f64, z: f64| p + Vector3::new(x, y, z) * r;
            let [a, b] = [-1.0, 1.0];
            [
                corner(a, a, a),
                corner(a, a, b),
                corner(a, b, a),
                corner(a, b, b),
                corner(b, a, a),
                corner(b, a, b),
                corner(b, b, a),
                corner(b, b, b),
            ]
        })
    }
}

/// Uniform on the unit sphere.
fn unit_vector(rng: &mut impl Rng) -> Vector3<f64> {
    let z = 2.0 * rng.random::<f64>() - 1.0;
    let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vector3::new(r * cos, r * sin, z)
}

/// A coordinate axis that is not along `axis`.
fn perpendicular_seed(axis: &Vector3<f64>) -> Vector3<f64> {
    if axis.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand::rngs::ChaCha8Rng;

    use super::*;

    #[test]
    fn points_lie_on_the_skin() {
        let tube = Tube::new(&[[0.0; 3], [2.0, 0.0, 0.0], [2.0, 3.0, 0.5]], &[0.25, 0.25, 0.1]);
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        for _ in 0..2000 {
            let p = tube.sample(&mut rng);
            assert!(!tube.within(&p, 0.97) && tube.within(&p, 1.03), "{p:?}");
        }
        assert!(tube.contains(&Vector3::new(1.0, 0.1, 0.1)));
        assert!(!tube.contains(&Vector3::new(1.0, 1.0, 0.0)));
    }

    #[test]
    fn area_of_a_straight_tube() {
        let tube = Tube::new(&[[0.0; 3], [0.0, 0.0, 5.0]], &[0.5, 0.5]);
        assert!((tube.area() - (5.0 * PI + PI)).abs() < 1e-12);
    }
}
