//! Smooth warps by radial basis functions, of which `distortion_rbf` and `distortion_rbf_inv` are two.

use std::f64::consts::PI;
use std::sync::OnceLock;

use nalgebra::{DMatrix, Dyn, LU, Vector3};
use rand::{Rng, RngExt};

use super::blocks::{BlockMotion, LANES, Lane, move_all};
use super::lattice::{CONTROL_POINTS, CONTROL_POINTS_PER_AXIS, Displacements};
use crate::corruption::CorruptError;
use crate::severity::Severity;

/// Length of each control point's displacement.
pub const SHIFT: [f64; 5] = [0.025, 0.05, 0.075, 0.1, 0.125];

/// Radius of the basis functions. The paper names it `r` without a number; this is the default of PyGeM, which
/// the code leaves as it is.
pub const RADIUS: f64 = 0.5;

/// The basis function of a warp: 125 control points on a regular grid over `[-1, 1]^3` move by the same distance
/// in random directions, and an interpolant of radial basis functions carries the cloud along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// `phi(x) = sqrt(x^2 + r^2)`.
    Multiquadric,
    /// `phi(x) = 1 / sqrt(x^2 + r^2)`.
    InverseMultiquadric,
}

/// Unknowns of the interpolation: one weight for each control point, and an affine map.
const UNKNOWNS: usize = CONTROL_POINTS + 4;

/// Directions `(cos a sin g, sin a sin g, cos g)` with `a` and `g` uniform in `(-pi, pi)`, which
/// is not uniform on the sphere, times the severity's length; in the order of [`control_points`].
pub fn draw_displacements<R: Rng>(severity: Severity, rng: &mut R) -> Displacements {
    let length = severity.of(&SHIFT);
    std::array::from_fn(|_| {
        let [a, g] = std::array::from_fn(|_| (2.0 * rng.random::<f64>() - 1.0) * PI);
        [length * a.cos() * g.sin(), length * a.sin() * g.sin(), length * g.cos()]
    })
}

/// The control points; the one at step `(i, j, k)` along x, y, z has index `(5 i + j) 5 + k`.
pub fn control_points() -> [[f64; 3]; CONTROL_POINTS] {
    const N: usize = CONTROL_POINTS_PER_AXIS;
    std::array::from_fn(|index| [index / (N * N), index / N % N, index % N].map(at_step))
}

/// Coordinate of the control points at a step along an axis.
#[inline(always)]
fn at_step(step: usize) -> f64 {
    2.0 * step as f64 / (CONTROL_POINTS_PER_AXIS - 1) as f64 - 1.0
}

impl Kernel {
    fn name(self) -> &'static str {
        match self {
            Self::Multiquadric => "multiquadric",
            Self::InverseMultiquadric => "inverse multiquadric",
        }
    }

    /// The warped `points` (shape `[n, 3]`), when each control point moves by its displacement:
    /// `p' = p + sum_i w_i phi(|p - c_i|) + q_0 + Q p`, with the weights from the 129 x 129 system
    /// `[[Phi, 1, C], [1^T, 0, 0], [C^T, 0, 0]] w = [displacements; 0; 0]`.
    ///
    /// The reference interpolates positions, here it is displacements: the same function, since
    /// the affine part reproduces the identity.
    ///
    /// # Errors
    /// [`CorruptError::Singular`] if the system cannot be factored (it can, for both kernels).
    pub fn deform(
        &self,
        points: &[[f64; 3]],
        displacements: &Displacements,
    ) -> Result<Vec<[f64; 3]>, CorruptError> {
        let rhs =
            DMatrix::from_fn(
                UNKNOWNS,
                3,
                |row, c| if row < CONTROL_POINTS { displacements[row][c] } else { 0.0 },
            );
        let solution = self.factored().solve(&rhs).ok_or(CorruptError::Singular(self.name()))?;
        let row = |i: usize| [solution[(i, 0)], solution[(i, 1)], solution[(i, 2)]];
        let warp = Warp {
            kernel: *self,
            weights: std::array::from_fn(row),
            affine: std::array::from_fn(|i| row(CONTROL_POINTS + i)),
        };
        Ok(move_all(points, &warp))
    }

    /// The basis function at a squared distance.
    #[inline(always)]
    fn phi(self, squared: f64) -> f64 {
        let root = (squared + RADIUS * RADIUS).sqrt();
        match self {
            Self::Multiquadric => root,
            Self::InverseMultiquadric => 1.0 / root,
        }
    }

    /// The factored system, computed once for each kernel: it depends on nothing else.
    fn factored(self) -> &'static LU<f64, Dyn, Dyn> {
        static MULTIQUADRIC: OnceLock<LU<f64, Dyn, Dyn>> = OnceLock::new();
        static INVERSE: OnceLock<LU<f64, Dyn, Dyn>> = OnceLock::new();
        let cell = match self {
            Self::Multiquadric => &MULTIQUADRIC,
            Self::InverseMultiquadric => &INVERSE,
        };
        cell.get_or_init(|| {
            let controls = control_points().map(Vector3::from);
            let affine = |i: usize, k: usize| if k == 0 { 1.0 } else { controls[i][k - 1] };
            DMatrix::from_fn(UNKNOWNS, UNKNOWNS, |i, j| match (i < CONTROL_POINTS, j < CONTROL_POINTS) {
                (true, true) => self.phi((controls[i] - controls[j]).norm_squared()),
                (true, false) => affine(i, j - CONTROL_POINTS),
                (false, true) => affine(j, i - CONTROL_POINTS),
                (false, false) => 0.0,
            })
            .lu()
        })
    }
}

/// The interpolant of one set of displacements.
struct Warp {
    kernel: Kernel,
    weights: [[f64; 3]; CONTROL_POINTS],
    affine: [[f64; 3]; 4],
}

impl BlockMotion for Warp {
    #[inline(always)]
    fn apply(&self, block: &[Lane; 3]) -> [Lane; 3] {
        match self.kernel {
            Kernel::Multiquadric => self.moved(block, |squared| Kernel::Multiquadric.phi(squared)),
            Kernel::InverseMultiquadric => {
                self.moved(block, |squared| Kernel::InverseMultiquadric.phi(squared))
            }
        }
    }
}

impl Warp {
    #[inline(always)]
    fn moved(&self, block: &[Lane; 3], phi: impl Fn(f64) -> f64) -> [Lane; 3] {
        const N: usize = CONTROL_POINTS_PER_AXIS;
        let [x, y, z] = block;
        // The control points lie on a grid: of each axis there are five distances.
        let squares: [[Lane; N]; 3] = std::array::from_fn(|c| {
            std::array::from_fn(|step| block[c].map(|p| (p - at_step(step)) * (p - at_step(step))))
        });
        let q = &self.affine;
        let mut moved: [Lane; 3] = std::array::from_fn(|c| {
            std::array::from_fn(|l| block[c][l] + q[0][c] + x[l] * q[1][c] + y[l] * q[2][c] + z[l] * q[3][c])
        });
        for (row, weights) in self.weights.as_chunks::<N>().0.iter().enumerate() {
            let (x, y) = (&squares[0][row / N], &squares[1][row % N]);
            let xy: Lane = std::array::from_fn(|l| x[l] + y[l]);
            for (z, weight) in squares[2].iter().zip(weights) {
                let value: Lane = std::array::from_fn(|l| phi(xy[l] + z[l]));
                for (coordinate, weight) in moved.iter_mut().zip(weight) {
                    (0..LANES).for_each(|l| coordinate[l] += value[l] * weight);
                }
            }
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corruptions::testing::{cloud, rng};

    const BOTH: [Kernel; 2] = [Kernel::Multiquadric, Kernel::InverseMultiquadric];

    #[test]
    fn control_points_go_where_they_are_sent() {
        let displacements = draw_displacements(Severity::ALL[4], &mut rng(9));
        for kernel in BOTH {
            let moved = kernel.deform(&control_points(), &displacements).unwrap();
            for ((p, control), d) in moved.iter().zip(control_points()).zip(displacements) {
                // The condition number is 3e4 at most: 1e-10 leaves two digits to spare.
                assert!((0..3).all(|c| (p[c] - control[c] - d[c]).abs() < 1e-10));
                assert!((d.iter().map(|c| c * c).sum::<f64>().sqrt() - 0.125).abs() < 1e-12);
            }
        }
    }

    /// The definition, point by point.
    fn one_by_one(kernel: Kernel, points: &[[f64; 3]], displacements: &Displacements) -> Vec<[f64; 3]> {
        let rhs = DMatrix::from_fn(UNKNOWNS, 3, |r, c| displacements.get(r).map_or(0.0, |d| d[c]));
        let w = kernel.factored().solve(&rhs).unwrap();
        let q = |i: usize, c: usize| w[(CONTROL_POINTS + i, c)];
        let moved = |p: &[f64; 3]| -> [f64; 3] {
            std::array::from_fn(|c| {
                let affine = p[c] + q(0, c) + p[0] * q(1, c) + p[1] * q(2, c) + p[2] * q(3, c);
                control_points().iter().enumerate().fold(affine, |sum, (i, control)| {
                    let squared: f64 = (0..3).map(|c| (p[c] - control[c]).powi(2)).sum();
                    let root = (squared + RADIUS * RADIUS).sqrt();
                    sum + w[(i, c)] * if kernel == Kernel::Multiquadric { root } else { 1.0 / root }
                })
            })
        };
        points.iter().map(moved).collect()
    }

    #[test]
    fn blocks_have_the_bits_of_the_definition() {
        let displacements = draw_displacements(Severity::ALL[2], &mut rng(3));
        for kernel in BOTH {
            // 77 leave a part of a block.
            let points = [cloud(77), control_points().to_vec(), vec![[0.0; 3], [-0.0, 9.0, -1e3]]].concat();
            let bits =
                |points: Vec<[f64; 3]>| points.iter().flatten().map(|c| c.to_bits()).collect::<Vec<_>>();
            let expected = bits(one_by_one(kernel, &points, &displacements));
            assert_eq!(bits(kernel.deform(&points, &displacements).unwrap()), expected);
        }
    }

    #[test]
    fn affine_displacements_are_reproduced_everywhere() {
        let map = |p: &[f64; 3]| [0.1 + 0.2 * p[1], -0.3 * p[0] + 0.1 * p[2], 0.05 * p[0] - 0.2];
        let displacements = control_points().map(|c| map(&c));
        let points = cloud(37);
        for kernel in BOTH {
            let moved = kernel.deform(&points, &displacements).unwrap();
            for (p, q) in points.iter().zip(&moved) {
                assert!((0..3).all(|c| (q[c] - p[c] - map(p)[c]).abs() < 1e-10));
            }
        }
    }

    #[test]
    fn directions_favour_the_z_axis() {
        // By the density of g the mean of z^2 is 1/2 and those of x^2 and y^2 are 1/4; uniform on
        // the sphere all would be 1/3. Over 25,000 directions the standard error is 0.0023 at most.
        let mut rng = rng(1);
        let mut squares = [0.0; 3];
        for _ in 0..200 {
            for d in draw_displacements(Severity::ALL[2], &mut rng) {
                (0..3).for_each(|c| squares[c] += (d[c] / 0.075).powi(2) / 25_000.0);
            }
        }
        assert!((0..3).all(|c| (squares[c] - [0.25, 0.25, 0.5][c]).abs() < 0.01), "{squares:?}");
    }
}
