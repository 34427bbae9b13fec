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

/// Points that are looked at.
const LOOKED_AT: usize = 50_000;
/// Columns along z in which depths are compared, along x and along y.
const COLUMNS: usize = 24;
/// Bins of depths: a third of all points in one of them is a table, and no view.
const DEPTHS: usize = 16;
/// Shares of the extent along z: how much depths differ in most columns of a view, at most; the share of columns where they may differ
/// by more than the second.
const FLAT: f64 = 0.06;
const DEEP: f64 = 0.3;
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

    /// The axis that seems to point up in a cloud: z, unless y is far more likely, as where the cloud was seen along z by one scanner.
    /// A guess is for the first look only.
    pub fn guess(cloud: &PointCloud) -> Self {
        let step = cloud.len().div_ceil(LOOKED_AT);
        let some: Vec<[f64; 3]> = cloud.points().iter().step_by(step).copied().collect();
        let bounds = bounds(&some);
        let [(x, _), (y, y_mirror), (z, z_mirror)] = shape(&some, bounds);
        let thin = |one: f64, others: [f64; 2]| others.iter().all(|other| one < THIN * other);
        if thin(z, [x, y]) {
            Self::Z
        } else if thin(y, [x, z]) || y_mirror > z_mirror + MIRROR || is_seen_along_z(&some, bounds) {
            Self::Y
        } else {
            Self::Z
        }
    }
}

/// Where nearly all points lie along each axis.
fn bounds(points: &[[f64; 3]]) -> [(f64, f64); 3] {
    std::array::from_fn(|axis| {
        let mut values: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        values.sort_unstable_by(f64::total_cmp);
        (at(&values, 0.01), at(&values, 0.99))
    })
}

/// The value at a share of sorted ones, at least one.
fn at(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share) as usize]
}

/// Where a point lies between bounds, from 0 to 1.
fn share(value: f64, (low, high): (f64, f64)) -> f64 {
    if high > low { ((value - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 }
}

/// Whether the points are what one look along z shows: one depth in each column, and of all depths.
fn is_seen_along_z(points: &[[f64; 3]], bounds: [(f64, f64); 3]) -> bool {
    let cell =
        |value: f64, axis: usize| ((share(value, bounds[axis]) * COLUMNS as f64) as usize).min(COLUMNS - 1);
    let mut columns = vec![Vec::new(); COLUMNS * COLUMNS];
    let mut depths = [0usize; DEPTHS];
    for [x, y, z] in points {
        let depth = share(*z, bounds[2]);
        columns[cell(*x, 0) * COLUMNS + cell(*y, 1)].push(depth);
        depths[((depth * DEPTHS as f64) as usize).min(DEPTHS - 1)] += 1;
    }
    let spread = |column: Vec<f64>| {
        let mut sorted = column;
        sorted.sort_unstable_by(f64::total_cmp);
        (sorted.len() >= 3).then(|| at(&sorted, 0.9) - at(&sorted, 0.1))
    };
    let mut spreads: Vec<f64> = columns.into_iter().filter_map(spread).collect();
    spreads.sort_unstable_by(f64::total_cmp);
    let deep = spreads.iter().filter(|s| **s > DEEP).count();
    let one_depth = depths.iter().max().is_some_and(|most| 3 * most > points.len());
    spreads.len() > COLUMNS
        && at(&spreads, 0.5) < FLAT
        && (deep as f64) < FLAT * spreads.len() as f64
        && !one_depth
}

/// For each axis the extent of nearly all points, and how much the cloud differs from its mirror image along the axis: the share of
/// the filled cells of a grid that are not filled in the mirror image.
fn shape(points: &[[f64; 3]], bounds: [(f64, f64); 3]) -> [(f64, f64); 3] {
    let cell =
        |p: &[f64; 3], axis: usize| ((share(p[axis], bounds[axis]) * CELLS as f64) as usize).min(CELLS - 1);
    let index = |at: [usize; 3]| (at[0] * CELLS + at[1]) * CELLS + at[2];
    let mut filled = vec![false; CELLS.pow(3)];
    for p in points {
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
    fn what_one_scanner_saw_along_z_has_y_up() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        // The front half of a ball, as a scanner on the z axis sees it; and all of the ball.
        let ball: Vec<[f64; 3]> = (0..20_000)
            .map(|_| {
                let z: f64 = rng.random_range(-1.0..1.0);
                let a: f64 = rng.random_range(0.0..std::f64::consts::TAU);
                [(1.0 - z * z).sqrt() * a.cos(), (1.0 - z * z).sqrt() * a.sin(), z]
            })
            .collect();
        let front = ball.iter().copied().filter(|p| p[2] > 0.0).collect();
        assert_eq!(Up::guess(&PointCloud::new(front).unwrap()), Up::Y);
        assert_eq!(Up::guess(&PointCloud::new(ball).unwrap()), Up::Z);
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
