use nalgebra::Vector6;

use super::*;
use crate::se3::exp;

const HEIGHT: f64 = 3.0;
/// Corners of a room like an L; all of it is seen from the square where its arms meet.
const CORNERS: [[f64; 2]; 6] = [[0.0, 0.0], [6.0, 0.0], [6.0, 3.0], [2.5, 3.0], [2.5, 7.0], [0.0, 7.0]];

/// Points and normals of that room from a place in the square, moved.
fn scanned(eye: [f64; 3], moved: &Rigid) -> (Vec<[f64; 3]>, Vec<Vector3<f64>>, Vector3<f64>) {
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    let eye = Vector3::from(eye);
    for around in 0..120 {
        for up in 0..50 {
            // From 60 degrees below the horizon to 80 above.
            let up = (-60.0 + 2.8 * f64::from(up)).to_radians();
            let turn = (3.0 * f64::from(around) + 0.7).to_radians();
            let ray = Vector3::new(up.cos() * turn.cos(), up.cos() * turn.sin(), up.sin());
            let level = if ray.z > 0.0 { HEIGHT } else { 0.0 };
            let mut nearest = ((level - eye.z) / ray.z, Vector3::new(0.0, 0.0, -ray.z.signum()));
            for (a, b) in CORNERS.iter().zip(CORNERS.iter().cycle().skip(1)) {
                // Into the room from a wall that has it on its left.
                let (along, inward) = (
                    Vector3::new(b[0] - a[0], b[1] - a[1], 0.0),
                    Vector3::new(a[1] - b[1], b[0] - a[0], 0.0),
                );
                let inward = inward.normalize();
                let from = Vector3::new(a[0], a[1], eye.z);
                let range = (from - eye).dot(&inward) / ray.dot(&inward);
                let share = (eye + range * ray - from).dot(&along) / along.norm_squared();
                if range > 0.0 && range < nearest.0 && (0.0..=1.0).contains(&share) {
                    nearest = (range, inward);
                }
            }
            points.push(moved.apply(&(eye + nearest.0 * ray).into()));
            normals.push(moved.rotation * nearest.1);
        }
    }
    (points, normals, Vector3::from(moved.apply(&eye.into())))
}

fn laid_out(eye: [f64; 3], moved: &Rigid) -> (WallLayout, SightMap) {
    let (points, normals, eye) = scanned(eye, moved);
    let layout = WallLayout::new(points.iter().zip(&normals), &eye, 0.06);
    (layout, SightMap::new(&points, eye).unwrap())
}

#[test]
fn walls_say_how_two_scans_of_a_room_lie() {
    let one = exp(&Vector6::new(0.9, -1.4, 2.0, 3.0, -8.0, 1.0));
    let other = exp(&Vector6::new(-2.1, 0.3, 0.8, -4.0, 2.0, 6.0));
    let (from, by_from) = laid_out([1.3, 1.4, 1.5], &one);
    let (to, by_to) = laid_out([1.9, 2.2, 1.6], &other);
    assert!(from.is_walled() && to.is_walled());
    let right = other.compose(&one.inverse());
    let poses = from.poses(&to, [&by_from, &by_to], 0.06);
    let off = |pose: &Rigid| {
        // How far the middle of the room moves.
        let middle = one.apply(&[2.0, 2.0, 1.5]);
        (Vector3::from(pose.apply(&middle)) - Vector3::from(right.apply(&middle))).norm()
    };
    let first = &poses[0];
    assert!(
        first.angle_to_deg(&right) < 0.5 && off(first) < 0.05,
        "{} {}",
        first.angle_to_deg(&right),
        off(first)
    );
    assert!(poses.len() <= MOST_POSES);
    // No pose is upside down.
    let upright =
        |pose: &Rigid| (pose.rotation * one.rotation.column(2)).dot(&other.rotation.column(2)) > 0.9;
    assert!(poses.iter().all(upright));
    assert!(from.stands(&to, &right));
    let over = exp(&Vector6::new(std::f64::consts::PI, 0.0, 0.0, 0.0, 0.0, 0.0));
    assert!(!from.stands(&to, &other.compose(&over).compose(&one.inverse())));
}

#[test]
fn a_ball_and_a_floor_are_no_walls() {
    let ball: Vec<Vector3<f64>> = (0..3000)
        .map(|i| {
            let (z, turn) = (f64::from(2 * i + 1) / 3000.0 - 1.0, 2.4 * f64::from(i));
            Vector3::new((1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z)
        })
        .collect();
    let points: Vec<[f64; 3]> = ball.iter().map(|p| (2.0 * p).into()).collect();
    let inward: Vec<Vector3<f64>> = ball.iter().map(|p| -p).collect();
    assert!(!WallLayout::new(points.iter().zip(&inward), &Vector3::zeros(), 0.05).is_walled());
    let floor: Vec<[f64; 3]> =
        (0..2500).map(|i| [0.1 * f64::from(i % 50), 0.1 * f64::from(i / 50), 0.0]).collect();
    let up = vec![Vector3::z(); floor.len()];
    assert!(!WallLayout::new(floor.iter().zip(&up), &Vector3::new(2.0, 2.0, 1.5), 0.05).is_walled());
}

#[test]
fn walls_are_windows_with_most_points() {
    let offsets: Vec<f64> = (0..60)
        .map(|i| 1.0 + 1e-3 * f64::from(i % 5))
        .chain((0..30).map(|i| 2.5 + 1e-3 * f64::from(i % 3)))
        .chain((0..9).map(|i| 0.1 * f64::from(i) - 3.0))
        .collect();
    let found = levels(offsets, 0.05, 100);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!((found[0].0 - 1.002).abs() < 1e-9 && (found[0].1 - 0.6f64.sqrt()).abs() < 1e-9);
    assert!((found[1].0 - 2.501).abs() < 1e-9 && (found[1].1 - 0.3f64.sqrt()).abs() < 1e-9);
}

#[test]
fn shifts_that_lay_more_walls_come_first() {
    let votes = [(1.0, 0.3), (1.02, 0.3), (4.0, 0.5), (-2.0, 0.1)];
    let found = peaks(&votes, 0.05);
    assert_eq!(found.len(), 3);
    assert!((found[0] - 1.01).abs() < 1e-12 && found[1] == 4.0 && found[2] == -2.0, "{found:?}");
}
