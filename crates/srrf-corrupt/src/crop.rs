//! Partial overlap: the part of a cloud on one side of a plane.
//!
//! Not one of the paper's corruptions. RPMNet's partial pairs (Yew and Lee 2020, `RandomCrop`) keep
//! the 70% of each cloud that lie farthest along a random direction, independently for the two.

use nalgebra::Vector3;
use rand::RngExt;
use rand::rngs::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Indices of the `keep` share of `points` (at least one) farthest along `direction`, in the order
/// of the cloud; ties go to the earlier point.
pub fn crop(points: &[[f64; 3]], direction: &Vector3<f64>, keep: f64) -> Vec<usize> {
    let height: Vec<f64> = points.iter().map(|p| direction.dot(&Vector3::from(*p))).collect();
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| height[b].total_cmp(&height[a]));
    order.truncate(((keep.clamp(0.0, 1.0) * points.len() as f64).round() as usize).max(1));
    order.sort_unstable();
    order
}

/// A direction drawn evenly from the sphere.
pub fn random_direction(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    loop {
        let v = Vector3::from_fn(|_, _| rng.sample::<f64, _>(StandardNormal));
        if let Some(direction) = v.try_normalize(1e-6) {
            return direction;
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn keeps_the_far_side_in_order() {
        let points: Vec<[f64; 3]> = (0..11).map(|i| [f64::from((i * 7) % 11), 0.5, -1.0]).collect();
        let kept = crop(&points, &Vector3::x(), 0.37);
        assert_eq!(kept.len(), 4);
        assert!(kept.is_sorted());
        assert!(kept.iter().all(|&i| points[i][0] >= 7.0));
        assert_eq!(crop(&points, &Vector3::x(), 0.0).len(), 1);
        assert_eq!(crop(&points, &Vector3::x(), 2.0).len(), 11);
    }

    #[test]
    fn directions_are_even() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mean: Vector3<f64> = (0..4000).map(|_| random_direction(&mut rng)).sum::<Vector3<f64>>() / 4000.0;
        assert!(mean.norm() < 0.05, "{mean}");
    }
}
