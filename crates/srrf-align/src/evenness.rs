//! [`Evenness`]: how even the surface around a point is, and how far it goes on.

use nalgebra::{Matrix2, Vector2, Vector3};
use rayon::prelude::*;
use srrf_cloud::KnnIndex;

/// Neighbours that are asked.
pub const NEIGHBOURS: usize = 12;
/// Neighbours on an even surface are off its plane by at most this share of the distance of the farthest.
const EVEN: f64 = 0.1;
/// Half the width of an evenly filled strip, in standard deviations across it.
const HALF_WIDTH: f64 = 1.7;
/// Where a surface ends at a point, its neighbours' mean is off by the inverse of this, as a share of the distance of the farthest.
const AT_EDGE: f64 = 2.3;

/// The surface around a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evenness {
    /// How far its neighbours are off the plane through their mean, root mean square.
    pub off: f64,
    /// About how far the surface goes on to the nearest side; 0 where it is not even.
    pub breadth: f64,
}

/// Of each point of an index, with unit normals.
pub fn evenness(index: &KnnIndex, normals: &[[f64; 3]]) -> Vec<Evenness> {
    index.points().par_iter().zip(normals).map(|(point, normal)| at(index, point, normal)).collect()
}

fn at(index: &KnnIndex, point: &[f64; 3], normal: &[f64; 3]) -> Evenness {
    let near = index.k_nearest(point, NEIGHBOURS);
    let (point, normal) = (Vector3::from(*point), Vector3::from(*normal));
    let aside = if normal.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    let u = normal.cross(&aside).normalize();
    let v = normal.cross(&u);
    let count = near.len().max(1) as f64;
    let reach = near.iter().map(|n| n.1).fold(0.0, f64::max).sqrt();
    // About the mean: the point itself may be off.
    let (mut off, mut off_squares, mut flat, mut flat_squares) =
        (0.0, 0.0, Vector2::zeros(), Matrix2::zeros());
    for (j, _) in &near {
        let d = Vector3::from(index.points()[*j]) - point;
        let (across, along) = (d.dot(&normal), Vector2::new(d.dot(&u), d.dot(&v)));
        off += across / count;
        off_squares += across * across / count;
        flat += along / count;
        flat_squares += along * along.transpose() / count;
    }
    let off = (off_squares - off * off).max(0.0).sqrt();
    let spread = flat_squares - flat * flat.transpose();
    let narrow = spread.symmetric_eigenvalues().min().max(0.0).sqrt();
    let breadth = (HALF_WIDTH * narrow).min(reach - AT_EDGE * flat.norm()).max(0.0);
    Evenness { off, breadth: if off <= EVEN * reach { breadth } else { 0.0 } }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid across z, `long` by `wide` points a tenth apart.
    fn grid(long: i32, wide: i32) -> KnnIndex {
        let points: Vec<[f64; 3]> =
            (0..long * wide).map(|k| [0.1 * f64::from(k % long), 0.1 * f64::from(k / long), 0.0]).collect();
        KnnIndex::new(&points).unwrap()
    }

    fn breadths(index: &KnnIndex) -> Vec<f64> {
        let normals = vec![[0.0, 0.0, 1.0]; index.points().len()];
        evenness(index, &normals).into_iter().map(|e| e.breadth).collect()
    }

    #[test]
    fn a_surface_is_broad_inside_and_not_at_its_edge() {
        let found = breadths(&grid(21, 21));
        // The middle, a corner, the middle of a side.
        assert!(found[220] > 0.15 && found[220] < 0.25, "{}", found[220]);
        assert!(found[0] < 0.02 && found[10] < 0.06, "{} {}", found[0], found[10]);
    }

    #[test]
    fn a_strip_is_as_narrow_as_it_is() {
        let found = breadths(&grid(40, 2));
        assert!(found.iter().all(|b| *b <= 0.09), "{found:?}");
    }

    #[test]
    fn an_edge_of_two_faces_is_not_even() {
        let points: Vec<[f64; 3]> = (0..400)
            .map(|k| (0.1 * f64::from(k % 20), 0.1 * f64::from(k / 20)))
            .map(|(x, y)| if x < 1.0 { [x, y, 0.0] } else { [1.0, y, x - 1.0] })
            .collect();
        let index = KnnIndex::new(&points).unwrap();
        let slanting = [0.5f64.sqrt(), 0.0, -0.5f64.sqrt()];
        let found = evenness(&index, &vec![slanting; 400]);
        assert_eq!(found[210].breadth, 0.0);
    }
}
