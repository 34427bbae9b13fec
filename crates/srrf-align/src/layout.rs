//! [`WallLayout`]: the walls of a scan by direction, and the poses in which the walls of two scans lie on each other.
//!
//! Buildings repeat: descriptors of points match a room with each of its kind, and a corridor with all. Their walls leave few poses
//! of two scans, so that all of them can be asked, each by what the scanners saw. Directions of walls give rotations; shifts along
//! three directions that lay many walls on walls give translations. Scans of which the scanner's place is not known have none.

use nalgebra::{Matrix3, Vector3};
use srrf_cloud::Rigid;

use crate::sight::{Seen, SightMap};
use crate::upright::{stands, upward};

/// Most directions of a scan, and the least share of its points that look one way.
const MOST_FACES: usize = 12;
const LEAST_FACE: f64 = 0.004;
/// Rotations are told by so many of the largest.
const TELLING: usize = 6;
/// Normals within 12 degrees are of one direction; directions within 8 degrees are the same.
const ONE_WAY: f64 = 0.978;
const SAME_WAY: f64 = 0.990;
/// Directions that are at most so parallel (cosine) tell a rotation or an axis.
const APART: f64 = 0.5;
/// Normals that are tried as directions.
const SEEDS: usize = 150;
/// Most walls of a direction, and the fewest and least share of points of one.
const MOST_LEVELS: usize = 16;
const LEAST_POINTS: usize = 10;
const LEAST_LEVEL: f64 = 0.003;
/// Most rotations of a pair, and shifts of an axis.
const MOST_ROTATIONS: usize = 24;
const MOST_SHIFTS: usize = 7;
/// Points of a scan that say how a pose looks, and those that are asked first.
const PROBES: usize = 48;
const FIRST_PROBES: usize = 12;
/// Of those of both scans, most that may be seen through.
const MOST_THROUGH: usize = 5;
/// What seeing through a point costs, where seeing it counts one.
const THROUGH: f64 = 3.0;
/// A scan is of walls where so many of its points are on them, and they stand three ways.
const WALLED: f64 = 0.6;
/// Poses that are refined.
pub const MOST_POSES: usize = 8;

/// A direction in which a scan has walls.
#[derive(Debug, Clone)]
struct Face {
    /// The normal, towards the scanner.
    toward: Vector3<f64>,
    share: f64,
    /// Walls: distance along the normal, and the square root of the share of the points.
    levels: Vec<(f64, f64)>,
}

/// The walls of a scan.
#[derive(Debug, Clone)]
pub struct WallLayout {
    faces: Vec<Face>,
    up: Option<Vector3<f64>>,
    probes: Vec<(Vector3<f64>, Vector3<f64>)>,
}

impl WallLayout {
    /// Of the points of a scan with their normals, which point to its scanner, and the place of that. Walls are so thick as `width`.
    pub fn new<'a>(
        points: impl Iterator<Item = (&'a [f64; 3], &'a Vector3<f64>)>,
        eye: &Vector3<f64>,
        width: f64,
    ) -> Self {
        let mut left: Vec<(Vector3<f64>, Vector3<f64>)> =
            points.map(|(p, n)| (Vector3::from(*p), *n)).collect();
        let all = left.len();
        let whole = left.clone();
        let probes = left.iter().step_by(all.div_ceil(PROBES).max(1)).copied().collect();
        let mut faces = Vec::new();
        while faces.len() < MOST_FACES {
            let Some(toward) = commonest(&left) else { break };
            let (of, rest): (Vec<_>, Vec<_>) = left.into_iter().partition(|(_, n)| n.dot(&toward) > ONE_WAY);
            let share = of.len() as f64 / all as f64;
            if share < LEAST_FACE {
                break;
            }
            let offsets = of.iter().map(|(p, _)| p.dot(&toward)).collect();
            faces.push(Face { toward, share, levels: levels(offsets, width, all) });
            left = rest;
        }
        let ways: Vec<Vector3<f64>> = faces.iter().take(TELLING).map(|f: &Face| f.toward).collect();
        Self { faces, up: upward(&whole, eye, &ways), probes }
    }

    /// Whether most of the scan is walls, floors and ceilings, and they hold it each way.
    pub fn is_walled(&self) -> bool {
        let axes = apart(self.faces.iter().filter(|f| !f.levels.is_empty()));
        axes.len() >= 3 && self.faces.iter().map(|f| f.share).sum::<f64>() >= WALLED
    }

    /// Whether a pose keeps up what is up, as far as both scans tell.
    pub fn stands(&self, other: &Self, other_from_self: &Rigid) -> bool {
        stands(self.up, other.up, &other_from_self.rotation)
    }

    /// Poses `other_from_self` in which walls lie on walls and the scanners saw little through, the best first.
    /// `sights` are those of this scan and the other.
    pub fn poses(&self, other: &Self, sights: [&SightMap; 2], margin: f64) -> Vec<Rigid> {
        let mut found: Vec<(f64, Rigid)> = Vec::new();
        for rotation in self.rotations(other) {
            let Some(shifts) = self.shifts(other, &rotation, margin) else { continue };
            for translation in shifts {
                let pose = Rigid { rotation, translation };
                if let Some(score) = self.glance(other, &pose, sights, 2.0 * margin) {
                    found.push((score, pose));
                }
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut kept: Vec<Rigid> = Vec::new();
        for (_, pose) in found {
            let apart = |k: &Rigid| {
                (k.translation - pose.translation).norm() > 3.0 * margin || k.angle_to_deg(&pose) > 20.0
            };
            if kept.iter().all(apart) {
                kept.push(pose);
            }
            if kept.len() == MOST_POSES {
                break;
            }
        }
        kept
    }

    /// Rotations that lay directions on directions, by the share of points that they lay.
    fn rotations(&self, other: &Self) -> Vec<Matrix3<f64>> {
        let mut found: Vec<(f64, Matrix3<f64>)> = Vec::new();
        let frame = |a: &Vector3<f64>, b: &Vector3<f64>| {
            let across = a.cross(b).normalize();
            Matrix3::from_columns(&[*a, across, a.cross(&across)])
        };
        let pairs = |faces: &[Face]| -> Vec<(Vector3<f64>, Vector3<f64>)> {
            let ways: Vec<Vector3<f64>> = faces.iter().take(TELLING).map(|f| f.toward).collect();
            ways.iter()
                .flat_map(|a| ways.iter().map(|b| (*a, *b)))
                .filter(|(a, b)| a.dot(b).abs() < APART)
                .collect()
        };
        let theirs = pairs(&other.faces);
        for (a, b) in pairs(&self.faces) {
            for (c, d) in theirs.iter().filter(|(c, d)| (c.dot(d) - a.dot(&b)).abs() < 0.1) {
                let rough = frame(c, d) * frame(&a, &b).transpose();
                let known = |r: &Matrix3<f64>| cosine_between(r, &rough) > SAME_WAY;
                if !stands(self.up, other.up, &rough) || found.iter().any(|(_, r)| known(r)) {
                    continue;
                }
                let (mut sum, mut share) = (Matrix3::zeros(), 0.0);
                for (mine, their) in self.laid(other, &rough) {
                    let weight = mine.share.min(their.share);
                    sum += weight * their.toward * mine.toward.transpose();
                    share += weight;
                }
                if let Some(rotation) = Rigid::nearest_rotation(&sum) {
                    found.push((share, rotation));
                }
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.truncate(MOST_ROTATIONS);
        found.into_iter().map(|(_, r)| r).collect()
    }

    /// Directions of this scan that come to lie on those of the other.
    fn laid<'a>(
        &'a self,
        other: &'a Self,
        rotation: &'a Matrix3<f64>,
    ) -> impl Iterator<Item = (&'a Face, &'a Face)> {
        self.faces.iter().flat_map(move |mine| {
            let turned = rotation * mine.toward;
            other.faces.iter().filter(move |f| f.toward.dot(&turned) > ONE_WAY).map(move |f| (mine, f))
        })
    }

    /// Translations by the shifts along three directions that lay most walls on walls; none where a direction has no walls in common.
    fn shifts(&self, other: &Self, rotation: &Matrix3<f64>, width: f64) -> Option<Vec<Vector3<f64>>> {
        let axes = apart(self.laid(other, rotation).map(|(_, face)| face));
        let [first, second, third] = axes[..] else { return None };
        let back = Matrix3::from_rows(&[first.transpose(), second.transpose(), third.transpose()]);
        let back = back.try_inverse()?;
        let mut along: Vec<Vec<f64>> = Vec::new();
        for axis in [first, second, third] {
            let mut votes: Vec<(f64, f64)> = Vec::new();
            for (mine, their) in self.laid(other, rotation) {
                let same = their.toward.dot(&axis);
                if same.abs() > ONE_WAY {
                    for (a, wide) in &mine.levels {
                        votes.extend(
                            their.levels.iter().map(|(b, w)| ((b - a) * same.signum(), w.min(*wide))),
                        );
                    }
                }
            }
            along.push(peaks(&votes, width));
        }
        let mut all = Vec::new();
        for x in &along[0] {
            for y in &along[1] {
                all.extend(along[2].iter().map(|z| back * Vector3::new(*x, *y, *z)));
            }
        }
        Some(all)
    }

    /// How a pose looks by few points; none where too much is seen through.
    fn glance(&self, other: &Self, pose: &Rigid, by: [&SightMap; 2], margin: f64) -> Option<f64> {
        let back = pose.inverse();
        let (mut there, mut through) = (0usize, 0usize);
        let most = self.probes.len().max(other.probes.len());
        let sides = [(&self.probes, by[1], pose), (&other.probes, by[0], &back)];
        // In two goes, each spread over the scan.
        let stride = (most / FIRST_PROBES).max(1);
        for first in [true, false] {
            for (probes, sight, motion) in sides {
                for (i, (point, normal)) in probes.iter().enumerate() {
                    if (i % stride == 0) == first {
                        let moved = motion.rotation * point + motion.translation;
                        match sight.glance(&moved, &(motion.rotation * normal), margin) {
                            Seen::There => there += 1,
                            Seen::Through => through += 1,
                            Seen::Unknown | Seen::Hidden => {}
                        }
                    }
                }
            }
            if through > MOST_THROUGH * (if first { 1 } else { 2 }) {
                return None;
            }
        }
        (there > 0).then_some(there as f64 - THROUGH * through as f64)
    }
}

/// Directions that are apart, the first of those that are not.
fn apart<'a>(faces: impl Iterator<Item = &'a Face>) -> Vec<Vector3<f64>> {
    let mut axes: Vec<Vector3<f64>> = Vec::new();
    for face in faces {
        if axes.iter().all(|a| a.dot(&face.toward).abs() < APART) {
            axes.push(face.toward);
        }
    }
    axes
}

/// Cosine of the angle between two rotations.
fn cosine_between(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    ((a.transpose() * b).trace() - 1.0) / 2.0
}

/// The direction of most normals; none where there are none.
fn commonest(left: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Vector3<f64>> {
    let step = left.len().div_ceil(SEEDS).max(1);
    let near = |way: &Vector3<f64>| left.iter().filter(|(_, n)| n.dot(way) > ONE_WAY).count();
    let (mut way, _) = left.iter().step_by(step).map(|(_, n)| (*n, near(n))).max_by(|a, b| a.1.cmp(&b.1))?;
    for _ in 0..3 {
        let sum: Vector3<f64> = left.iter().map(|(_, n)| n).filter(|n| n.dot(&way) > ONE_WAY).sum();
        way = sum.try_normalize(1e-9)?;
    }
    Some(way)
}

/// Walls across one direction: windows of a width with most offsets.
fn levels(mut offsets: Vec<f64>, width: f64, all: usize) -> Vec<(f64, f64)> {
    offsets.sort_by(f64::total_cmp);
    let least = LEAST_POINTS.max((LEAST_LEVEL * all as f64) as usize);
    let mut found = Vec::new();
    while found.len() < MOST_LEVELS {
        let (mut best, mut end) = ((0, 0), 0);
        for begin in 0..offsets.len() {
            while end < offsets.len() && offsets[end] - offsets[begin] <= width {
                end += 1;
            }
            if end - begin > best.1 - best.0 {
                best = (begin, end);
            }
        }
        let count = best.1 - best.0;
        if count < least {
            break;
        }
        let middle = offsets[best.0..best.1].iter().sum::<f64>() / count as f64;
        found.push((middle, (count as f64 / all as f64).sqrt()));
        offsets.retain(|o| (o - middle).abs() > width);
    }
    found
}

/// The values with most weight around them, the best first.
fn peaks(votes: &[(f64, f64)], width: f64) -> Vec<f64> {
    let mut weighed: Vec<(f64, f64)> = votes
        .iter()
        .map(|(at, _)| {
            let (mut sum, mut weight) = (0.0, 0.0);
            for (x, w) in votes.iter().filter(|(x, _)| (x - at).abs() <= width) {
                sum += w * x;
                weight += w;
            }
            (weight, sum / weight)
        })
        .collect();
    weighed.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)));
    let mut kept: Vec<f64> = Vec::new();
    for (_, at) in weighed {
        if kept.iter().all(|k| (k - at).abs() > width) {
            kept.push(at);
        }
        if kept.len() == MOST_SHIFTS {
            break;
        }
    }
    kept
}

#[cfg(test)]
mod tests;
