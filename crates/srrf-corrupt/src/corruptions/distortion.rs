//! `distortion`: free-form deformation (Sederberg and Parry 1986).

use rand::{Rng, rngs::ChaCha8Rng};

use super::blocks::{BlockMotion, LANES, Lane, move_all};
use super::draws::in_cube;
use super::lattice::{CONTROL_POINTS_PER_AXIS, Displacements};
use crate::card::{Card, Family, Strength};
use crate::corruption::{CorruptError, Corrupted, Corruption, check_points};
use crate::severity::Severity;

/// Largest displacement of a control point on each coordinate, in units of the lattice's side, [`BOX_SIDE`].
pub const AMPLITUDE: [f64; 5] = [0.1, 0.2, 0.3, 0.4, 0.5];

/// Side of the lattice's box `[-1, 1]^3`. PyGeM measures displacements in it, so the amplitudes above count double.
pub const BOX_SIDE: f64 = 2.0;

/// What the registry says of it.
pub(super) const CARD: Card = Card {
    name: "distortion",
    family: Family::Transformation,
    summary: "free-form deformation by 5 x 5 x 5 control points",
    strength: Strength::Value("amplitude", AMPLITUDE),
    build: |_| Box::new(Distortion),
};

/// A cloud bends as if it were embedded in rubber: all control points of a 5 x 5 x 5 lattice on
/// `[-1, 1]^3` are displaced, and the points follow by Bernstein polynomials of degree 4.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Distortion;

impl Corruption for Distortion {
    fn name(&self) -> &'static str {
        CARD.name
    }

    fn is_box_normalized(&self) -> bool {
        true
    }

    fn apply(
        &self,
        points: &[[f64; 3]],
        severity: Severity,
        rng: &mut ChaCha8Rng,
    ) -> Result<Corrupted, CorruptError> {
        check_points(points, self.name(), 1)?;
        let displacements = draw_displacements(severity, rng);
        Ok(Corrupted::moved(deform(points, &displacements)))
    }
}

/// Uniform displacements on every coordinate of every control point, in units of the box side.
pub fn draw_displacements<R: Rng>(severity: Severity, rng: &mut R) -> Displacements {
    std::array::from_fn(|_| in_cube(severity.of(&AMPLITUDE), rng))
}

/// The deformed points `p + side * sum_ijk B_i(u_x) B_j(u_y) B_k(u_z) mu_ijk` with
/// `u = (p + 1) / 2`. Points outside the box `[-1, 1]^3` stay where they are.
pub fn deform(points: &[[f64; 3]], displacements: &Displacements) -> Vec<[f64; 3]> {
    move_all(points, &FreeForm(displacements))
}

struct FreeForm<'a>(&'a Displacements);

impl BlockMotion for FreeForm<'_> {
    #[inline(always)]
    fn apply(&self, block: &[Lane; 3]) -> [Lane; 3] {
        const N: usize = CONTROL_POINTS_PER_AXIS;
        let u = block.map(|coordinate| coordinate.map(|c| (c + 1.0) / BOX_SIDE));
        // The polynomials of each axis, at each point.
        let [bx, by, bz]: [[Lane; N]; 3] = std::array::from_fn(|axis| {
            let at = u[axis].map(bernstein);
            std::array::from_fn(|i| std::array::from_fn(|l| at[l][i]))
        });
        let mut moved = *block;
        for (row, mus) in self.0.as_chunks::<N>().0.iter().enumerate() {
            let (x, y) = (&bx[row / N], &by[row % N]);
            let xy: Lane = std::array::from_fn(|l| BOX_SIDE * x[l] * y[l]);
            for (z, mu) in bz.iter().zip(mus) {
                let weight: Lane = std::array::from_fn(|l| xy[l] * z[l]);
                for (coordinate, mu) in moved.iter_mut().zip(mu) {
                    (0..LANES).for_each(|l| coordinate[l] += weight[l] * mu);
                }
            }
        }
        let inside = |l: usize| (0..3).all(|axis| (0.0..=1.0).contains(&u[axis][l]));
        let outside: [bool; LANES] = std::array::from_fn(|l| !inside(l));
        for (coordinate, before) in moved.iter_mut().zip(block) {
            (0..LANES).filter(|&l| outside[l]).for_each(|l| coordinate[l] = before[l]);
        }
        moved
    }
}

/// The five Bernstein polynomials of degree 4 at `u`.
#[inline(always)]
fn bernstein(u: f64) -> [f64; CONTROL_POINTS_PER_AXIS] {
    let v = 1.0 - u;
    [v * v * v * v, 4.0 * u * v * v * v, 6.0 * u * u * v * v, 4.0 * u * u * u * v, u * u * u * u]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corruptions::lattice::CONTROL_POINTS;
    use crate::corruptions::testing::{cloud, rms_displacement, rng};

    #[test]
    fn a_lattice_moved_as_a_whole_moves_the_points_twice_as_far() {
        let out = deform(&[[0.3, -0.2, 0.9]], &[[0.1, 0.0, -0.05]; CONTROL_POINTS])[0];
        assert!((out[0] - 0.5).abs() < 1e-12 && out[1] == -0.2 && (out[2] - 0.8).abs() < 1e-12);
    }

    #[test]
    fn a_corner_follows_its_control_point_and_outside_nothing_moves() {
        let mut displacements = [[0.0; 3]; CONTROL_POINTS];
        displacements[4] = [0.1, 0.2, 0.3]; // i = 0, j = 0, k = 4: the corner (-1, -1, 1)
        let out = deform(&[[-1.0, -1.0, 1.0]], &displacements)[0];
        assert!((0..3).all(|c| (out[c] - [-0.8, -0.6, 1.6][c]).abs() < 1e-12), "{out:?}");
        assert_eq!(deform(&[[-1.0, -1.0, 1.1]], &displacements), [[-1.0, -1.0, 1.1]]);
    }

    /// The definition, point by point.
    fn one_by_one(point: &[f64; 3], displacements: &Displacements) -> [f64; 3] {
        const N: usize = CONTROL_POINTS_PER_AXIS;
        let u = point.map(|c| (c + 1.0) / BOX_SIDE);
        if u.iter().any(|c| !(0.0..=1.0).contains(c)) {
            return *point;
        }
        let [bx, by, bz] = u.map(bernstein);
        std::array::from_fn(|c| {
            displacements.iter().enumerate().fold(point[c], |sum, (index, mu)| {
                sum + BOX_SIDE * bx[index / (N * N)] * by[index / N % N] * bz[index % N] * mu[c]
            })
        })
    }

    #[test]
    fn blocks_have_the_bits_of_the_definition() {
        let displacements = draw_displacements(Severity::ALL[2], &mut rng(3));
        // 77 leave a part of a block.
        let points = [cloud(77), vec![[1.0; 3], [-1.0; 3], [0.0, -0.0, 2.0], [1e3, 0.0, 0.0]]].concat();
        let bits = |points: Vec<[f64; 3]>| points.iter().flatten().map(|c| c.to_bits()).collect::<Vec<_>>();
        let expected = bits(points.iter().map(|p| one_by_one(p, &displacements)).collect());
        assert_eq!(bits(deform(&points, &displacements)), expected);
    }

    #[test]
    fn strength() {
        // On ModelNet40 shapes the rms displacement is 0.032, 0.064, 0.098, 0.130, 0.159; on
        // spheres it is near that, over 60 draws within 10 %.
        let points = cloud(512);
        for (severity, rms) in Severity::ALL.into_iter().zip([0.032, 0.064, 0.098, 0.130, 0.159]) {
            let found = rms_displacement(&Distortion, &points, severity, &mut rng(4), 60);
            assert!((found / rms - 1.0).abs() < 0.15, "{severity}: {found} against {rms}");
        }
    }
}
