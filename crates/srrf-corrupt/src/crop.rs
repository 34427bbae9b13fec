//! Partial overlap: the part of a cloud on one side of a plane, and the part that is seen from one side.
//!
//! Not one of the paper's corruptions. RPMNet's partial pairs (Yew and Lee 2020, `RandomCrop`) keep
//! the 70% of each cloud that lie farthest along a random direction, independently for the two.

use std::collections::BTreeMap;

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

/// Indices of the points that a camera far away in `direction` (a unit vector) sees, in the order of the cloud: in each
/// pixel, `pixel` wide, those less than `depth` behind the foremost one. Both are lengths in the units of the cloud; a pixel of
/// two to three point spacings lets nothing shine through.
pub fn visible(points: &[[f64; 3]], direction: &Vector3<f64>, pixel: f64, depth: f64) -> Vec<usize> {
    let across = direction.cross(&Vector3::from_fn(|i, _| if i == direction.iamin() { 1.0 } else { 0.0 }));
    let along = direction.cross(&across);
    let seen: Vec<([i64; 2], f64)> = points
        .iter()
        .map(|p| {
            let p = Vector3::from(*p);
            (
                [&across, &along].map(|axis| (p.dot(axis) / (axis.norm() * pixel)).floor() as i64),
                p.dot(direction),
            )
        })
        .collect();
    let mut foremost: BTreeMap<[i64; 2], f64> = BTreeMap::new();
    for (at, height) in &seen {
        foremost.entry(*at).and_modify(|h| *h = h.max(*height)).or_insert(*height);
    }
    (0..points.len()).filter(|&i| seen[i].1 > foremost[&seen[i].0] - depth).collect()
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
    fn a_camera_sees_the_near_sheet_alone() {
        // Two sheets, one above the other; the upper one has a hole.
        let sheet = |z: f64| (0..100).map(move |i| [f64::from(i % 10), f64::from(i / 10), z]);
        let points: Vec<[f64; 3]> =
            sheet(0.0).chain(sheet(3.0).filter(|p| p[0] > 2.5 || p[1] > 2.5)).collect();
        let upper = |i: usize| points[i][2] > 1.0;
        for (direction, hidden) in [(Vector3::z(), 91), (-Vector3::z(), 91)] {
            let seen = visible(&points, &direction, 0.9, 1.0);
            assert_eq!(seen.len(), points.len() - hidden, "{direction}");
            assert!(seen.is_sorted());
            let above = seen.iter().filter(|&&i| upper(i)).count();
            assert_eq!(above, if direction.z > 0.0 { 91 } else { 0 }, "{direction}");
        }
        // A depth beyond the distance of the sheets sees both.
        assert_eq!(visible(&points, &Vector3::z(), 0.9, 3.5).len(), points.len());
        assert!(visible(&[], &Vector3::z(), 1.0, 1.0).is_empty());
    }

    #[test]
    fn directions_are_even() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mean: Vector3<f64> = (0..4000).map(|_| random_direction(&mut rng)).sum::<Vector3<f64>>() / 4000.0;
        assert!(mean.norm() < 0.05, "{mean}");
    }
}
