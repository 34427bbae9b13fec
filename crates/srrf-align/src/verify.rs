//! A quick look at whether two scans lie on each other.

use srrf_cloud::Rigid;

use crate::se3::{exp, tidied};
use crate::surface::{ScanSurface, row};

const STEPS: usize = 6;
const ASKED: usize = 300;
/// The last steps, and the points that they ask: for a pose that is exact.
const LAST_STEPS: usize = 5;
const LAST_ASKED: usize = 1500;
/// Points of each scan that are asked whether they were seen through.
const SIGHT_ASKED: usize = 2000;
/// A match counts a quarter from this multiple of the median distance on.
const FAR_OFF: f64 = 3.0;
/// Of what is there, scanners see through less than this.
const SEEN_THROUGH: f64 = 0.005;

/// How two scans lie on each other after a few steps of point to plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Laid {
    /// The pose between the centred scans.
    pub target_from_source: Rigid,
    /// From 0 to 1: the square root of the overlap, less where a scanner saw through what should be there.
    pub value: f64,
    /// The larger share of points that lie on the other scan.
    pub overlap: f64,
}

/// Lays `source` on `target` near a rough pose between the centred scans. None where the points do not say how.
pub fn laid(source: &ScanSurface, target: &ScanSurface, target_from_source: &Rigid) -> Option<Laid> {
    let mut pose = *target_from_source;
    for step in 0..STEPS {
        // The gate closes from three times to once the usual distance.
        let gate = 3.0 - 2.0 * step as f64 / (STEPS - 1) as f64;
        pose = stepped(source, target, &pose, gate, ASKED)?;
    }
    Some(valued(source, target, pose))
}

/// The same, exactly.
pub fn settled(source: &ScanSurface, target: &ScanSurface, rough: &Laid) -> Laid {
    let mut pose = rough.target_from_source;
    for _ in 0..LAST_STEPS {
        let Some(next) = stepped(source, target, &pose, 1.0, LAST_ASKED) else { return *rough };
        pose = next;
    }
    valued(source, target, pose)
}

/// A step of point to plane between points that are within `gate` times the usual distance.
fn stepped(
    source: &ScanSurface,
    target: &ScanSurface,
    pose: &Rigid,
    gate: f64,
    asked: usize,
) -> Option<Rigid> {
    let (matches, _) = target.matches(source, pose, gate * target.near(source), asked);
    let mut hessian = nalgebra::Matrix6::identity() * 1e-9;
    let mut gradient = nalgebra::Vector6::zeros();
    // What lies far off for these scans is of another surface, or at an edge.
    let mut off: Vec<f64> = matches.iter().map(|m| m.off.abs()).collect();
    off.sort_by(f64::total_cmp);
    let usual = FAR_OFF * off.get(off.len() / 2).copied()?.max(f64::MIN_POSITIVE.sqrt());
    for m in &matches {
        let j = row(&m.moved, &m.normal);
        let weight = (1.0 + (m.off / usual).powi(2)).powi(-2);
        hessian += weight * j * j.transpose();
        gradient -= weight * m.off * j;
    }
    hessian += nalgebra::Matrix6::identity() * (1e-4 * hessian.trace() / 6.0);
    let twist = hessian.cholesky()?.solve(&gradient);
    twist.iter().all(|v| v.is_finite()).then(|| tidied(&exp(&twist).compose(pose)))
}

fn valued(source: &ScanSurface, target: &ScanSurface, pose: Rigid) -> Laid {
    let overlap = target.overlap(source, &pose, ASKED);
    let seen_through = target.seen_through(source, &pose, SIGHT_ASKED).unwrap_or(0.0);
    let value = overlap.sqrt() / (1.0 + (seen_through / SEEN_THROUGH).powi(2));
    Laid { target_from_source: pose, value, overlap }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector6;
    use rand::SeedableRng;
    use rand::rngs::ChaCha8Rng;
    use srrf_corrupt::datasets::ShapeSource;
    use srrf_corrupt::shapes::ProceduralShapes;

    use super::*;

    #[test]
    fn a_rough_pose_is_good_enough_and_a_wrong_one_is_not() {
        let shapes = ProceduralShapes::new(5, 4, None).unwrap();
        let surface = |seed| {
            let cloud = shapes.sample(1, 3000, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
            ScanSurface::new(&cloud, 1500, None).unwrap()
        };
        let (a, b) = (surface(1), surface(2));
        let near = exp(&Vector6::new(0.04, -0.03, 0.05, 0.02, 0.0, -0.03));
        let far = exp(&Vector6::new(0.9, 0.5, -0.7, 0.4, 0.2, 0.0));
        let (good, bad) = (laid(&a, &b, &near).unwrap().value, laid(&a, &b, &far).unwrap().value);
        assert!(good > 0.9 && bad < 0.8 * good, "{good} {bad}");
    }
}
