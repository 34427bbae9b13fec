//! A triangle list from which points are drawn area-weighted.

use nalgebra::Vector3;
use rand::{Rng, RngExt};

/// Triangles with their running area.
#[derive(Debug, Clone, Default)]
pub struct Triangles {
    corners: Vec<[Vector3<f64>; 3]>,
    running_area: Vec<f64>,
}

impl Triangles {
    /// Adds a triangle; one without a positive finite area is left out.
    pub fn push(&mut self, a: Vector3<f64>, b: Vector3<f64>, c: Vector3<f64>) {
        let area = 0.5 * (b - a).cross(&(c - a)).norm();
        if area > 0.0 && area.is_finite() {
            self.running_area.push(self.area() + area);
            self.corners.push([a, b, c]);
        }
    }

    /// Adds a quadrilateral, corners in order around it.
    pub fn push_quad(&mut self, [a, b, c, d]: [Vector3<f64>; 4]) {
        self.push(a, b, c);
        self.push(a, c, d);
    }

    /// Total area.
    pub fn area(&self) -> f64 {
        self.running_area.last().copied().unwrap_or(0.0)
    }

    /// The corners of each triangle.
    pub fn corners(&self) -> &[[Vector3<f64>; 3]] {
        &self.corners
    }

    /// A point drawn uniformly by area; the origin if there is no triangle.
    pub fn sample(&self, rng: &mut impl Rng) -> Vector3<f64> {
        let at = rng.random();
        self.sample_at(at, rng)
    }

    /// A point drawn from the triangle at the share `at` (from 0 to 1) of the running area; the origin if there is no triangle.
    pub(crate) fn sample_at(&self, at: f64, rng: &mut impl Rng) -> Vector3<f64> {
        let at = at * self.area();
        let index = self.running_area.partition_point(|&area| area <= at).min(self.corners.len().max(1) - 1);
        let Some([a, b, c]) = self.corners.get(index) else { return Vector3::zeros() };
        let (mut u, mut v): (f64, f64) = (rng.random(), rng.random());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        a + (b - a) * u + (c - a) * v
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand::rngs::ChaCha8Rng;

    use super::*;

    #[test]
    fn draws_are_uniform_by_area() {
        let v = |x: f64, y: f64| Vector3::new(x, y, 0.5);
        let mut triangles = Triangles::default();
        triangles.push(v(0.0, 0.0), v(0.0, 0.0), v(1.0, 0.0)); // no area
        triangles.push_quad([v(0.0, 0.0), v(4.0, 0.0), v(4.0, 1.0), v(0.0, 1.0)]);
        triangles.push(v(4.0, 0.0), v(6.0, 0.0), v(4.0, 1.0));
        assert_eq!(triangles.corners().len(), 3);
        assert!((triangles.area() - 5.0).abs() < 1e-12);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let points: Vec<_> = (0..20_000).map(|_| triangles.sample(&mut rng)).collect();
        let share = |test: &dyn Fn(&Vector3<f64>) -> bool| {
            points.iter().filter(|p| test(p)).count() as f64 / points.len() as f64
        };
        assert!((share(&|p| p.x < 1.0) - 0.2).abs() < 0.015);
        assert!((share(&|p| p.x > 4.0) - 0.2).abs() < 0.015);
        assert!((share(&|p| p.x < 4.0 && p.y < 0.25) - 0.2).abs() < 0.015);
        assert_eq!(Triangles::default().sample(&mut rng), Vector3::zeros());
    }
}
