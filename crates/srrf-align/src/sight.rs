//! [`SightMap`]: how far a scanner saw each way, and what it saw through.
//!
//! Where one scan has a surface, and the other's scanner looked through it, the two do not lie on each other: rooms that look alike
//! fit each other well, yet their loose things stand elsewhere.

use nalgebra::Vector3;
use srrf_cloud::Rigid;

/// Fewest and most rows of the map, with twice as many columns: cells of 7.5 to 2 degrees.
const ROWS: [usize; 2] = [24, 90];
/// Points of a cell, if all ways are seen.
const POINTS_PER_CELL: f64 = 2.0;
/// Cells of a neighbourhood of nine that must have seen something, its own among them.
const SEEN_CELLS: usize = 4;
/// A cell has seen through what lies nearer than this share of its range.
const NEARER: f64 = 0.93;

/// Ranges by direction from the scanner.
#[derive(Debug, Clone)]
pub struct SightMap {
    eye: Vector3<f64>,
    rows: usize,
    /// The least range of each cell, and the most; infinite and zero where nothing was seen.
    nearest: Vec<f32>,
    farthest: Vec<f32>,
}

impl SightMap {
    /// From the points of a scan and the place of its scanner, both in one frame.
    pub fn new<'a>(points: impl ExactSizeIterator<Item = &'a [f64; 3]>, eye: Vector3<f64>) -> Self {
        let rows = (points.len() as f64 / (2.0 * POINTS_PER_CELL)).sqrt() as usize;
        let rows = rows.clamp(ROWS[0], ROWS[1]);
        let cells = 2 * rows * rows;
        let mut map = Self { eye, rows, nearest: vec![f32::INFINITY; cells], farthest: vec![0.0; cells] };
        for p in points {
            if let Some((row, column, range)) = map.cell(&Vector3::from(*p)) {
                let at = 2 * map.rows * row + column;
                map.nearest[at] = map.nearest[at].min(range as f32);
                map.farthest[at] = map.farthest[at].max(range as f32);
            }
        }
        map
    }

    fn cell(&self, point: &Vector3<f64>) -> Option<(usize, usize, f64)> {
        let ray = point - self.eye;
        let range = ray.norm();
        if !(range > 0.0 && range.is_finite()) {
            return None;
        }
        let up = (ray.z / range).clamp(-1.0, 1.0).acos() / std::f64::consts::PI;
        let around = (ray.y.atan2(ray.x) / std::f64::consts::TAU).rem_euclid(1.0);
        let (rows, columns) = (self.rows, 2 * self.rows);
        let row = ((up * rows as f64) as usize).min(rows - 1);
        Some((row, ((around * columns as f64) as usize).min(columns - 1), range))
    }

    /// The least range around a cell: of it and the cells beside it; none where it saw nothing, or few of them did.
    fn clear(&self, row: usize, column: usize) -> Option<f64> {
        let columns = 2 * self.rows;
        if self.farthest[row * columns + column] == 0.0 {
            return None;
        }
        let (mut least, mut seen) = (f32::INFINITY, 0);
        for r in row.saturating_sub(1)..=(row + 1).min(self.rows - 1) {
            for c in [column + columns - 1, column, column + 1] {
                let at = r * columns + c % columns;
                seen += usize::from(self.farthest[at] > 0.0);
                least = least.min(self.nearest[at]);
            }
        }
        (seen >= SEEN_CELLS).then_some(f64::from(least))
    }

    /// Of points (moved by `frame_from_points`) in directions in which this scanner saw something: the share that it saw through, that is,
    /// that are clearly nearer than all that it saw there. `margin` is a length. None where fewer than 30 points are in such directions.
    pub fn seen_through<'a>(
        &self,
        points: impl Iterator<Item = &'a [f64; 3]>,
        frame_from_points: &Rigid,
        margin: f64,
    ) -> Option<f64> {
        let (mut asked, mut through) = (0usize, 0usize);
        for p in points {
            let moved = Vector3::from(frame_from_points.apply(p));
            let Some((row, column, range)) = self.cell(&moved) else { continue };
            if let Some(clear) = self.clear(row, column) {
                asked += 1;
                through += usize::from(range < NEARER * clear - margin);
            }
        }
        (asked >= 30).then(|| through as f64 / asked as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of radius 2 around the origin, seen from inside.
    fn ball() -> Vec<[f64; 3]> {
        let mut points = Vec::new();
        for i in 0..180 {
            for j in 0..360 {
                let (up, around) = ((i as f64 + 0.5).to_radians(), (j as f64 + 0.5).to_radians());
                points.push([2.0 * up.sin() * around.cos(), 2.0 * up.sin() * around.sin(), 2.0 * up.cos()]);
            }
        }
        points
    }

    #[test]
    fn what_stands_in_free_space_is_seen_through_and_what_is_hidden_is_not() {
        let map = SightMap::new(ball().iter(), Vector3::zeros());
        let half: Vec<[f64; 3]> = ball().iter().map(|p| p.map(|c| 0.5 * c)).collect();
        let share = |points: &[[f64; 3]]| map.seen_through(points.iter(), &Rigid::identity(), 0.02).unwrap();
        assert_eq!(share(&half), 1.0);
        assert_eq!(share(&ball()), 0.0);
        let behind: Vec<[f64; 3]> = ball().iter().map(|p| p.map(|c| 1.5 * c)).collect();
        assert_eq!(share(&behind), 0.0);
        let mixed: Vec<[f64; 3]> = ball().into_iter().chain(half.into_iter().step_by(9)).collect();
        assert!((share(&mixed) - 0.1).abs() < 1e-3, "{}", share(&mixed));
    }

    #[test]
    fn ways_that_were_not_looked_say_nothing() {
        let upper: Vec<[f64; 3]> = ball().into_iter().filter(|p| p[2] > 0.0).collect();
        let map = SightMap::new(upper.iter(), Vector3::zeros());
        let below: Vec<[f64; 3]> =
            ball().iter().filter(|p| p[2] < -0.5).map(|p| p.map(|c| 0.5 * c)).collect();
        assert_eq!(map.seen_through(below.iter(), &Rigid::identity(), 0.02), None);
    }
}
