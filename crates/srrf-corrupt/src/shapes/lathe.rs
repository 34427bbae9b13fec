//! [`Lathe`]: a profile turned about an axis. Cylinders, cones, balls, rings and vessels are lathes.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand::{Rng, RngExt};

use super::polygon;

/// Angles at which the area of an oval lathe is averaged.
const AREA_ANGLES: usize = 32;

/// A polyline of `[radius, z]` turned about the z axis, with x and y scaled by `squash`.
///
/// It is solid where the profile begins and ends on the axis or is a loop, and a thin shell
/// otherwise.
#[derive(Debug, Clone)]
pub(crate) struct Lathe {
    profile: Vec<[f64; 2]>,
    squash: [f64; 2],
    solid: bool,
    running_area: Vec<f64>,
}

impl Lathe {
    pub fn new(profile: &[[f64; 2]], squash: [f64; 2]) -> Self {
        let (first, last) = (profile.first().copied(), profile.last().copied());
        let on_axis = |end: Option<[f64; 2]>| end.is_some_and(|p| p[0] == 0.0);
        let solid = (on_axis(first) && on_axis(last)) || (profile.len() > 3 && first == last);
        let mut lathe = Self { profile: profile.to_vec(), squash, solid, running_area: Vec::new() };
        let mut total = 0.0;
        for k in 1..profile.len() {
            let ([r0, z0], [r1, z1]) = (profile[k - 1], profile[k]);
            let stretch: f64 = (0..AREA_ANGLES)
                .map(|i| lathe.stretch(k, TAU * (i as f64 + 0.5) / AREA_ANGLES as f64))
                .sum::<f64>()
                / AREA_ANGLES as f64;
            total += TAU * 0.5 * (r0 + r1) * (r1 - r0).hypot(z1 - z0) * stretch;
            lathe.running_area.push(total);
        }
        lathe
    }

    /// By how much `squash` stretches the area of segment `k` at an angle.
    fn stretch(&self, k: usize, angle: f64) -> f64 {
        let [sx, sy] = self.squash;
        if sx == 1.0 && sy == 1.0 {
            return 1.0;
        }
        let ([r0, z0], [r1, z1]) = (self.profile[k - 1], self.profile[k]);
        let length = (r1 - r0).hypot(z1 - z0);
        if length == 0.0 {
            return 0.0;
        }
        // Unit normal of the profile, transformed as normals are.
        let (out, up) = ((z1 - z0) / length, (r0 - r1) / length);
        let (sin, cos) = angle.sin_cos();
        ((sy * cos * out).powi(2) + (sx * sin * out).powi(2) + (sx * sy * up).powi(2)).sqrt()
    }

    pub fn area(&self) -> f64 {
        self.running_area.last().copied().unwrap_or(0.0)
    }

    /// A point drawn uniformly by area.
    pub fn sample(&self, rng: &mut impl Rng) -> Vector3<f64> {
        let at = rng.random::<f64>() * self.area();
        let k = 1 + self.running_area.partition_point(|&area| area <= at).min(self.profile.len() - 2);
        let ([r0, z0], [r1, z1]) = (self.profile[k - 1], self.profile[k]);
        // The density along the segment grows with the radius.
        let u: f64 = rng.random();
        let along = if (r1 - r0).abs() > 1e-9 * (r0 + r1) {
            ((r0 * r0 + u * (r1 * r1 - r0 * r0)).sqrt() - r0) / (r1 - r0)
        } else {
            u
        };
        let [sx, sy] = self.squash;
        let bound = sx.max(sy).max(sx * sy);
        let round = sx == 1.0 && sy == 1.0;
        let mut angle = TAU * rng.random::<f64>();
        while !round && rng.random::<f64>() * bound > self.stretch(k, angle) {
            angle = TAU * rng.random::<f64>();
        }
        let (sin, cos) = angle.sin_cos();
        let radius = r0 + along * (r1 - r0);
        Vector3::new(sx * radius * cos, sy * radius * sin, z0 + along * (z1 - z0))
    }

    /// Whether `p` lies strictly inside; never for a shell.
    pub fn contains(&self, p: &Vector3<f64>) -> bool {
        let [sx, sy] = self.squash;
        self.solid && polygon::contains(&self.profile, [(p.x / sx).hypot(p.y / sy), p.z])
    }

    /// Points whose hull holds the surface.
    pub fn hull(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        let [sx, sy] = self.squash;
        self.profile.iter().flat_map(move |&[r, z]| {
            [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)]
                .map(|(x, y)| Vector3::new(sx * r * x, sy * r * y, z))
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use rand::SeedableRng;
    use rand::rngs::ChaCha8Rng;

    use super::*;

    fn half_circle(steps: usize, height: f64) -> Vec<[f64; 2]> {
        (0..=steps)
            .map(|i| {
                let angle = PI * i as f64 / steps as f64;
                let ends = i == 0 || i == steps;
                [if ends { 0.0 } else { angle.sin() }, -height * angle.cos()]
            })
            .collect()
    }

    #[test]
    fn ball_is_uniform() {
        let ball = Lathe::new(&half_circle(64, 1.0), [1.0, 1.0]);
        assert!((ball.area() - 4.0 * PI).abs() < 0.02);
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let points: Vec<_> = (0..20_000).map(|_| ball.sample(&mut rng)).collect();
        for axis in 0..3 {
            // Archimedes: every slab of equal thickness has the same area.
            let share = points.iter().filter(|p| p[axis] > 0.5).count() as f64 / 20_000.0;
            assert!((share - 0.25).abs() < 0.01, "{axis} {share}");
        }
        assert!(ball.contains(&Vector3::new(0.5, 0.5, 0.5)) && !ball.contains(&Vector3::new(0.7, 0.7, 0.7)));
    }

    /// Points of an oval tube: uniform along its outline.
    #[test]
    fn oval_is_uniform_by_area() {
        let wall = Lathe::new(&[[1.0, 0.0], [1.0, 2.0]], [3.0, 0.5]);
        let outline: Vec<f64> = (0..100_000)
            .map(|i| {
                let angle = TAU * i as f64 / 100_000.0;
                (3.0 * angle.sin()).hypot(0.5 * angle.cos()) * TAU / 100_000.0
            })
            .collect();
        let perimeter: f64 = outline.iter().sum();
        assert!((wall.area() / (2.0 * perimeter) - 1.0).abs() < 0.01);
        // The share of the outline beyond x = 1.5 on either side: angles within 60 degrees of 0 or 180.
        let beyond: f64 = (0..100_000)
            .filter(|i| (TAU * *i as f64 / 100_000.0).cos().abs() > 0.5)
            .map(|i| outline[i])
            .sum::<f64>()
            / perimeter;
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let hits = (0..20_000).filter(|_| wall.sample(&mut rng).x.abs() > 1.5).count() as f64 / 20_000.0;
        assert!((hits - beyond).abs() < 0.015, "{hits} {beyond}");
        assert!(!wall.contains(&Vector3::new(0.0, 0.0, 1.0)), "a shell has no inside");
    }

    #[test]
    fn cone_is_denser_by_area_where_it_is_wide() {
        let cone = Lathe::new(&[[2.0, 0.0], [0.0, 1.0]], [1.0, 1.0]);
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let low = (0..20_000).filter(|_| cone.sample(&mut rng).z < 0.5).count() as f64 / 20_000.0;
        assert!((low - 0.75).abs() < 0.01, "{low}");
    }
}
