//! Poses: seeded draws, and DCP's test set.

use std::f64::consts::FRAC_PI_4;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use rand_mt::Mt;
use srrf_cloud::{EulerXyz, Rigid};

use super::config::RotationRange;

/// Where the pose of a pair comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PoseDraw {
    /// Drawn from the ranges of the config by the pair's own stream.
    Seeded,
    /// The pose of this item of DCP's test set ([`dcp_test_pose`]), whatever the config's ranges.
    DcpTest(u32),
    /// This pose, `target_from_source`.
    Given(Rigid),
}

/// Draws a pose: a rotation from `rotation`, then a translation uniform in
/// `[-translation, translation)` on each coordinate.
pub(super) fn draw<R: Rng>(rotation: RotationRange, translation: f64, rng: &mut R) -> Rigid {
    let rotation = match rotation {
        RotationRange::EulerAxes { max_deg } => {
            EulerXyz::from_deg(std::array::from_fn(|_| rng.random::<f64>() * max_deg)).to_matrix()
        }
        RotationRange::So3 => {
            // A normalised 4-d normal vector is uniform on the unit quaternions.
            let q: [f64; 4] = std::array::from_fn(|_| rng.sample(StandardNormal));
            UnitQuaternion::from_quaternion(Quaternion::from(q)).to_rotation_matrix().into_inner()
        }
    };
    let translation = Vector3::from_fn(|_, _| (2.0 * rng.random::<f64>() - 1.0) * translation);
    Rigid { rotation, translation }
}

/// The pose of item `item` in DCP's test set (Wang and Solomon 2019): numpy's legacy generator
/// seeded with the item's index draws three angles in `[0, 45)` degrees, `R = Rx(a) Ry(b) Rz(c)`,
/// and a translation in `[-0.5, 0.5)^3`.
///
/// Numpy seeds MT19937 by `init_genrand` and makes doubles of 53 bits from two outputs each;
/// `rand_mt` seeds in the same way.
pub fn dcp_test_pose(item: u32) -> Rigid {
    let mut mt = Mt::new(item);
    let mut double = || {
        let high = f64::from(mt.next_u32() >> 5);
        let low = f64::from(mt.next_u32() >> 6);
        (high * 67_108_864.0 + low) / 9_007_199_254_740_992.0 // 2^26 and 2^53
    };
    let angles_rad = std::array::from_fn(|_| double() * FRAC_PI_4);
    let translation = Vector3::from_fn(|_, _| double() - 0.5);
    Rigid { rotation: EulerXyz { angles_rad }.to_matrix(), translation }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{SeedableRng, rngs::ChaCha8Rng};

    #[test]
    fn dcp_poses_are_those_of_numpy() {
        let expected = [
            (0, [24.69661, 32.18352, 27.12435], [0.044883, -0.076345, 0.145894]),
            (2467, [3.97485, 32.91403, 29.25915], [0.145092, 0.082214, -0.410070]),
        ];
        for (item, angles, translation) in expected {
            let pose = dcp_test_pose(item);
            let found = EulerXyz::from_matrix(&pose.rotation).to_deg();
            // The values are printed to so many digits.
            assert!((0..3).all(|c| (found[c] - angles[c]).abs() < 5.1e-6), "{found:?}");
            assert!((0..3).all(|c| (pose.translation[c] - translation[c]).abs() < 5.1e-7));
        }
    }

    #[test]
    fn draws_fill_their_ranges() {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let mut largest = 0.0f64;
        for _ in 0..1000 {
            let pose = draw(RotationRange::EulerAxes { max_deg: 30.0 }, 0.2, &mut rng);
            let angles = EulerXyz::from_matrix(&pose.rotation).to_deg();
            assert!(angles.iter().all(|a| (-1e-9..30.0).contains(a)));
            assert!(pose.translation.amax() <= 0.2);
            largest = largest.max(angles[1]);
        }
        assert!(largest > 29.5, "{largest}");
        // Uniform on SO(3): the mean trace is 0 (that of the identity is 3), its variance 1.
        let mean =
            (0..4000).map(|_| draw(RotationRange::So3, 0.0, &mut rng).rotation.trace()).sum::<f64>() / 4000.0;
        assert!(mean.abs() < 0.06, "{mean}");
    }
}
