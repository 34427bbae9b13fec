//! [`Up`]: which axis points up on the screen, given or guessed.

use srrf_cloud::PointCloud;

/// Which axis points up on the screen at first. The reader can change it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Up {
    /// x.
    X,
    /// y, as most meshes have it.
    Y,
    /// z, as scanners and surveys have it.
    #[default]
    Z,
    /// Against x.
    MinusX,
    /// Against y, as cameras have it.
    MinusY,
    /// Against z.
    MinusZ,
}

/// Cells of the grid in which a cloud is compared with its mirror image, along each axis.
const CELLS: usize = 12;
/// A cloud is a ground or a floor plan where it is so much thinner along one axis than along the others.
const THIN: f64 = 1.0 / 3.0;
/// How much less like its mirror image a cloud must be along y than along z for y to be up. What stands is alike from left to right,
/// and often from front to back, but not from head to foot.
const MIRROR: f64 = 0.3;

impl Up {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Z, Self::Y, Self::X, Self::MinusZ, Self::MinusY, Self::MinusX];

    /// Its name: `z`, or `-z` for against it.
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::MinusX => "-x",
            Self::MinusY => "-y",
            Self::MinusZ => "-z",
        }
    }

    /// The axis that seems to point up in a cloud: z, unless y is far more likely. A guess is for the first look only.
    pub fn guess(cloud: &PointCloud) -> Self {
        let [(x, _), (y, y_mirror), (z, z_mirror)] = shape(cloud.points());
        let thin = |one: f64, others: [f64; 2]| others.iter().all(|other| one < THIN * other);
        if thin(z, [x, y]) {
            Self::Z
        } else if thin(y, [x, z]) || y_mirror > z_mirror + MIRROR {
            Self::Y
        } else {
            Self::Z
        }
    }
}

/// For each axis the extent of nearly all points, and how much the cloud differs from its mirror image along the axis: the share of
/// the filled cells of a grid that are not filled in the mirror image.
fn shape(points: &[[f64; 3]]) -> [(f64, f64); 3] {
    let step = points.len().div_ceil(50_000);
    let some: Vec<[f64; 3]> = points.iter().step_by(step).copied().collect();
    let bounds: [(f64, f64); 3] = std::array::from_fn(|axis| {
        let mut values: Vec<f64> = some.iter().map(|p| p[axis]).collect();
        values.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
        (at(0.01), at(0.99))
    });
    let cell = |p: &[f64; 3], axis: usize| {
        let (low, high) = bounds[axis];
        let share = if high > low { (p[axis] - low) / (high - low) } else { 0.5 };
        ((share * CELLS as f64) as usize).min(CELLS - 1)
    };
    let index = |at: [usize; 3]| (at[0] * CELLS + at[1]) * CELLS + at[2];
    let mut filled = vec![false; CELLS.pow(3)];
    for p in &some {
        filled[index(std::array::from_fn(|axis| cell(p, axis)))] = true;
    }
    let all = filled.iter().filter(|full| **full).count().max(1);
    std::array::from_fn(|axis| {
        let differs = (0..CELLS.pow(3)).filter(|&i| {
            let mut at = [i / (CELLS * CELLS), i / CELLS % CELLS, i % CELLS];
            at[axis] = CELLS - 1 - at[axis];
            filled[i] != filled[index(at)]
        });
        (bounds[axis].1 - bounds[axis].0, differs.count() as f64 / all as f64)
    })
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};
    use srrf_corrupt::datasets::ShapeSource;
    use srrf_corrupt::shapes::ProceduralShapes;

    use super::*;

    /// What has z up, with y up.
    fn y_up(points: &[[f64; 3]]) -> PointCloud {
        PointCloud::new(points.iter().map(|p| [p[0], p[2], -p[1]]).collect()).unwrap()
    }

    #[test]
    fn a_ground_tells_its_axis() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let points: Vec<[f64; 3]> = (0..3000)
            .map(|_| [rng.random_range(0.0..40.0), rng.random_range(0.0..30.0), rng.random_range(0.0..3.0)])
            .collect();
        assert_eq!(Up::guess(&PointCloud::new(points.clone()).unwrap()), Up::Z);
        assert_eq!(Up::guess(&y_up(&points)), Up::Y);
        for few in [vec![[1.0; 3]], vec![[0.0; 3], [1e300; 3]]] {
            assert_eq!(Up::guess(&PointCloud::new(few).unwrap()), Up::Z, "no points, no guess");
        }
    }

    #[test]
    fn most_shapes_stand_upright() {
        let shapes = ProceduralShapes::new(5, 60, None).unwrap();
        let (mut z, mut y) = (0, 0);
        for i in 0..60 {
            let cloud = shapes.sample(i, 2000, &mut ChaCha8Rng::seed_from_u64(i as u64)).unwrap();
            z += usize::from(Up::guess(&cloud) == Up::Z);
            y += usize::from(Up::guess(&y_up(cloud.points())) == Up::Y);
        }
        assert!(z >= 50, "{z} of 60 that have z up");
        assert!(y >= 25, "{y} of 60 that have y up");
    }
}
