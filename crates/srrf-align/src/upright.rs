//! Which way is up in a scan: a scanner on its stand does not see the floor under itself.
//!
//! Directions have no names in a file: scans may lie anywhere. A round hole around the foot of the perpendicular to a floor is the
//! blind cone of the scanner, larger than that above it. Scans of which both have one are never laid on each other upside down.

use nalgebra::Vector3;

/// Ways around the foot in which the hole's edge is asked, and the fewest that must agree.
const SECTORS: usize = 12;
const AGREEING: usize = 8;
/// They agree within this angle (degrees), or this share of the hole's.
const EDGE_DEG: f64 = 3.5;
const EDGE_SHARE: f64 = 0.12;
/// Half angles of a blind cone, degrees.
const CONE_DEG: [f64; 2] = [12.0, 65.0];
/// The next larger hole has at most this share of its angle.
const SECOND: f64 = 0.75;
/// Points that may lie in the hole.
const STRAYS: usize = 2;
/// Normals of the floor, cosine.
const FLAT: f64 = 0.978;
/// Two scans whose ups differ by more than 15 degrees are not laid on each other.
const TILT: f64 = 0.966;

/// Up, as a unit vector; none where no hole says. `normals` point to the eye, `ways` are the directions that may be up.
pub fn upward(
    points: &[(Vector3<f64>, Vector3<f64>)],
    eye: &Vector3<f64>,
    ways: &[Vector3<f64>],
) -> Option<Vector3<f64>> {
    let mut holes: Vec<(f64, Vector3<f64>)> =
        ways.iter().filter_map(|way| Some((hole(points, eye, way)?, *way))).collect();
    holes.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (angle, up) = *holes.first()?;
    let second = holes.get(1).map_or(0.0, |h| h.0);
    ((CONE_DEG[0]..=CONE_DEG[1]).contains(&angle) && second <= SECOND * angle).then_some(up)
}

/// Whether a rotation keeps what is up in both up; true where that is not known.
pub fn stands(
    up: Option<Vector3<f64>>,
    other: Option<Vector3<f64>>,
    other_from_this: &nalgebra::Matrix3<f64>,
) -> bool {
    match (up, other) {
        (Some(up), Some(other)) => (other_from_this * up).dot(&other) > TILT,
        _ => true,
    }
}

/// Half angle in degrees of the hole under the eye in what faces `up`; none where it is not round.
fn hole(points: &[(Vector3<f64>, Vector3<f64>)], eye: &Vector3<f64>, up: &Vector3<f64>) -> Option<f64> {
    let across =
        up.cross(&Vector3::x()).try_normalize(0.1).or_else(|| up.cross(&Vector3::y()).try_normalize(0.1))?;
    let aside = up.cross(&across);
    let (mut edge, mut angles) = ([f64::INFINITY; SECTORS], Vec::new());
    for (point, normal) in points {
        let ray = point - eye;
        let angle = (-ray.dot(up) / ray.norm()).clamp(-1.0, 1.0).acos().to_degrees();
        angles.push(angle);
        if normal.dot(up) > FLAT {
            let around = (ray.dot(&aside).atan2(ray.dot(&across)) / std::f64::consts::TAU).rem_euclid(1.0);
            let sector = ((around * SECTORS as f64) as usize).min(SECTORS - 1);
            edge[sector] = edge[sector].min(angle);
        }
    }
    let mut sorted = edge;
    sorted.sort_by(f64::total_cmp);
    // Things stand on the floor here and there: of most ways, the usual.
    let middle = sorted[AGREEING / 2];
    let width = EDGE_DEG.max(EDGE_SHARE * middle);
    let round = edge.iter().filter(|e| (*e - middle).abs() <= width).count() >= AGREEING;
    let empty = angles.iter().filter(|a| **a < middle - width).count() <= STRAYS;
    (round && empty).then_some(middle)
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;

    /// What a scanner 1.5 high sees of a floor and of a ceiling 3 high, from `below` degrees off the nadir on and from ten off the zenith.
    fn room(below: f64) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let mut points = Vec::new();
        for around in 0..90 {
            let turn = (4.0 * f64::from(around)).to_radians();
            for up in 0..30 {
                let foot = |from: f64| 1.5 * (from + 1.5 * f64::from(up)).to_radians().tan();
                let at = |r: f64, z: f64| Vector3::new(r * turn.cos(), r * turn.sin(), z);
                points.push((at(foot(below), 0.0), Vector3::z()));
                points.push((at(foot(10.0), 3.0), -Vector3::z()));
            }
        }
        points
    }

    #[test]
    fn the_hole_under_the_scanner_tells_what_is_up() {
        let eye = Vector3::new(0.0, 0.0, 1.5);
        let ways = [-Vector3::z(), Vector3::x(), Vector3::z()];
        assert_eq!(upward(&room(30.0), &eye, &ways), Some(Vector3::z()));
        // As large above as below: nothing tells.
        assert_eq!(upward(&room(10.0), &eye, &ways), None);
        // Things in the hole: it is none.
        let mut filled = room(30.0);
        filled.extend((0..9).map(|i| (Vector3::new(0.1 * f64::from(i), 0.0, 0.3), Vector3::y())));
        assert_eq!(upward(&filled, &eye, &ways), None);
    }

    #[test]
    fn only_known_ups_are_compared() {
        let over = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        assert!(!stands(Some(Vector3::z()), Some(Vector3::z()), &over));
        assert!(stands(Some(Vector3::z()), Some(-Vector3::z()), &over));
        assert!(stands(None, Some(Vector3::z()), &over));
    }
}
