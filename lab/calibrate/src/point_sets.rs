//! Small point sets of many kinds, for pairs that have nothing in common.

use std::fmt;

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use srrf_cloud::PointCloud;

/// How the points of a set are spread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PointSet {
    /// Normally about a point.
    Gaussian,
    /// Evenly in a ball.
    Ball,
    /// Evenly in a box of random sides.
    Box,
    /// On a sphere.
    Sphere,
    /// On a plane, with a little noise.
    Plane,
    /// Along a few lines.
    Lines,
    /// On a lattice of random sides and steps, some points missing.
    Lattice,
    /// In clusters.
    Clusters,
    /// Along a random walk.
    Walk,
    /// On several planes.
    Planes,
}

impl fmt::Display for PointSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&format!("{self:?}").to_lowercase())
    }
}

impl PointSet {
    /// All kinds.
    pub const ALL: [Self; 10] = [
        Self::Gaussian,
        Self::Ball,
        Self::Box,
        Self::Sphere,
        Self::Plane,
        Self::Lines,
        Self::Lattice,
        Self::Clusters,
        Self::Walk,
        Self::Planes,
    ];

    /// `n` points by a seed; none where they are all on one line.
    pub fn sample(self, n: usize, seed: u64) -> Option<PointCloud> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let rng = &mut rng;
        let points = match self {
            Self::Gaussian => (0..n).map(|_| normal(rng)).collect(),
            Self::Ball => (0..n).map(|_| in_ball(rng)).collect(),
            Self::Box => {
                let sides: [f64; 3] = std::array::from_fn(|_| rng.random_range(0.2..1.0));
                (0..n).map(|_| sides.map(|s| s * rng.random::<f64>())).collect()
            }
            Self::Sphere => (0..n).map(|_| unit(normal(rng))).collect(),
            Self::Plane => {
                let (wide, noise) = (rng.random_range(0.3..1.0), rng.random_range(0.0..0.02));
                (0..n).map(|_| [rng.random(), wide * rng.random::<f64>(), noise * normal(rng)[0]]).collect()
            }
            Self::Lines => {
                let lines: Vec<_> =
                    (0..rng.random_range(2..6)).map(|_| (in_ball(rng), unit(normal(rng)))).collect();
                let noise = rng.random_range(0.0..0.01);
                (0..n)
                    .map(|_| {
                        let (at, along) = lines[rng.random_range(0..lines.len())];
                        let (t, off) = (rng.random_range(-1.0..1.0), normal(rng));
                        std::array::from_fn(|c| at[c] + t * along[c] + noise * off[c])
                    })
                    .collect()
            }
            Self::Lattice => lattice(n, rng),
            Self::Clusters => {
                let centres: Vec<_> = (0..rng.random_range(2..9)).map(|_| in_ball(rng)).collect();
                let wide = rng.random_range(0.03..0.2);
                (0..n)
                    .map(|_| {
                        let (centre, off) = (centres[rng.random_range(0..centres.len())], normal(rng));
                        std::array::from_fn(|c| centre[c] + wide * off[c])
                    })
                    .collect()
            }
            Self::Walk => {
                let mut at = [0.0; 3];
                (0..n)
                    .map(|_| {
                        let step = normal(rng);
                        at = std::array::from_fn(|c| at[c] + 0.1 * step[c]);
                        at
                    })
                    .collect()
            }
            Self::Planes => {
                let planes: Vec<_> = (0..rng.random_range(2..5))
                    .map(|_| (in_ball(rng), unit(normal(rng)), unit(normal(rng))))
                    .collect();
                (0..n)
                    .map(|_| {
                        let (at, u, v) = planes[rng.random_range(0..planes.len())];
                        let (s, t) = (rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
                        std::array::from_fn(|c| at[c] + s * u[c] + t * v[c])
                    })
                    .collect()
            }
        };
        let cloud = PointCloud::new(points).ok()?;
        srrf_cloud::Solid::new(&cloud).is_ok().then_some(cloud)
    }
}

fn normal(rng: &mut ChaCha8Rng) -> [f64; 3] {
    std::array::from_fn(|_| rng.sample(StandardNormal))
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
    v.map(|c| c / length)
}

fn in_ball(rng: &mut ChaCha8Rng) -> [f64; 3] {
    let radius = rng.random::<f64>().cbrt();
    unit(normal(rng)).map(|c| radius * c)
}

/// Some of the points of the smallest lattice of random proportions that has `n`.
fn lattice(n: usize, rng: &mut ChaCha8Rng) -> Vec<[f64; 3]> {
    let flat = rng.random_bool(0.4);
    let [a, b]: [f64; 2] = std::array::from_fn(|_| rng.random_range(0.6..1.6));
    let steps: [f64; 3] = std::array::from_fn(|_| rng.random_range(0.7..1.3));
    let mut side = 1.0_f64;
    let sides = loop {
        let sides = [side * a, side * b, if flat { 1.0 } else { side }].map(|s| (s as usize).max(1));
        if sides.iter().product::<usize>() >= n {
            break sides;
        }
        side += 0.5;
    };
    let mut all: Vec<[f64; 3]> = (0..sides.iter().product())
        .map(|i| [i % sides[0], i / sides[0] % sides[1], i / sides[0] / sides[1]])
        .map(|i| std::array::from_fn(|c| i[c] as f64 * steps[c]))
        .collect();
    while all.len() > n {
        all.swap_remove(rng.random_range(0..all.len()));
    }
    all
}
