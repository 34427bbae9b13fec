//! [`Surface`]: the outer skin of a union of parts, from which points are drawn by area.

use nalgebra::Vector3;
use rand::{Rng, RngExt};

use super::lathe::Lathe;
use super::loft::Loft;
use super::prism::Prism;
use super::tube::Tube;
use srrf_cloud::Rigid;

/// Draws of one point before a point inside another part is accepted.
const MAX_DRAWS: usize = 64;

/// The form of a part, in the part's own frame.
#[derive(Debug, Clone)]
pub(crate) enum Form {
    Prism(Prism),
    Lathe(Lathe),
    Tube(Tube),
    Loft(Loft),
}

impl Form {
    fn area(&self) -> f64 {
        match self {
            Self::Prism(prism) => prism.surface.area(),
            Self::Lathe(lathe) => lathe.area(),
            Self::Tube(tube) => tube.area(),
            Self::Loft(loft) => loft.surface.area(),
        }
    }

    fn sample(&self, rng: &mut impl Rng) -> Vector3<f64> {
        match self {
            Self::Prism(prism) => prism.surface.sample(rng),
            Self::Lathe(lathe) => lathe.sample(rng),
            Self::Tube(tube) => tube.sample(rng),
            Self::Loft(loft) => loft.surface.sample(rng),
        }
    }

    fn contains(&self, p: &Vector3<f64>) -> bool {
        match self {
            Self::Prism(prism) => prism.contains(p),
            Self::Lathe(lathe) => lathe.contains(p),
            Self::Tube(tube) => tube.contains(p),
            Self::Loft(loft) => loft.contains(p),
        }
    }

    /// A ball that holds the surface.
    fn bounds(&self) -> (Vector3<f64>, f64) {
        let hull: Vec<Vector3<f64>> = match self {
            Self::Prism(prism) => prism.surface.corners().iter().flatten().copied().collect(),
            Self::Lathe(lathe) => lathe.hull().collect(),
            Self::Tube(tube) => tube.hull().collect(),
            Self::Loft(loft) => loft.surface.corners().iter().flatten().copied().collect(),
        };
        let low = hull.iter().fold(Vector3::repeat(f64::INFINITY), |a, p| a.inf(p));
        let high = hull.iter().fold(Vector3::repeat(f64::NEG_INFINITY), |a, p| a.sup(p));
        let centre = (low + high) / 2.0;
        // The four corners of a lathe's rings are sqrt(2) too far out, never too near.
        (centre, hull.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max))
    }
}

#[derive(Debug, Clone)]
struct SurfacePart {
    form: Form,
    shape_from_part: Rigid,
    part_from_shape: Rigid,
    centre: Vector3<f64>,
    squared_radius: f64,
}

impl SurfacePart {
    fn contains(&self, p: &Vector3<f64>) -> bool {
        (p - self.centre).norm_squared() < self.squared_radius && {
            let local = self.part_from_shape.rotation * p + self.part_from_shape.translation;
            self.form.contains(&local)
        }
    }
}

/// A union of parts.
#[derive(Debug, Clone, Default)]
pub(crate) struct Surface {
    parts: Vec<SurfacePart>,
    running_area: Vec<f64>,
}

impl Surface {
    /// Adds a part; one without a positive finite area is left out.
    pub fn push(&mut self, form: Form, shape_from_part: Rigid) {
        let area = form.area();
        if !(area > 0.0 && area.is_finite()) {
            return;
        }
        let (centre, radius) = form.bounds();
        let centre = shape_from_part.rotation * centre + shape_from_part.translation;
        let part_from_shape = shape_from_part.inverse();
        self.running_area.push(self.running_area.last().copied().unwrap_or(0.0) + area);
        self.parts.push(SurfacePart {
            form,
            shape_from_part,
            part_from_shape,
            centre,
            squared_radius: radius * radius,
        });
    }

    /// A point of the skin, drawn by area; `None` without parts. Points strictly inside another
    /// part are drawn again, at most [`MAX_DRAWS`] times.
    pub fn sample(&self, rng: &mut impl Rng) -> Option<Vector3<f64>> {
        let total = *self.running_area.last()?;
        let mut point = None;
        for _ in 0..MAX_DRAWS {
            let at = rng.random::<f64>() * total;
            let index = self.running_area.partition_point(|&area| area <= at).min(self.parts.len() - 1);
            let pose = &self.parts[index].shape_from_part;
            let p = pose.rotation * self.parts[index].form.sample(rng) + pose.translation;
            point = Some(p);
            if !self.parts.iter().enumerate().any(|(i, part)| i != index && part.contains(&p)) {
                break;
            }
        }
        point
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand::rngs::ChaCha8Rng;

    use super::*;

    fn cube(half: f64) -> Form {
        let square = [[-half, -half], [half, -half], [half, half], [-half, half]];
        Form::Prism(Prism::new(&square, 2.0 * half, [1.0, 1.0], [0.0, 0.0]))
    }

    #[test]
    fn the_inside_stays_empty() {
        let mut surface = Surface::default();
        surface.push(cube(1.0), Rigid::identity());
        let mut shifted = Rigid::identity();
        shifted.translation = Vector3::new(1.0, 0.0, 0.5);
        surface.push(cube(0.5), shifted);
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let points: Vec<_> = (0..5000).map(|_| surface.sample(&mut rng).unwrap()).collect();
        let strictly_in =
            |p: &Vector3<f64>, c: Vector3<f64>, h: f64| (p - c).iter().all(|v| v.abs() < h - 1e-9);
        assert!(points.iter().all(|p| !strictly_in(p, Vector3::new(0.0, 0.0, 1.0), 1.0)));
        assert!(points.iter().all(|p| !strictly_in(p, Vector3::new(1.0, 0.0, 1.0), 0.5)));
        // Outside: 24 - 1 of the large cube and 6 - 3 of the small one.
        let small = points.iter().filter(|p| p.x > 1.0 + 1e-9).count() as f64 / 5000.0;
        assert!((small - 3.0 / 26.0).abs() < 0.02, "{small}");
    }

    #[test]
    fn a_part_within_another_of_the_same_size_still_ends() {
        let mut surface = Surface::default();
        assert!(surface.sample(&mut ChaCha8Rng::seed_from_u64(1)).is_none());
        surface.push(cube(0.5), Rigid { translation: Vector3::new(0.0, 0.0, 0.25), ..Rigid::identity() });
        surface.push(cube(0.0), Rigid::identity());
        assert!(surface.sample(&mut ChaCha8Rng::seed_from_u64(1)).is_some());
    }
}
