//! Blocks and panes along the axes, and where rays meet them.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use srrf_cloud::{CloudError, PointCloud};

/// A scanner sees so far, metres.
const FARTHEST: f64 = 30.0;
/// Its rays, degrees above the horizon.
const RAYS_UP: [f64; 2] = [-60.0, 80.0];

/// A rectangle across one of the axes.
#[derive(Debug, Clone, Copy)]
struct Pane {
    axis: usize,
    at: f64,
    low: [f64; 3],
    high: [f64; 3],
}

/// All that a scanner may see.
#[derive(Debug, Clone, Default)]
pub struct Solids(Vec<Pane>);

/// A point by its place across an axis (0 or 1), along the other, and its height.
pub fn along(axis: usize, across: f64, along: f64, z: f64) -> [f64; 3] {
    if axis == 0 { [across, along, z] } else { [along, across, z] }
}

impl Solids {
    /// A pane across `axis`, by its extent along the two others.
    pub fn pane(&mut self, axis: usize, at: f64, low: [f64; 2], high: [f64; 2]) {
        let corner = |c: [f64; 2]| match axis {
            0 => [at, c[0], c[1]],
            1 => [c[0], at, c[1]],
            _ => [c[0], c[1], at],
        };
        self.0.push(Pane { axis, at, low: corner(low), high: corner(high) });
    }

    /// A block between two opposite corners, in any order.
    pub fn block(&mut self, one: [f64; 3], other: [f64; 3]) {
        let low: [f64; 3] = std::array::from_fn(|c| one[c].min(other[c]));
        let high: [f64; 3] = std::array::from_fn(|c| one[c].max(other[c]));
        for axis in 0..3 {
            for at in [low[axis], high[axis]] {
                let (mut l, mut h) = (low, high);
                (l[axis], h[axis]) = (at, at);
                self.0.push(Pane { axis, at, low: l, high: h });
            }
        }
    }

    /// What a scanner at `eye` sees with `columns` by `rows` rays and this noise in range (standard deviation, metres); points in the
    /// frame of the solids.
    ///
    /// # Errors
    /// [`CloudError::Empty`] where no ray meets anything.
    pub fn scan(
        &self,
        eye: [f64; 3],
        rays: [usize; 2],
        noise: f64,
        seed: u64,
    ) -> Result<PointCloud, CloudError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let [columns, rows] = rays;
        let first: f64 = rng.random_range(0.0..1.0);
        let mut points = Vec::with_capacity(columns * rows);
        for column in 0..columns {
            let turn = std::f64::consts::TAU * (column as f64 + first) / columns as f64;
            for row in 0..rows {
                let [low, high] = RAYS_UP;
                let up = (low + (high - low) * (row as f64 + first) / rows as f64).to_radians();
                let ray = [up.cos() * turn.cos(), up.cos() * turn.sin(), up.sin()];
                if let Some(range) = self.first_hit(&eye, &ray) {
                    let off: f64 =
                        (0..4).map(|_| rng.random_range(-1.0..1.0f64)).sum::<f64>() * noise * 0.866;
                    points.push(std::array::from_fn(|c| eye[c] + (range + off) * ray[c]));
                }
            }
        }
        PointCloud::new(points)
    }

    fn first_hit(&self, eye: &[f64; 3], ray: &[f64; 3]) -> Option<f64> {
        let mut nearest = FARTHEST;
        for pane in &self.0 {
            let range = (pane.at - eye[pane.axis]) / ray[pane.axis];
            if range > 1e-3 && range < nearest {
                let inside = (0..3).filter(|c| *c != pane.axis).all(|c| {
                    let at = eye[c] + range * ray[c];
                    at >= pane.low[c] && at <= pane.high[c]
                });
                if inside {
                    nearest = range;
                }
            }
        }
        (nearest < FARTHEST).then_some(nearest)
    }
}
