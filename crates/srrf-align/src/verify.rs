//! A quick look at whether two scans lie on each other.

use srrf_cloud::Rigid;

use crate::se3::{exp, tidied};
use crate::surface::{ScanSurface, row};

const STEPS: usize = 6;
const ASKED: usize = 300;
/// Of what is there, scanners see through less than this.
const SEEN_THROUGH: f64 = 0.005;

/// From 0 to 1: how well `source` lies on `target` near a rough pose between the centred scans, after a few steps of point to plane. The square
/// root of the overlap, less where a scanner saw through what should be there.
pub fn verified(source: &ScanSurface, target: &ScanSurface, target_from_source: &Rigid) -> f64 {
    let mut pose = *target_from_source;
    for step in 0..STEPS {
        // The gate closes from three times to once the usual distance.
        let near = target.near(source) * (3.0 - 2.0 * step as f64 / (STEPS - 1) as f64);
        let (matches, _) = target.matches(source, &pose, near, ASKED);
        let mut hessian = nalgebra::Matrix6::identity() * 1e-9;
        let mut gradient = nalgebra::Vector6::zeros();
        for m in &matches {
            let j = row(&m.moved, &m.normal);
            hessian += j * j.transpose();
            gradient -= j * m.off;
        }
        hessian += nalgebra::Matrix6::identity() * (1e-3 * hessian.trace() / 6.0);
        let Some(twist) = hessian.cholesky().map(|factors| factors.solve(&gradient)) else { return 0.0 };
        if !twist.iter().all(|v| v.is_finite()) {
            return 0.0;
        }
        pose = tidied(&exp(&twist).compose(&pose));
    }
    let overlap = target.overlap(source, &pose, ASKED);
    let seen_through = target.seen_through(source, &pose).unwrap_or(0.0);
    overlap.sqrt() / (1.0 + (seen_through / SEEN_THROUGH).powi(2))
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
        let (good, bad) = (verified(&a, &b, &near), verified(&a, &b, &far));
        assert!(good > 0.9 && bad < 0.8 * good, "{good} {bad}");
    }
}
