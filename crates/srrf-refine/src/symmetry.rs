//! Rotations that may map a body onto itself, from its principal axes.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

use crate::orientations::{best_apart, orientations};
use crate::prepared::CloudLevel;

/// Principal moments within this share of each other count as equal: a body with a symmetry beyond half-turns has equal ones.
const EQUAL: f64 = 0.12;
/// Steps of a turn about an axis: a half, third, quarter, sixth, eighth and twelfth of it are among them.
const STEPS: usize = 48;
/// Rotations all around where all moments are equal: one within about 10 degrees of any.
const ALL_AROUND: usize = 3000;
/// Points that are turned.
const POINTS: usize = 96;
/// Width of the score, in radii: what a turn to the middle between two tried ones moves points by.
const WIDTH: f64 = 0.15;
/// Two rotations closer than this are one, about an axis, and all around.
const APART: [f64; 2] = [0.18, 0.4];
/// Rotations that score less than this share of the identity are no symmetries.
const LEAST: f64 = 0.6;
/// Most rotations.
const MOST: usize = 40;

/// Rotations about the origin (the identity is not among them) that bring the points of a body, whose mean is there, near to
/// themselves, best first.
/// Bodies with three different moments have half-turns about the principal axes and nothing else to look at.
pub(crate) fn symmetries(level: &CloudLevel, radius: f64) -> Vec<Matrix3<f64>> {
    let points = level.points();
    let scatter = points.iter().fold(Matrix3::zeros(), |sum, p| {
        let d = Vector3::from(*p);
        sum + d * d.transpose()
    });
    let eigen = scatter.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let moments = order.map(|i| eigen.eigenvalues[i].max(0.0));
    let axes = order.map(|i| Unit::new_normalize(eigen.eigenvectors.column(i).into_owned()));
    let equal = |a: f64, b: f64| a - b <= EQUAL * a;
    let about = |axis: &Unit<Vector3<f64>>, angle: f64| Rotation3::from_axis_angle(axis, angle).into_inner();
    let (tried, apart): (Vec<Matrix3<f64>>, f64) =
        match [equal(moments[0], moments[1]), equal(moments[1], moments[2])] {
            [false, false] => return axes.iter().map(|axis| about(axis, PI)).collect(),
            [true, true] => (orientations(ALL_AROUND).collect(), APART[1]),
            [first, _] => {
                let (axis, aside) = if first { (axes[2], axes[0]) } else { (axes[0], axes[1]) };
                let step = |k: usize| k as f64 * TAU / STEPS as f64;
                let turns = (1..STEPS).map(|k| about(&axis, step(k)));
                let flips = (0..STEPS / 2).map(|k| {
                    let across = Unit::new_normalize(about(&axis, step(k)) * aside.into_inner());
                    about(&across, PI)
                });
                (turns.chain(flips).collect(), APART[0])
            }
        };
    let body = Body { level, width: WIDTH * radius };
    best_apart(tried, |rotation| body.score(rotation), LEAST, apart, MOST)
}

struct Body<'a> {
    level: &'a CloudLevel,
    width: f64,
}

impl Body<'_> {
    /// How near some points lie to the body when turned, in [0, 1].
    fn score(&self, rotation: &Matrix3<f64>) -> f64 {
        let points = self.level.points();
        let stride = points.len().div_ceil(POINTS);
        let squared = self.width * self.width;
        let (mut sum, mut count) = (0.0, 0);
        for p in points.iter().step_by(stride) {
            let turned = rotation * Vector3::from(*p);
            sum += squared / (squared + self.level.index.nearest(&turned.into()).1);
            count += 1;
        }
        sum / f64::from(count)
    }
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};
    use srrf_cloud::PointCloud;

    use super::*;
    use crate::orientations::angle;
    use crate::prepared::RefineCloud;

    /// Points on the surface of a box.
    fn boxed(sides: [f64; 3]) -> RefineCloud {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let area = |face: usize| sides[(face + 1) % 3] * sides[(face + 2) % 3];
        let whole: f64 = (0..3).map(area).sum();
        let points = (0..1200).map(|_| {
            let mut pick = rng.random::<f64>() * whole;
            let face = (0..2)
                .find(|f| {
                    let hit = pick < area(*f);
                    pick -= area(*f);
                    hit
                })
                .unwrap_or(2);
            let mut p: [f64; 3] = std::array::from_fn(|c| sides[c] * rng.random::<f64>());
            p[face] = if rng.random_bool(0.5) { 0.0 } else { sides[face] };
            p
        });
        RefineCloud::of(&PointCloud::new(points.collect()).unwrap())
    }

    fn of(cloud: &RefineCloud) -> Vec<Matrix3<f64>> {
        symmetries(cloud.coarse(), cloud.radius)
    }

    #[test]
    fn a_box_has_half_turns_and_a_cube_all_of_its_group() {
        let turns = of(&boxed([1.0, 2.0, 3.0]));
        assert_eq!(turns.len(), 3);
        assert!(turns.iter().all(|r| (angle(r) - PI).abs() < 1e-6));
        let cube = of(&boxed([1.0; 3]));
        // Each of the 23 is within 15 degrees of one that was found.
        let about = |axis: [f64; 3], by: f64| {
            Rotation3::from_axis_angle(&Unit::new_normalize(Vector3::from(axis)), by).into_inner()
        };
        for want in
            [about([1.0, 0.0, 0.0], PI / 2.0), about([0.0, 1.0, 0.0], PI), about([1.0, 1.0, 1.0], TAU / 3.0)]
        {
            assert!(cube.iter().any(|r| angle(&(r.transpose() * want)) < 0.26), "{want} {}", cube.len());
        }
        assert!(cube.len() >= 23, "{}", cube.len());
        // A square rod: quarter turns about its axis among them.
        let rod = of(&boxed([1.0, 1.0, 3.0]));
        let quarter = about([0.0, 0.0, 1.0], PI / 2.0);
        assert!(rod.iter().any(|r| angle(&(r.transpose() * quarter)) < 0.07), "{}", rod.len());
    }
}
