//! [`SightMap`]: how far a scanner saw each way, and what it saw through.
//!
//! Where one scan has a surface, and the other's scanner looked through it, the two do not lie on each other: rooms that look alike
//! fit each other well, yet their loose things stand elsewhere. What was seen is kept as small planes, so that a thing a hand deep in
//! front of a wall is told even where the wall is seen aslant.

use nalgebra::Vector3;
use srrf_cloud::{CloudError, KnnIndex, Rigid, estimate_normals};

use crate::evenness::{NEIGHBOURS, evenness};

/// Fewest and most rows of the map, with twice as many columns: cells of 7.5 to 2 degrees.
const ROWS: [usize; 2] = [24, 90];
/// Points of a cell, if all ways are seen.
const POINTS_PER_CELL: f64 = 2.0;
/// Most points that a map is made of.
const MOST_POINTS: usize = 40_000;
/// Most planes of a cell.
const PLANES_PER_CELL: usize = 4;
/// Cells of a neighbourhood of nine that must have seen something, its own among them.
const SEEN_CELLS: usize = 5;
/// A surface is asked from this cosine of its slant on: edge-on, a scanner hits it by chance.
const ASLANT: f64 = 0.2;
/// What was seen may be off its plane by so many times what its neighbours are.
const ROUGH: f64 = 3.0;
/// A pose that is right to a fifth of a degree is off by this share of the range.
const TURN: f64 = 0.004;
/// Planes that were seen under a smaller cosine are no planes: their range is what was measured, by so much.
const EDGE_ON: f64 = 0.15;
const EDGE_ON_SHARE: f64 = 0.2;
/// A plane says nothing far from its point: its range is within these multiples of the measured one.
const PLANE_RANGE: [f64; 2] = [0.7, 1.4];
/// A surface is asked where it goes on to all sides by so many steps between the rays: a narrow one falls between them.
const BROAD: f64 = 1.0;
/// Fewest points that say something.
const LEAST_ASKED: usize = 30;

/// A small plane that was seen.
#[derive(Debug, Clone, Copy)]
struct Patch {
    /// Towards the eye.
    normal: Vector3<f64>,
    /// Distance of the eye from the plane.
    height: f64,
    range: f64,
    /// How far off it its neighbours may be.
    rough: f64,
}

/// A place on a surface that a scanner is asked about.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceSpot<'a> {
    pub point: &'a [f64; 3],
    pub normal: &'a Vector3<f64>,
    /// How far the surface goes on to the nearest side.
    pub breadth: f64,
}

/// What a scanner says of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seen {
    /// It did not look there.
    Unknown,
    /// It saw it.
    There,
    /// It saw through it.
    Through,
    /// Something was before it.
    Hidden,
}

/// Planes by direction from the scanner.
#[derive(Debug, Clone)]
pub struct SightMap {
    eye: Vector3<f64>,
    rows: usize,
    /// Where the patches of each cell begin.
    begins: Vec<u32>,
    patches: Vec<Patch>,
}

impl SightMap {
    /// From the points of a scan and the place of its scanner, both in one frame.
    ///
    /// # Errors
    /// [`CloudError`] for fewer than three points.
    pub fn new(points: &[[f64; 3]], eye: Vector3<f64>) -> Result<Self, CloudError> {
        let step = points.len().div_ceil(MOST_POINTS).max(1);
        let points: Vec<[f64; 3]> = points.iter().step_by(step).copied().collect();
        let normals = estimate_normals(&points, NEIGHBOURS)?;
        let around = evenness(&KnnIndex::new(&points)?, &normals);
        let rows = (points.len() as f64 / (2.0 * POINTS_PER_CELL)).sqrt() as usize;
        let rows = rows.clamp(ROWS[0], ROWS[1]);
        let mut map = Self { eye, rows, begins: Vec::new(), patches: Vec::new() };
        let mut cells: Vec<Vec<Patch>> = vec![Vec::new(); 2 * rows * rows];
        for ((p, normal), around) in points.iter().zip(&normals).zip(&around) {
            let ray = Vector3::from(*p) - eye;
            let Some((row, column, range)) = map.cell(&ray) else { continue };
            let cell = &mut cells[2 * rows * row + column];
            if cell.len() < PLANES_PER_CELL {
                let normal = Vector3::from(*normal);
                let height = -normal.dot(&ray);
                let side = if height < 0.0 { -1.0 } else { 1.0 };
                let rough = ROUGH * around.off;
                cell.push(Patch { normal: side * normal, height: side * height, range, rough });
            }
        }
        for cell in cells {
            map.begins.push(map.patches.len() as u32);
            map.patches.extend(cell);
        }
        map.begins.push(map.patches.len() as u32);
        Ok(map)
    }

    /// The place of the scanner.
    pub fn eye(&self) -> Vector3<f64> {
        self.eye
    }

    fn cell(&self, ray: &Vector3<f64>) -> Option<(usize, usize, f64)> {
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

    fn patches(&self, cell: usize) -> &[Patch] {
        &self.patches[self.begins[cell] as usize..self.begins[cell + 1] as usize]
    }

    /// Angle between neighbouring rays, radians.
    fn step(&self) -> f64 {
        std::f64::consts::PI / (self.rows as f64 * POINTS_PER_CELL.sqrt())
    }

    /// What it says of a point with a normal (either way round) on a surface so broad. `margin` is a length.
    pub fn look(&self, point: &Vector3<f64>, normal: &Vector3<f64>, breadth: f64, margin: f64) -> Seen {
        let ray = point - self.eye;
        let Some((row, column, range)) = self.cell(&ray) else { return Seen::Unknown };
        let way = ray / range;
        let columns = 2 * self.rows;
        let slope = normal.dot(&way).abs();
        let narrow = breadth * slope < BROAD * self.step() * range;
        if slope < ASLANT || narrow || self.patches(row * columns + column).is_empty() {
            return Seen::Unknown;
        }
        let margin = margin + TURN * range;
        let (mut clear, mut end, mut seen) = (f64::INFINITY, 0.0f64, 0);
        for r in row.saturating_sub(1)..=(row + 1).min(self.rows - 1) {
            for c in [column + columns - 1, column, column + 1] {
                let patches = self.patches(r * columns + c % columns);
                seen += usize::from(!patches.is_empty());
                for patch in patches {
                    let cosine = -patch.normal.dot(&way);
                    let (at, less) = if cosine < EDGE_ON {
                        (patch.range, EDGE_ON_SHARE * patch.range)
                    } else {
                        let [low, high] = PLANE_RANGE.map(|share| share * patch.range);
                        ((patch.height / cosine).clamp(low, high), (margin + patch.rough) / cosine)
                    };
                    clear = clear.min(at - less);
                    end = end.max(at + less);
                }
            }
        }
        match () {
            () if seen < SEEN_CELLS => Seen::Unknown,
            () if range < clear => Seen::Through,
            () if range <= end => Seen::There,
            () => Seen::Hidden,
        }
    }

    /// The same by the point's own cell alone.
    pub fn glance(&self, point: &Vector3<f64>, normal: &Vector3<f64>, margin: f64) -> Seen {
        let ray = point - self.eye;
        let Some((row, column, range)) = self.cell(&ray) else { return Seen::Unknown };
        if normal.dot(&ray).abs() < ASLANT * range {
            return Seen::Unknown;
        }
        let (mut clear, mut end) = (f64::INFINITY, 0.0f64);
        for patch in self.patches(2 * row * self.rows + column) {
            let cosine = (patch.height / patch.range).max(EDGE_ON);
            clear = clear.min(patch.range - margin / cosine);
            end = end.max(patch.range + margin / cosine);
        }
        match () {
            () if end == 0.0 => Seen::Unknown,
            () if range < clear => Seen::Through,
            () if range <= end => Seen::There,
            () => Seen::Hidden,
        }
    }

    /// Of places (moved by `frame_from_points`) in directions in which this scanner saw something: the share that it saw
    /// through, that is, that are clearly nearer than all that it saw there. None where few points are in such directions.
    pub fn seen_through<'a>(
        &self,
        points: impl Iterator<Item = SurfaceSpot<'a>>,
        frame_from_points: &Rigid,
        margin: f64,
    ) -> Option<f64> {
        let (mut asked, mut through) = (0usize, 0usize);
        for SurfaceSpot { point, normal, breadth } in points {
            let moved = Vector3::from(frame_from_points.apply(point));
            let seen = self.look(&moved, &(frame_from_points.rotation * normal), breadth, margin);
            asked += usize::from(seen != Seen::Unknown);
            through += usize::from(seen == Seen::Through);
        }
        (asked >= LEAST_ASKED).then(|| through as f64 / asked as f64)
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

    fn share(map: &SightMap, points: &[[f64; 3]]) -> Option<f64> {
        let normals: Vec<Vector3<f64>> = points.iter().map(|p| Vector3::from(*p).normalize()).collect();
        let asked =
            points.iter().zip(&normals).map(|(point, normal)| SurfaceSpot { point, normal, breadth: 0.1 });
        map.seen_through(asked, &Rigid::identity(), 0.02)
    }

    #[test]
    fn what_stands_in_free_space_is_seen_through_and_what_is_hidden_is_not() {
        let map = SightMap::new(&ball(), Vector3::zeros()).unwrap();
        let half: Vec<[f64; 3]> = ball().iter().map(|p| p.map(|c| 0.5 * c)).collect();
        assert_eq!(share(&map, &half), Some(1.0));
        assert_eq!(share(&map, &ball()), Some(0.0));
        let behind: Vec<[f64; 3]> = ball().iter().map(|p| p.map(|c| 1.5 * c)).collect();
        assert_eq!(share(&map, &behind), Some(0.0));
        let mixed: Vec<[f64; 3]> = ball().into_iter().chain(half.into_iter().step_by(9)).collect();
        let found = share(&map, &mixed).unwrap();
        assert!((found - 0.1).abs() < 1e-3, "{found}");
    }

    #[test]
    fn a_thing_a_hand_deep_in_front_of_a_slanting_wall_is_seen_through() {
        // A wall a metre away that runs along x to 8 metres; what lies on it there is seen under 7 degrees and more.
        let wall = |depth: f64| {
            (0..400).flat_map(move |i| {
                (0..100).map(move |j| [-4.0 + 0.02 * f64::from(i), 1.0 - depth, -1.0 + 0.02 * f64::from(j)])
            })
        };
        let map = SightMap::new(&wall(0.0).collect::<Vec<_>>(), Vector3::zeros()).unwrap();
        let through = |depth: f64| {
            let points: Vec<[f64; 3]> = wall(depth).filter(|p| p[0] > 2.5 && p[0] < 3.5).collect();
            let normal = Vector3::y();
            let asked = points.iter().map(|point| SurfaceSpot { point, normal: &normal, breadth: 0.5 });
            map.seen_through(asked, &Rigid::identity(), 0.03)
        };
        assert_eq!(through(0.01), Some(0.0));
        assert!(through(0.15).unwrap() > 0.95, "{:?}", through(0.15));
    }

    #[test]
    fn what_is_narrower_than_the_way_between_two_rays_is_not_asked() {
        let map = SightMap::new(&ball(), Vector3::zeros()).unwrap();
        // Half a metre before the eye, rays are a good centimetre apart.
        let (point, normal) = (Vector3::new(0.5, 0.0, 0.01), Vector3::x());
        assert_eq!(map.look(&point, &normal, 0.02, 0.02), Seen::Through);
        assert_eq!(map.look(&point, &normal, 0.005, 0.02), Seen::Unknown);
    }

    #[test]
    fn ways_that_were_not_looked_say_nothing() {
        let upper: Vec<[f64; 3]> = ball().into_iter().filter(|p| p[2] > 0.0).collect();
        let map = SightMap::new(&upper, Vector3::zeros()).unwrap();
        let below: Vec<[f64; 3]> =
            ball().iter().filter(|p| p[2] < -0.5).map(|p| p.map(|c| 0.5 * c)).collect();
        assert_eq!(share(&map, &below), None);
    }
}
