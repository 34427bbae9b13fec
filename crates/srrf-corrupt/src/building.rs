//! A simulated building: rooms that look alike on both sides of two corridors, and what a scanner sees in it.

use nalgebra::Vector3;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use srrf_cloud::{CloudError, PointCloud};

use crate::solids::Solids;

/// Metres.
const ROOM_WIDTH: f64 = 4.5;
const ROOM_DEPTH: f64 = 5.0;
const HEIGHT: f64 = 3.0;
const CORRIDOR: f64 = 2.4;
const DOOR: [f64; 2] = [0.9, 2.1];
/// Distance between stations in a corridor.
const STEP: f64 = 4.0;
const EYE: f64 = 1.5;

/// Where a scan is taken.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanPlace {
    /// Such as `room-07`, `door-07`, `corridor-1-03`.
    pub name: String,
    /// Place of the scanner in the building, metres.
    pub eye: [f64; 3],
}

/// A building.
#[derive(Debug, Clone)]
pub struct Building {
    solids: Solids,
    stations: Vec<ScanPlace>,
}

impl Building {
    /// `a_row` rooms in each of four rows along two corridors that meet at both ends. Rooms are of three kinds with the same walls and
    /// the same furniture each; `loose` small things stand elsewhere in every room.
    pub fn new(a_row: usize, loose: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut building = Self { solids: Solids::default(), stations: Vec::new() };
        let length = a_row as f64 * ROOM_WIDTH;
        let (first, second) = (0.0, CORRIDOR + 2.0 * ROOM_DEPTH);
        let west = -CORRIDOR;
        let (south, north) = (first - ROOM_DEPTH, second + CORRIDOR + ROOM_DEPTH);
        for z in [0.0, HEIGHT] {
            building.solids.pane(2, z, [west, south], [length + CORRIDOR, north]);
        }
        let mut number = 0;
        // Rows from south to north: outside, inside, inside, outside; each with its door towards its corridor.
        for (low, door_at) in [
            (first - ROOM_DEPTH, first),
            (first + CORRIDOR, first + CORRIDOR),
            (first + CORRIDOR + ROOM_DEPTH, second),
            (second + CORRIDOR, second + CORRIDOR),
        ] {
            let far = if door_at > low { low } else { low + ROOM_DEPTH };
            building.wall(1, far, 0.0, length);
            building.wall(0, 0.0, low, low + ROOM_DEPTH);
            for i in 0..a_row {
                let x = i as f64 * ROOM_WIDTH;
                building.wall(0, x + ROOM_WIDTH, low, low + ROOM_DEPTH);
                building.room(number, x, far, door_at, loose, &mut rng);
                number += 1;
            }
        }
        building.corridors([west, length], [first, second], a_row, &mut rng);
        building
    }

    /// The stations: one in each room, one in each door, and along the corridors.
    pub fn stations(&self) -> &[ScanPlace] {
        &self.stations
    }

    /// What a scanner at `eye` sees with `columns` by `rows` rays and this noise in range (standard deviation, metres); points in the
    /// frame of the building.
    ///
    /// # Errors
    /// [`CloudError::Empty`] where no ray meets anything.
    pub fn scan(
        &self,
        eye: [f64; 3],
        rays: [usize; 2],
        noise: f64,
        seed: u64,
    ) -> Result<PointCloud, CloudError> {
        self.solids.scan(eye, rays, noise, seed)
    }

    /// A wall across `axis` (0 or 1), from floor to ceiling.
    fn wall(&mut self, axis: usize, at: f64, from: f64, to: f64) {
        self.solids.pane(axis, at, [from, 0.0], [to, HEIGHT]);
    }

    /// A room between `x` and the next, its far wall at `far` and its door in the wall at `door_at`.
    fn room(&mut self, number: usize, x: f64, far: f64, door_at: f64, loose: usize, rng: &mut ChaCha8Rng) {
        let kind = number % 3;
        // The wall with the door.
        let left = x + [0.5, 1.8, 3.0][kind];
        self.wall(1, door_at, x, left);
        self.wall(1, door_at, left + DOOR[0], x + ROOM_WIDTH);
        self.solids.pane(1, door_at, [left, DOOR[1]], [left + DOOR[0], HEIGHT]);
        // Furniture by its distance from the far wall.
        let into = (door_at - far).signum();
        let furniture: &[[f64; 6]] = match kind {
            0 => &[
                [0.1, 0.1, 0.0, 1.9, 0.9, 0.75],
                [3.9, 0.3, 0.0, 4.45, 2.1, 2.0],
                [0.05, 3.0, 0.0, 0.5, 4.0, 1.2],
            ],
            1 => &[
                [1.2, 0.05, 0.0, 2.8, 2.05, 0.5],
                [0.05, 0.05, 0.0, 0.55, 0.6, 0.6],
                [3.8, 2.2, 0.0, 4.45, 3.7, 2.2],
            ],
            _ => &[
                [0.05, 0.4, 0.0, 0.8, 4.2, 0.9],
                [3.7, 0.05, 0.0, 4.45, 3.2, 0.9],
                [1.5, 0.05, 1.4, 3.0, 0.4, 2.2],
            ],
        };
        let put = |b: &mut Self, f: [f64; 6]| {
            b.solids.block([x + f[0], far + into * f[1], f[2]], [x + f[3], far + into * f[4], f[5]]);
        };
        furniture.iter().for_each(|f| put(self, *f));
        for _ in 0..loose {
            let size: [f64; 3] =
                [rng.random_range(0.3..0.6), rng.random_range(0.3..0.6), rng.random_range(0.4..1.1)];
            let (u, v) = (rng.random_range(0.9..3.1), rng.random_range(2.2..3.6));
            put(self, [u, v, 0.0, u + size[0], v + size[1], size[2]]);
        }
        let eye = |v: f64, u: f64| [x + u, far + into * v, EYE];
        let middle = eye(rng.random_range(2.1..3.1), rng.random_range(1.9..2.7));
        self.stations.push(ScanPlace { name: format!("room-{number:02}"), eye: middle });
        let door = eye(ROOM_DEPTH - rng.random_range(0.05..0.25), left - x + rng.random_range(0.35..0.55));
        self.stations.push(ScanPlace { name: format!("door-{number:02}"), eye: door });
    }

    fn corridors(&mut self, x: [f64; 2], y: [f64; 2], a_row: usize, rng: &mut ChaCha8Rng) {
        let [west, east] = x;
        let [first, second] = y;
        // Around the outside: ends of the cross corridors.
        self.wall(0, west, first, second + CORRIDOR);
        self.wall(0, east + CORRIDOR, first, second + CORRIDOR);
        for at in [first, second + CORRIDOR] {
            self.wall(1, at, west, 0.0);
            self.wall(1, at, east, east + CORRIDOR);
        }
        // What hangs on the walls and stands about: the same nowhere.
        for (row, base) in [first, second].into_iter().enumerate() {
            for i in 0..a_row {
                let u = i as f64 * ROOM_WIDTH + rng.random_range(0.0..ROOM_WIDTH - 0.6);
                let side = if rng.random_range(0.0..1.0) < 0.5 { 0.0 } else { CORRIDOR - 0.25 };
                let (z, tall) = (rng.random_range(0.0..1.2), rng.random_range(0.3..0.9));
                let wide = rng.random_range(0.2..0.6);
                self.solids.block([u, base + side, z], [u + wide, base + side + 0.25, z + tall]);
            }
            let steps = ((east - west + CORRIDOR) / STEP).floor() as usize;
            for i in 0..=steps {
                let along = west + 1.2 + i as f64 * STEP + rng.random_range(-0.3..0.3);
                let eye = [along.min(east + 1.2), base + 1.2 + rng.random_range(-0.3..0.3), EYE];
                self.stations.push(ScanPlace { name: format!("corridor-{row}-{i:02}"), eye });
            }
        }
        let steps = ((second - first - CORRIDOR) / STEP).floor() as usize;
        for (side, along) in [west + 1.2, east + 1.2].into_iter().enumerate() {
            for i in 0..=steps {
                let eye = [along, first + CORRIDOR + 1.0 + i as f64 * STEP, EYE];
                self.stations.push(ScanPlace { name: format!("cross-{side}-{i:02}"), eye });
            }
        }
    }
}

/// Distance between a point and the eye of a station.
pub fn range_of(point: &[f64; 3], eye: &[f64; 3]) -> f64 {
    (Vector3::from(*point) - Vector3::from(*eye)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scans_see_the_walls_around_them_and_rooms_see_out_of_the_door() {
        let building = Building::new(3, 2, 5);
        let rooms: Vec<&ScanPlace> =
            building.stations().iter().filter(|s| s.name.starts_with("room")).collect();
        assert_eq!(rooms.len(), 12);
        for station in building.stations() {
            let scan = building.scan(station.eye, [60, 30], 0.0, 1).unwrap();
            // Nothing is open to the sky.
            assert!(scan.len() >= 1700, "{}: {}", station.name, scan.len());
            assert!(scan.points().iter().all(|p| p[2] > -1e-9 && p[2] < HEIGHT + 1e-9), "{}", station.name);
        }
        // Some rays of a room leave it by the door.
        let scan = building.scan(rooms[0].eye, [200, 80], 0.0, 1).unwrap();
        let outside = scan.points().iter().filter(|p| p[1] > 0.01).count();
        assert!(outside > 30 && outside < scan.len() / 4, "{outside} of {}", scan.len());
    }

    #[test]
    fn the_same_seed_gives_the_same_scan_and_noise_is_of_its_size() {
        let building = Building::new(2, 1, 8);
        let eye = building.stations()[0].eye;
        let scan = |noise, seed| building.scan(eye, [80, 40], noise, seed).unwrap();
        assert_eq!(scan(0.01, 4), scan(0.01, 4));
        let (clean, noisy) = (scan(0.0, 4), scan(0.01, 4));
        let squares: f64 = clean
            .points()
            .iter()
            .zip(noisy.points())
            .map(|(a, b)| (range_of(a, &eye) - range_of(b, &eye)).powi(2))
            .sum();
        let deviation = (squares / clean.len() as f64).sqrt();
        assert!((deviation - 0.01).abs() < 1e-3, "{deviation}");
    }
}
