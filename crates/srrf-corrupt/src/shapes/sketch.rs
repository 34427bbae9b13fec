//! [`Sketch`]: the vocabulary in which the families of shapes are written.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use super::lathe::Lathe;
use super::loft::{Loft, Station};
use super::prism::Prism;
use super::surface::{Form, Surface};
use super::tube::Tube;
use srrf_cloud::{EulerXyz, Rigid};

/// Steps of a half circle in the profile of a ball.
const HALF_CIRCLE: usize = 14;

/// A shape in the making: random numbers for its proportions, and parts in the current frame.
///
/// z is up. Lengths are in any unit: the finished shape is scaled to radius 1. Let parts that touch
/// run a little into each other, so that no inner faces remain.
pub(crate) struct Sketch {
    rng: ChaCha8Rng,
    frame: Rigid,
    surface: Surface,
}

impl Sketch {
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Self { rng, frame: Rigid::identity(), surface: Surface::default() }
    }

    pub fn finish(self) -> Surface {
        self.surface
    }

    // ---- random proportions

    /// Uniform in `[low, high)`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.rng.random::<f64>()
    }

    /// One of `low..=high`.
    pub fn count(&mut self, low: usize, high: usize) -> usize {
        self.rng.random_range(low..=high.max(low))
    }

    /// True with probability `p`.
    pub fn chance(&mut self, p: f64) -> bool {
        self.rng.random::<f64>() < p
    }

    /// -1 or 1.
    pub fn side(&mut self) -> f64 {
        if self.chance(0.5) { -1.0 } else { 1.0 }
    }

    // ---- frames

    /// Draws with `draw` in a frame at `origin`, turned by Euler angles `R = Rx Ry Rz` in degrees.
    pub fn at(&mut self, origin: [f64; 3], euler_deg: [f64; 3], draw: impl FnOnce(&mut Self)) {
        let local =
            Rigid { rotation: EulerXyz::from_deg(euler_deg).to_matrix(), translation: Vector3::from(origin) };
        let outer = self.frame;
        self.frame = outer.compose(&local);
        draw(self);
        self.frame = outer;
    }

    fn push(&mut self, form: Form, local: Rigid) {
        self.surface.push(form, self.frame.compose(&local));
    }

    fn push_at(&mut self, form: Form, origin: [f64; 3]) {
        self.push(form, Rigid { translation: Vector3::from(origin), ..Rigid::identity() });
    }

    // ---- flat-faced parts

    /// A box by its centre and full size.
    pub fn cuboid(&mut self, [x, y, z]: [f64; 3], size: [f64; 3]) {
        self.wedge([x, y, z - size[2] / 2.0], size, [1.0, 1.0], [0.0, 0.0]);
    }

    /// A box by the centre of its base and its full size; its top is scaled and shifted.
    pub fn wedge(&mut self, base: [f64; 3], size: [f64; 3], top_scale: [f64; 2], top_shift: [f64; 2]) {
        let [x, y] = [size[0] / 2.0, size[1] / 2.0];
        let rectangle = [[-x, -y], [x, -y], [x, y], [-x, y]];
        self.push_at(Form::Prism(Prism::new(&rectangle, size[2], top_scale, top_shift)), base);
    }

    /// A polygon in the xy plane, extruded upwards from `z` by `height`.
    pub fn slab(&mut self, polygon: &[[f64; 2]], z: f64, height: f64) {
        let prism = Prism::new(polygon, height, [1.0, 1.0], [0.0, 0.0]);
        self.push_at(Form::Prism(prism), [0.0, 0.0, z]);
    }

    /// A polygon in the xz plane, extruded along y by `depth`, half of it to each side of `y`.
    pub fn panel(&mut self, polygon: &[[f64; 2]], y: f64, depth: f64) {
        let prism = Prism::new(polygon, depth, [1.0, 1.0], [0.0, 0.0]);
        // Columns: where local x, y, z point. Local y is up (z), local z is -y.
        let rotation = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0);
        self.push(
            Form::Prism(prism),
            Rigid { rotation, translation: Vector3::new(0.0, y + depth / 2.0, 0.0) },
        );
    }

    /// A bar of rectangular section from `a` to `b`; `section` is its width (level) and height.
    pub fn beam(&mut self, a: [f64; 3], b: [f64; 3], section: [f64; 2]) {
        let Some((pose, length)) = along(a, b) else { return };
        let [x, y] = [section[0] / 2.0, section[1] / 2.0];
        let rectangle = [[-x, -y], [x, -y], [x, y], [-x, y]];
        self.push(Form::Prism(Prism::new(&rectangle, length, [1.0, 1.0], [0.0, 0.0])), pose);
    }

    // ---- round parts

    /// A round bar with flat ends from `a` to `b`.
    pub fn rod(&mut self, a: [f64; 3], b: [f64; 3], radius: f64) {
        self.cone(a, b, radius, radius);
    }

    /// A truncated cone with flat ends from `a` to `b`.
    pub fn cone(&mut self, a: [f64; 3], b: [f64; 3], radius_a: f64, radius_b: f64) {
        let Some((pose, length)) = along(a, b) else { return };
        let profile = [[0.0, 0.0], [radius_a, 0.0], [radius_b, length], [0.0, length]];
        self.push(Form::Lathe(Lathe::new(&profile, [1.0, 1.0])), pose);
    }

    /// An ellipsoid by its centre and half axes.
    pub fn ball(&mut self, centre: [f64; 3], half: [f64; 3]) {
        let profile: Vec<[f64; 2]> = (0..=HALF_CIRCLE)
            .map(|i| {
                let angle = PI * i as f64 / HALF_CIRCLE as f64;
                let radius = if i == 0 || i == HALF_CIRCLE { 0.0 } else { angle.sin() };
                [radius, -half[2] * angle.cos()]
            })
            .collect();
        self.push_at(Form::Lathe(Lathe::new(&profile, [half[0], half[1]])), centre);
    }

    /// A profile of `[radius, z]` turned about a vertical axis through `base`, x and y scaled by `squash`.
    pub fn lathe(&mut self, base: [f64; 3], profile: &[[f64; 2]], squash: [f64; 2]) {
        self.push_at(Form::Lathe(Lathe::new(profile, squash)), base);
    }

    /// A ring about `axis` through `centre`; `radius` to the middle of its round section.
    pub fn ring(&mut self, centre: [f64; 3], axis: [f64; 3], radius: f64, thickness: f64) {
        const STEPS: usize = 12;
        let tip = std::array::from_fn(|c| centre[c] + axis[c]);
        let Some((pose, _)) = along(centre, tip) else { return };
        let profile: Vec<[f64; 2]> = (0..=STEPS)
            .map(|i| {
                // The first and last point are to be equal, so that the profile is a loop.
                let (sin, cos) = (2.0 * PI * (i % STEPS) as f64 / STEPS as f64).sin_cos();
                [radius + thickness * cos, thickness * sin]
            })
            .collect();
        self.push(Form::Lathe(Lathe::new(&profile, [1.0, 1.0])), pose);
    }

    /// A round tube of one thickness along a polyline.
    pub fn tube(&mut self, path: &[[f64; 3]], radius: f64) {
        self.tapered_tube(path, &vec![radius; path.len()]);
    }

    /// A round tube along a polyline, with a radius for each of its points.
    pub fn tapered_tube(&mut self, path: &[[f64; 3]], radii: &[f64]) {
        let distinct = path.windows(2).all(|ends| ends[0] != ends[1]);
        if path.len() >= 2 && distinct {
            self.push(Form::Tube(Tube::new(path, radii)), Rigid::identity());
        }
    }

    /// A body along x through cross-sections; see [`Station`].
    pub fn loft(&mut self, stations: &[Station]) {
        if stations.len() >= 2 {
            self.push(Form::Loft(Loft::new(stations)), Rigid::identity());
        }
    }
}

/// The frame at `a` whose z axis leads to `b`, its x axis level, and their distance.
fn along(a: [f64; 3], b: [f64; 3]) -> Option<(Rigid, f64)> {
    let (a, b) = (Vector3::from(a), Vector3::from(b));
    let length = (b - a).norm();
    if length.is_nan() || length <= 0.0 {
        return None;
    }
    let z = (b - a) / length;
    let level = Vector3::z().cross(&z);
    let x = if level.norm() > 1e-6 { level.normalize() } else { Vector3::x() };
    let rotation = Matrix3::from_columns(&[x, z.cross(&x), z]);
    Some((Rigid { rotation, translation: a }, length))
}

/// Points of an arc about `centre` in the plane of `u` and `v` (which carry the radii), from one
/// angle to another in degrees.
pub(crate) fn arc(
    centre: [f64; 3],
    u: [f64; 3],
    v: [f64; 3],
    from_deg: f64,
    to_deg: f64,
    steps: usize,
) -> Vec<[f64; 3]> {
    (0..=steps)
        .map(|i| {
            let angle = from_deg + (to_deg - from_deg) * i as f64 / steps as f64;
            let (sin, cos) = angle.to_radians().sin_cos();
            std::array::from_fn(|c| centre[c] + u[c] * cos + v[c] * sin)
        })
        .collect()
}

/// A cross-section for [`Sketch::loft`] whose centre is at `[y, z]`.
pub(crate) fn station(x: f64, centre: [f64; 2], half: [f64; 2], power: f64) -> Station {
    Station { x, centre, half, power }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn extent(draw: impl FnOnce(&mut Sketch)) -> [[f64; 2]; 3] {
        let mut sketch = Sketch::new(1, 2);
        draw(&mut sketch);
        let surface = sketch.finish();
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let points: Vec<_> = (0..4000).map(|_| surface.sample(&mut rng).unwrap()).collect();
        std::array::from_fn(|c| {
            let of = |start: f64, pick: fn(f64, f64) -> f64| points.iter().map(|p| p[c]).fold(start, pick);
            [of(f64::INFINITY, f64::min), of(f64::NEG_INFINITY, f64::max)]
        })
    }

    fn assert_extent(found: [[f64; 2]; 3], expected: [[f64; 2]; 3]) {
        for (f, e) in found.iter().flatten().zip(expected.iter().flatten()) {
            assert!((f - e).abs() < 0.06, "{found:?} {expected:?}");
        }
    }

    #[test]
    fn parts_are_where_they_should_be() {
        assert_extent(
            extent(|s| s.cuboid([1.0, 2.0, 3.0], [0.5, 1.0, 1.5])),
            [[0.75, 1.25], [1.5, 2.5], [2.25, 3.75]],
        );
        assert_extent(
            extent(|s| s.beam([0.0; 3], [0.0, 3.0, 0.0], [1.0, 0.2])),
            [[-0.5, 0.5], [0.0, 3.0], [-0.1, 0.1]],
        );
        assert_extent(
            extent(|s| s.panel(&[[0.0, 0.0], [1.0, 0.0], [0.0, 2.0]], 3.0, 0.4)),
            [[0.0, 1.0], [2.8, 3.2], [0.0, 2.0]],
        );
        assert_extent(
            extent(|s| s.rod([1.0, 0.0, 0.0], [3.0, 0.0, 0.0], 0.5)),
            [[1.0, 3.0], [-0.5, 0.5], [-0.5, 0.5]],
        );
        assert_extent(extent(|s| s.ball([0.0; 3], [1.0, 2.0, 0.5])), [[-1.0, 1.0], [-2.0, 2.0], [-0.5, 0.5]]);
        assert_extent(
            extent(|s| s.ring([0.0; 3], [0.0, 1.0, 0.0], 1.0, 0.1)),
            [[-1.1, 1.1], [-0.1, 0.1], [-1.1, 1.1]],
        );
        assert_extent(
            extent(|s| {
                s.at([1.0, 0.0, 0.0], [0.0, 0.0, 90.0], |s| s.cuboid([1.0, 0.0, 0.0], [2.0, 0.2, 0.4]))
            }),
            [[0.9, 1.1], [0.0, 2.0], [-0.2, 0.2]],
        );
        assert_extent(
            extent(|s| {
                s.loft(&[
                    station(0.0, [0.0, 1.0], [0.5, 0.25], 2.0),
                    station(2.0, [0.0, 1.0], [0.5, 0.25], 2.0),
                ])
            }),
            [[0.0, 2.0], [-0.5, 0.5], [0.75, 1.25]],
        );
    }

    #[test]
    fn parts_without_extent_are_left_out() {
        let mut sketch = Sketch::new(1, 2);
        sketch.rod([1.0; 3], [1.0; 3], 0.5);
        sketch.tube(&[[1.0; 3], [1.0; 3]], 0.5);
        sketch.loft(&[]);
        sketch.slab(&[], 0.0, 1.0);
        assert!(sketch.finish().sample(&mut ChaCha8Rng::seed_from_u64(3)).is_none());
    }
}
