//! A furnished building: rooms that look alike on both sides of two corridors, and what a scanner sees in it.
//!
//! Rooms are of three kinds, in an order drawn by the seed. Those of a kind have the same walls, door and furniture: by themselves only
//! a few loose things tell them apart. Corridors are furnished as corridors are, and no two stretches or corners of them are alike.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use srrf_corrupt::solids::{Solids, along};

/// Metres.
const ROOM_WIDTH: f64 = 4.5;
const ROOM_DEPTH: f64 = 5.0;
const HEIGHT: f64 = 3.0;
const CORRIDOR: f64 = 2.4;
/// Width and height.
const DOOR: [f64; 2] = [0.9, 2.1];
const WALL: f64 = 0.12;
/// Most between stations in a corridor.
const STEP: f64 = 4.0;
const EYE: f64 = 1.5;
/// Walls of corridors have a place for a thing every so far, and so many of those are taken.
const PLACE: f64 = 1.1;
const TAKEN: f64 = 0.65;
/// Loose things stand so far from the scanner's stand.
const CLEAR: f64 = 0.4;

/// Where a scan is taken.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanPlace {
    /// Such as `room-07`, `door-07`, `corridor-1-03`, `cross-0-02`.
    pub name: String,
    /// Place of the scanner in the building, metres.
    pub eye: [f64; 3],
}

/// A building.
#[derive(Debug, Clone)]
pub struct Building {
    pub solids: Solids,
    /// One in each room, one in each door, one at each crossing of corridors, and along those.
    pub stations: Vec<ScanPlace>,
}

/// A wall of a corridor: across an axis at a place, the side on which the corridor is, and its extent along the other axis.
struct Side {
    axis: usize,
    at: f64,
    into: f64,
    from: f64,
    to: f64,
}

impl Building {
    /// `a_row` rooms in each of four rows along two corridors that meet at both ends; `loose` small things stand in every room.
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
        let mut doors = Vec::new();
        // Rows from south to north: outside, inside, inside, outside; each with its door towards its corridor.
        for (row, (low, door_at)) in [
            (first - ROOM_DEPTH, first),
            (first + CORRIDOR, first + CORRIDOR),
            (first + CORRIDOR + ROOM_DEPTH, second),
            (second + CORRIDOR, second + CORRIDOR),
        ]
        .into_iter()
        .enumerate()
        {
            let far = if door_at > low { low } else { low + ROOM_DEPTH };
            building.wall(1, far, 0.0, length);
            for i in 0..=a_row {
                building.wall(0, i as f64 * ROOM_WIDTH, low, low + ROOM_DEPTH);
            }
            for i in 0..a_row {
                let left =
                    building.room(row * a_row + i, i as f64 * ROOM_WIDTH, far, door_at, loose, &mut rng);
                doors.push((door_at, left));
            }
        }
        building.corridors([west, length], [first, second], &doors, &mut rng);
        building
    }

    /// A wall across `axis` (0 or 1), from floor to ceiling.
    fn wall(&mut self, axis: usize, at: f64, from: f64, to: f64) {
        self.part_of_wall(axis, at, [from, to], [0.0, HEIGHT]);
    }

    fn part_of_wall(&mut self, axis: usize, at: f64, reach: [f64; 2], z: [f64; 2]) {
        let low = along(axis, at - 0.5 * WALL, reach[0], z[0]);
        self.solids.block(low, along(axis, at + 0.5 * WALL, reach[1], z[1]));
    }

    /// A room between `x` and the next, its far wall at `far` and its door in the wall at `door_at`; where the door begins.
    fn room(
        &mut self,
        number: usize,
        x: f64,
        far: f64,
        door_at: f64,
        loose: usize,
        rng: &mut ChaCha8Rng,
    ) -> f64 {
        let kind = rng.random_range(0..3usize);
        let left = x + [0.5, 1.8, 3.0][kind];
        self.wall(1, door_at, x, left);
        self.wall(1, door_at, left + DOOR[0], x + ROOM_WIDTH);
        self.part_of_wall(1, door_at, [left, left + DOOR[0]], [DOOR[1], HEIGHT]);
        let into = (door_at - far).signum();
        // By the distance from the western wall and from the far one.
        let at = |u: f64, v: f64, z: f64| [x + u, far + into * v, z];
        let furniture: &[[f64; 6]] = match kind {
            0 => &[
                [0.1, 0.1, 0.0, 1.9, 0.9, 0.75],
                [3.9, 0.3, 0.0, 4.42, 2.1, 2.0],
                [0.08, 3.0, 0.0, 0.5, 4.0, 1.2],
            ],
            1 => &[
                [1.2, 0.08, 0.0, 2.8, 2.05, 0.5],
                [0.08, 0.08, 0.0, 0.55, 0.6, 0.6],
                [3.8, 2.2, 0.0, 4.42, 3.7, 2.2],
            ],
            _ => &[
                [0.08, 0.4, 0.0, 0.8, 4.2, 0.9],
                [3.7, 0.08, 0.0, 4.42, 3.2, 0.9],
                [1.5, 0.08, 1.4, 3.0, 0.4, 2.2],
            ],
        };
        furniture.iter().for_each(|f| self.solids.block(at(f[0], f[1], f[2]), at(f[3], f[4], f[5])));
        let (u, v) = (rng.random_range(1.9..2.7), rng.random_range(2.1..3.1));
        let mut left_over = loose;
        while left_over > 0 {
            let size: [f64; 3] =
                [rng.random_range(0.3..0.6), rng.random_range(0.3..0.6), rng.random_range(0.4..1.1)];
            let (a, b) = (rng.random_range(0.9..3.1), rng.random_range(2.2..4.0));
            let apart = |low: f64, long: f64, eye: f64| (low - eye).max(eye - low - long) > CLEAR;
            if apart(a, size[0], u) || apart(b, size[1], v) {
                self.solids.block(at(a, b, 0.0), at(a + size[0], b + size[1], size[2]));
                left_over -= 1;
            }
        }
        self.stations.push(ScanPlace { name: format!("room-{number:02}"), eye: at(u, v, EYE) });
        // In the opening.
        let door = [left + rng.random_range(0.35..0.55), door_at + rng.random_range(-0.05..0.05), EYE];
        self.stations.push(ScanPlace { name: format!("door-{number:02}"), eye: door });
        left
    }

    fn corridors(
        &mut self,
        [west, east]: [f64; 2],
        rows: [f64; 2],
        doors: &[(f64, f64)],
        rng: &mut ChaCha8Rng,
    ) {
        let [first, second] = rows;
        let end = second + CORRIDOR;
        // Around the ends, where no room is.
        self.wall(0, west, first, end);
        self.wall(0, east + CORRIDOR, first, end);
        for at in [first, end] {
            self.wall(1, at, west, 0.0);
            self.wall(1, at, east, east + CORRIDOR);
        }
        for base in rows {
            let inner = if base == first { base + CORRIDOR } else { base };
            let outer = if base == first { base } else { base + CORRIDOR };
            let side = |at: f64, from: f64, to: f64| Side {
                axis: 1,
                at,
                into: (base + 1.2 - at).signum(),
                from,
                to,
            };
            self.furnish(&side(outer, west, east + CORRIDOR), doors, rng);
            self.furnish(&side(inner, 0.0, east), doors, rng);
        }
        for (low, inside) in [(west, 0.0), (east, east)] {
            let outside = if low == west { low } else { low + CORRIDOR };
            let side =
                |at: f64, from: f64, to: f64| Side { axis: 0, at, into: (low + 1.2 - at).signum(), from, to };
            self.furnish(&side(outside, first, end), &[], rng);
            self.furnish(&side(inside, first + CORRIDOR, second), &[], rng);
        }
        // From crossing to crossing.
        let middle = 0.5 * CORRIDOR;
        for (row, base) in rows.into_iter().enumerate() {
            let long = east - west;
            let steps = (long / STEP).ceil() as usize;
            for i in 0..=steps {
                let x = west + middle + long * i as f64 / steps as f64;
                let eye = [x + rng.random_range(-0.3..0.3), base + middle + rng.random_range(-0.3..0.3), EYE];
                self.stations.push(ScanPlace { name: format!("corridor-{row}-{i:02}"), eye });
            }
        }
        for (side, x) in [west + middle, east + middle].into_iter().enumerate() {
            let long = second - first;
            let steps = (long / STEP).ceil() as usize;
            for i in 1..steps {
                let y = first + middle + long * i as f64 / steps as f64;
                let eye = [x + rng.random_range(-0.3..0.3), y + rng.random_range(-0.3..0.3), EYE];
                self.stations.push(ScanPlace { name: format!("cross-{side}-{:02}", i - 1), eye });
            }
        }
    }

    /// What stands along a wall and hangs on it: cabinets, radiators, boxes, signs, pipes, ducts; nothing before a door.
    fn furnish(&mut self, side: &Side, doors: &[(f64, f64)], rng: &mut ChaCha8Rng) {
        let face = side.at + side.into * 0.5 * WALL;
        let mut begin = side.from + 0.2;
        while begin < side.to - 0.2 {
            let kind = rng.random_range(0..6usize);
            // How wide, how deep, from where to where in height.
            let [wide, deep, low, high] = match kind {
                0 => {
                    [rng.random_range(0.5..1.1), rng.random_range(0.3..0.45), 0.0, rng.random_range(0.9..2.0)]
                }
                1 => [
                    rng.random_range(0.6..1.2),
                    rng.random_range(0.1..0.16),
                    0.12,
                    rng.random_range(0.6..0.9),
                ],
                2 => {
                    [rng.random_range(0.3..0.6), rng.random_range(0.3..0.5), 0.0, rng.random_range(0.3..0.7)]
                }
                3 => {
                    [0.06, rng.random_range(0.3..0.5), rng.random_range(2.1..2.3), rng.random_range(2.4..2.7)]
                }
                4 => [rng.random_range(0.1..0.2), rng.random_range(0.1..0.2), 0.0, HEIGHT],
                _ => [
                    rng.random_range(0.8..2.0),
                    rng.random_range(0.25..0.6),
                    rng.random_range(2.6..2.8),
                    HEIGHT,
                ],
            };
            let (from, to) = (begin + rng.random_range(0.0..0.4), side.to.min(begin + 0.4 + wide));
            let to = to.min(from + wide);
            let before_door = doors.iter().any(|(at, left)| {
                *at == side.at && low < DOOR[1] && from < left + DOOR[0] + 0.1 && to > left - 0.1
            });
            if rng.random_range(0.0..1.0) < TAKEN && !before_door && to > from {
                let far = face + side.into * deep;
                self.solids.block(along(side.axis, face, from, low), along(side.axis, far, to, high));
            }
            begin += PLACE.max(to - begin);
        }
    }
}
