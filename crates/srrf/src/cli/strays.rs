//! Points and ranges that are no measurement: coordinates beyond any usual unit, and points far from all others.

use serde::Serialize;
use srrf_args::words::{count, length, points};
use srrf_cloud::PointCloud;

/// Coordinates of this size are no lengths: in millimetres it is more than the way to the moon a thousand times over.
const ABSURD: f64 = 1e15;
/// Sizes below this are what is left of other numbers, such as whole numbers read as floating point.
const VANISHING: f64 = 1e-30;
/// A stray point is so many times farther from the middle than nine tenths of the points.
const FAR: f64 = 100.0;
/// More than this share of the points are no strays, but a part of the scene.
const MOST: f64 = 0.001;
/// Points that are named.
const NAMED: usize = 5;

/// A point that is far from all others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stray {
    /// Its number in the file, from 0.
    pub index: usize,
    /// Its place.
    pub point: [f64; 3],
    /// Its distance from the middle of the others, in spacings.
    pub spacings: f64,
}

/// What is odd about the numbers of a cloud.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct OddNumbers {
    /// Points far from all others, the farthest first.
    pub strays: Vec<Stray>,
    /// Index in the file, from 0, of the first point with a coordinate of absurd size, and how many there are.
    pub absurd: Option<(usize, usize)>,
    /// Number of points whose coordinates are all next to nothing, but not 0.
    pub vanishing: usize,
}

impl OddNumbers {
    /// Looks at a cloud of this spacing. `kept` says which points of the file are in it.
    pub fn of(cloud: &PointCloud, spacing: f64, kept: Option<&[bool]>) -> Self {
        let list = cloud.points();
        let of_file = |index: usize| match kept {
            None => index,
            Some(kept) => {
                kept.iter().enumerate().filter(|(_, kept)| **kept).nth(index).map_or(index, |(at, _)| at)
            }
        };
        let is_absurd = |p: &&[f64; 3]| p.iter().any(|c| c.abs() >= ABSURD);
        let absurd = list
            .iter()
            .position(|p| is_absurd(&p))
            .map(|first| (of_file(first), list.iter().filter(is_absurd).count()));
        let size = |p: &[f64; 3]| p.iter().map(|c| c.abs()).fold(0.0, f64::max);
        let vanishing = list.iter().filter(|p| size(p) > 0.0 && size(p) < VANISHING).count();
        Self { strays: strays(list, spacing, of_file), absurd, vanishing }
    }

    /// Each in a sentence.
    pub fn text(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if let Some((first, absurd)) = self.absurd {
            lines.push(format!(
                "coordinates of {ABSURD:e} and more in {}, the first of them point {first} (from 0): no lengths in any usual unit; \
                 is the file what its name says, and are its numbers read with the right type (--layout, --columns)?",
                points(absurd)
            ));
        }
        if self.vanishing > 0 {
            lines.push(format!(
                "coordinates below {VANISHING:e}, but not 0, in {}: whole numbers read as floating point look so; are they \
                 read with the right type?",
                points(self.vanishing)
            ));
        }
        for stray in self.strays.iter().take(NAMED) {
            lines.push(format!(
                "point {} (from 0) at ({}) lies {} spacings from the middle of the others; if it is no measurement, drop it, \
                 for instance with `numpy.delete(points, {}, axis=0)`",
                stray.index,
                stray.point.map(|c| length(c, 6)).join(", "),
                length(stray.spacings, 2),
                stray.index
            ));
        }
        if self.strays.len() > NAMED {
            lines.push(format!(
                "and {} more such points, which --json lists",
                count(self.strays.len() - NAMED)
            ));
        }
        lines
    }
}

/// The points that are far from all others, by their distance from the middle.
fn strays(points: &[[f64; 3]], spacing: f64, of_file: impl Fn(usize) -> usize) -> Vec<Stray> {
    if points.len() < 4 {
        return Vec::new();
    }
    // The middle of each axis by itself, which no stray moves.
    let middle: [f64; 3] = std::array::from_fn(|axis| {
        let mut values: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        let half = values.len() / 2;
        *values.select_nth_unstable_by(half, f64::total_cmp).1
    });
    // Without squares, which would not be finite for absurd numbers.
    let distance = |p: &[f64; 3]| (p[0] - middle[0]).hypot(p[1] - middle[1]).hypot(p[2] - middle[2]);
    let distances: Vec<f64> = points.iter().map(distance).collect();
    let nine_tenths = {
        let mut values = distances.clone();
        let at = (values.len() * 9 / 10).min(values.len() - 2);
        *values.select_nth_unstable_by(at, f64::total_cmp).1
    };
    let mut far: Vec<usize> =
        (0..points.len()).filter(|&i| distances[i] > FAR * nine_tenths.max(spacing)).collect();
    if far.len() as f64 > (MOST * points.len() as f64).max(1.0) {
        return Vec::new();
    }
    far.sort_by(|&a, &b| distances[b].total_cmp(&distances[a]));
    let spacings = |i: usize| if spacing > 0.0 { distances[i] / spacing } else { f64::MAX };
    let stray = |i: usize| Stray { index: of_file(i), point: points[i], spacings: spacings(i) };
    far.into_iter().map(stray).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(count: usize) -> Vec<[f64; 3]> {
        (0..count).map(|i| [0.5 * (i % 30) as f64, 0.5 * (i / 30) as f64, 7.0]).collect()
    }

    fn odd(points: Vec<[f64; 3]>, kept: Option<&[bool]>) -> OddNumbers {
        OddNumbers::of(&PointCloud::new(points).unwrap(), 0.5, kept)
    }

    #[test]
    fn a_point_far_away_is_named_with_its_index() {
        for count in [9, 40, 900] {
            let mut points = grid(count);
            points.insert(7, [5e5, 0.0, 7.0]);
            let found = odd(points.clone(), None);
            assert_eq!(found.strays.len(), 1, "{count}");
            assert_eq!((found.strays[0].index, found.strays[0].point), (7, [5e5, 0.0, 7.0]));
            assert!((found.strays[0].spacings - 1e6).abs() < 20.0, "{:?}", found.strays);
            let text = found.text().join("\n");
            assert!(text.starts_with("point 7 (from 0) at (500000, 0, 7) lies"), "{text}");
            assert!(text.contains("numpy.delete(points, 7, axis=0)"), "{text}");
            // Two points before it were left out.
            let mut kept = vec![true; count + 3];
            (kept[0], kept[5]) = (false, false);
            assert_eq!(odd(points, Some(&kept)).strays[0].index, 9);
        }
        assert_eq!(odd(grid(900), None), OddNumbers::default());
    }

    #[test]
    fn a_second_part_of_the_scene_is_no_stray() {
        let mut points = grid(900);
        points.extend(grid(90).iter().map(|p| [p[0] + 1e5, p[1], p[2]]));
        assert_eq!(odd(points, None), OddNumbers::default());
        // Three far from each other and from the rest, of many.
        let mut points = grid(9000);
        points.extend([[1e9, 0.0, 0.0], [0.0, -1e8, 0.0], [0.0, 0.0, 1e300]]);
        let found = odd(points, None);
        assert_eq!(found.strays.iter().map(|s| s.index).collect::<Vec<_>>(), [9002, 9000, 9001]);
        assert_eq!(found.absurd, Some((9002, 1)));
        assert!(found.text()[0].contains("1 point have coordinates") || found.text()[0].contains("1e15"));
    }

    #[test]
    fn numbers_that_are_no_lengths() {
        let found = odd((0..40).map(|i| [1e30, f64::from(i) * 1e28, 1e-42]).collect(), None);
        assert_eq!(found.absurd, Some((0, 40)));
        let found = odd((1..41).map(|i| [1e-42, f64::from(i) * 1e-40, 0.0]).collect(), None);
        assert_eq!((found.vanishing, found.strays.len()), (40, 0));
        assert!(found.text()[0].contains("whole numbers read as floating point"));
    }
}
