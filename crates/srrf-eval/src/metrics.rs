//! The one scorer: every method, branch and file of transforms goes through [`PoseError`] and
//! [`Scores`].
//!
//! - Anisotropic errors follow DCP: the three Euler angles of `R = Rx(a) Ry(b) Rz(c)` of the pose
//!   that maps source to target, predicted minus true, in degrees, and the three components of
//!   `t - t_gt`. MSE, RMSE and MAE are all taken from that one array (all pairs, all three
//!   entries), so that `MAE <= RMSE` holds by construction; it is checked all the same.
//! - DCP subtracts the angles as they are; here the difference is wrapped into [-180, 180)
//!   degrees, so that 179 and -179 are 2 degrees apart. For true angles in [0, 45] degrees the two
//!   differ only where a prediction is off by more than 135 degrees.
//! - RPMNet takes the same figures from the inverse transform with `xyz` angles; those differ in
//!   value and are not given here.
//! - Isotropic errors: the angle of `R_gt^T R`, and `|t - t_gt|`. The alternative of RPMNet,
//!   `|T_gt^-1 T|`, is the same number, since a rotation keeps lengths.
//! - A pair is recalled when the angle is under 5 degrees and `|t - t_gt|` under 0.1. Whether a pose is
//!   *right*, which a method's own probability is about, is [`is_right`]: the same angle, and an offset that
//!   is measured at the source's centroid in parts of the target's radius.
//! - A method that fails on a pair, or answers a pose that is not finite, is scored as if it had
//!   answered the identity, is never recalled, and is counted in [`Scores::failed`].

use serde::Serialize;
use srrf_cloud::{EulerXyz, Rigid};
pub use srrf_cloud::{RIGHT_RADIUS_SHARE, RIGHT_ROTATION_DEG, is_right};

/// Recall: largest isotropic rotation error, in degrees; that of a right pose.
pub const RECALL_ROTATION_DEG: f64 = RIGHT_ROTATION_DEG;
/// Recall: largest translation error, in the unit of the clouds.
pub const RECALL_TRANSLATION: f64 = 0.1;

/// Why errors could not be summed up.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MetricError {
    /// There are no pairs.
    #[error("no pairs to score")]
    NoPairs,
    /// An error is not finite: a true pose holds NaN or infinity.
    #[error("pair {index}: the error is not finite; its true pose holds NaN or infinity")]
    NotFinite {
        /// Index of the pair.
        index: usize,
    },
    /// MAE above RMSE, which is impossible for one array of errors.
    #[error("MAE {mae} is above RMSE {rmse}: the errors were not averaged over the same entries")]
    MaeAboveRmse {
        /// Mean absolute error.
        mae: f64,
        /// Root mean square error.
        rmse: f64,
    },
}

/// Errors of one method on one pair.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PoseError {
    /// Euler angles, predicted minus true, wrapped into [-180, 180), degrees.
    pub euler_deg: [f64; 3],
    /// `t - t_gt`, per component.
    pub translation: [f64; 3],
    /// Angle of `R_gt^T R`, degrees in [0, 180].
    pub rotation_deg: f64,
    /// `|t - t_gt|`.
    pub translation_norm: f64,
    /// Modified Chamfer distance of RPMNet, squared unit of the clouds, where the clean shape is known.
    pub chamfer: Option<f64>,
    /// Whether the pose is right ([`is_right`]), where that was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub right: Option<bool>,
    /// Whether the method gave no usable pose; the identity stands in for it.
    pub failed: bool,
}

impl PoseError {
    /// Compares a prediction with the truth; both map source to target. `None` and poses that are
    /// not finite count as failed, scored as the identity.
    pub fn new(predicted: Option<&Rigid>, truth: &Rigid) -> Self {
        let usable = predicted.filter(|pose| is_finite(pose)).copied();
        let pose = usable.unwrap_or_else(Rigid::identity);
        let found = EulerXyz::from_matrix(&pose.rotation).to_deg();
        let expected = EulerXyz::from_matrix(&truth.rotation).to_deg();
        let translation = pose.translation - truth.translation;
        Self {
            euler_deg: std::array::from_fn(|i| wrap_deg(found[i] - expected[i])),
            translation: translation.into(),
            rotation_deg: pose.angle_to_deg(truth),
            translation_norm: translation.norm(),
            chamfer: None,
            right: None,
            failed: usable.is_none(),
        }
    }

    /// Whether the pose counts as found: under [`RECALL_ROTATION_DEG`] and [`RECALL_TRANSLATION`],
    /// and not failed.
    pub fn recalled(&self) -> bool {
        !self.failed && self.rotation_deg < RECALL_ROTATION_DEG && self.translation_norm < RECALL_TRANSLATION
    }
}

/// Whether all 12 numbers of a pose are finite.
pub(crate) fn is_finite(pose: &Rigid) -> bool {
    pose.rotation.iter().chain(pose.translation.iter()).all(|v| v.is_finite())
}

/// An angle difference in degrees, wrapped into [-180, 180).
fn wrap_deg(difference: f64) -> f64 {
    (difference + 180.0).rem_euclid(360.0) - 180.0
}

/// Errors of one method over many pairs, or their mean over severities.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Scores {
    /// Mean squared Euler angle error, degrees squared.
    pub mse_r: f64,
    /// Root of `mse_r`, degrees.
    pub rmse_r: f64,
    /// Mean absolute Euler angle error, degrees.
    pub mae_r: f64,
    /// Mean squared translation error per component.
    pub mse_t: f64,
    /// Root of `mse_t`.
    pub rmse_t: f64,
    /// Mean absolute translation error per component.
    pub mae_t: f64,
    /// Mean isotropic rotation error, degrees.
    pub mean_rot_deg: f64,
    /// Median isotropic rotation error, degrees.
    pub median_rot_deg: f64,
    /// Mean of `|t - t_gt|`.
    pub mean_trans: f64,
    /// Median of `|t - t_gt|`.
    pub median_trans: f64,
    /// Share of recalled pairs, in [0, 1].
    pub recall: f64,
    /// Mean modified Chamfer distance, over the pairs that have one.
    pub chamfer: Option<f64>,
    /// Share of right poses ([`is_right`]) in [0, 1], over the pairs where that was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub right: Option<f64>,
    /// Number of pairs.
    pub pairs: usize,
    /// Pairs on which the method gave no usable pose.
    pub failed: usize,
}

impl Scores {
    /// CertaintySums up the errors of one method.
    ///
    /// # Errors
    /// [`MetricError::NoPairs`] without errors, [`MetricError::NotFinite`] where a true pose was
    /// not finite, [`MetricError::MaeAboveRmse`] never, unless this function is wrong.
    pub fn from_errors(errors: &[PoseError]) -> Result<Self, MetricError> {
        if errors.is_empty() {
            return Err(MetricError::NoPairs);
        }
        if let Some(index) = errors.iter().position(|e| {
            !(e.rotation_deg + e.translation_norm).is_finite() || e.euler_deg.iter().any(|a| !a.is_finite())
        }) {
            return Err(MetricError::NotFinite { index });
        }
        let angles: Vec<f64> = errors.iter().flat_map(|e| e.euler_deg).collect();
        let offsets: Vec<f64> = errors.iter().flat_map(|e| e.translation).collect();
        let (mse_r, rmse_r, mae_r) = moments(&angles)?;
        let (mse_t, rmse_t, mae_t) = moments(&offsets)?;
        let rotations: Vec<f64> = errors.iter().map(|e| e.rotation_deg).collect();
        let translations: Vec<f64> = errors.iter().map(|e| e.translation_norm).collect();
        let chamfers: Vec<f64> = errors.iter().filter_map(|e| e.chamfer).collect();
        let right: Vec<f64> = errors.iter().filter_map(|e| Some(f64::from(u8::from(e.right?)))).collect();
        Ok(Self {
            mse_r,
            rmse_r,
            mae_r,
            mse_t,
            rmse_t,
            mae_t,
            mean_rot_deg: mean(&rotations),
            median_rot_deg: median(rotations),
            mean_trans: mean(&translations),
            median_trans: median(translations),
            recall: errors.iter().filter(|e| e.recalled()).count() as f64 / errors.len() as f64,
            chamfer: (!chamfers.is_empty()).then(|| mean(&chamfers)),
            right: (!right.is_empty()).then(|| mean(&right)),
            pairs: errors.len(),
            failed: errors.iter().filter(|e| e.failed).count(),
        })
    }

    /// Mean over severities: each value is the plain mean of the values of the severities (RMSE is
    /// the mean of the RMSEs, not the root of the mean MSE); `pairs` and `failed` are sums. `None`
    /// without scores.
    pub fn mean(scores: &[Self]) -> Option<Self> {
        if scores.is_empty() {
            return None;
        }
        let average = |value: fn(&Self) -> f64| mean(&scores.iter().map(value).collect::<Vec<_>>());
        let chamfers: Vec<f64> = scores.iter().filter_map(|s| s.chamfer).collect();
        let right: Vec<f64> = scores.iter().filter_map(|s| s.right).collect();
        Some(Self {
            mse_r: average(|s| s.mse_r),
            rmse_r: average(|s| s.rmse_r),
            mae_r: average(|s| s.mae_r),
            mse_t: average(|s| s.mse_t),
            rmse_t: average(|s| s.rmse_t),
            mae_t: average(|s| s.mae_t),
            mean_rot_deg: average(|s| s.mean_rot_deg),
            median_rot_deg: average(|s| s.median_rot_deg),
            mean_trans: average(|s| s.mean_trans),
            median_trans: average(|s| s.median_trans),
            recall: average(|s| s.recall),
            chamfer: (chamfers.len() == scores.len()).then(|| mean(&chamfers)),
            right: (right.len() == scores.len()).then(|| mean(&right)),
            pairs: scores.iter().map(|s| s.pairs).sum(),
            failed: scores.iter().map(|s| s.failed).sum(),
        })
    }
}

/// `(MSE, RMSE, MAE)` of one array.
fn moments(errors: &[f64]) -> Result<(f64, f64, f64), MetricError> {
    let mse = mean(&errors.iter().map(|e| e * e).collect::<Vec<_>>());
    let mae = mean(&errors.iter().map(|e| e.abs()).collect::<Vec<_>>());
    let rmse = mse.sqrt();
    // Equal when all errors have one size; the slack is for rounding.
    if mae > rmse * (1.0 + 1e-9) {
        return Err(MetricError::MaeAboveRmse { mae, rmse });
    }
    Ok((mse, rmse, mae))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The middle value, or the mean of the two in the middle.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    if values.len() % 2 == 1 { values[half] } else { 0.5 * (values[half - 1] + values[half]) }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn pose(angles_deg: [f64; 3], translation: [f64; 3]) -> Rigid {
        Rigid { rotation: EulerXyz::from_deg(angles_deg).to_matrix(), translation: translation.into() }
    }

    fn near(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() <= tolerance, "{a} is not {b} +- {tolerance}");
    }

    /// For u uniform in [0, 45]: E|u| = 22.5, sqrt(E u^2) = 45 / sqrt 3 = 25.98; for t uniform in
    /// [-0.5, 0.5]: 0.25 and 1 / sqrt 12 = 0.2887.
    #[test]
    fn the_identity_scores_chance_level() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let errors: Vec<PoseError> = (0..40_000)
            .map(|_| {
                let angles = std::array::from_fn(|_| rng.random_range(0.0..45.0));
                let translation = std::array::from_fn(|_| rng.random_range(-0.5..0.5));
                PoseError::new(Some(&Rigid::identity()), &pose(angles, translation))
            })
            .collect();
        let scores = Scores::from_errors(&errors).unwrap();
        near(scores.mae_r, 22.5, 0.15);
        near(scores.rmse_r, 25.98, 0.15);
        near(scores.mae_t, 0.25, 0.002);
        near(scores.rmse_t, 0.2887, 0.002);
        assert_eq!(scores.failed, 0);
    }

    /// Two pairs by hand: angle errors (3, 0, 0) and (0, -4, 0); offsets (0.3, 0, 0.4) and 0.
    #[test]
    fn values_by_hand() {
        let truth = pose([10.0, 0.0, 0.0], [0.1, 0.2, 0.3]);
        let errors = [
            PoseError::new(Some(&pose([13.0, 0.0, 0.0], [0.4, 0.2, 0.7])), &truth),
            PoseError::new(Some(&pose([10.0, -4.0, 0.0], [0.1, 0.2, 0.3])), &truth),
        ];
        let s = Scores::from_errors(&errors).unwrap();
        near(s.mse_r, 25.0 / 6.0, 1e-9);
        near(s.rmse_r, (25.0_f64 / 6.0).sqrt(), 1e-9);
        near(s.mae_r, 7.0 / 6.0, 1e-9);
        near(s.mse_t, 0.25 / 6.0, 1e-12);
        near(s.mae_t, 0.7 / 6.0, 1e-12);
        near(s.mean_rot_deg, 3.5, 1e-9);
        near(s.median_rot_deg, 3.5, 1e-9);
        near(s.median_trans, 0.25, 1e-12);
        near(s.recall, 0.5, 0.0); // the first is within 5 degrees, but 0.5 away
        assert_eq!((s.pairs, s.failed, s.chamfer), (2, 0, None));
    }

    #[test]
    fn differences_wrap_around() {
        let error =
            PoseError::new(Some(&pose([-179.0, 0.0, 0.0], [0.0; 3])), &pose([179.0, 0.0, 0.0], [0.0; 3]));
        near(error.euler_deg[0], 2.0, 1e-9);
        near(error.rotation_deg, 2.0, 1e-9);
    }

    #[test]
    fn no_pose_counts_as_the_identity_and_is_reported() {
        let truth = pose([1.0, 2.0, 3.0], [0.01, 0.0, 0.0]);
        let mut broken = Rigid::identity();
        broken.rotation[(1, 2)] = f64::NAN;
        let mut far = Rigid::identity();
        far.translation = Vector3::new(0.0, f64::INFINITY, 0.0);
        let identity = PoseError::new(Some(&Rigid::identity()), &truth);
        for answer in [None, Some(&broken), Some(&far)] {
            let failed = PoseError::new(answer, &truth);
            assert_eq!(failed, PoseError { failed: true, ..identity });
            // The identity would be recalled here; a failure is not.
            assert!(identity.recalled() && !failed.recalled());
            assert_eq!(Scores::from_errors(&[identity, failed]).unwrap().failed, 1);
        }
    }

    #[test]
    fn mae_never_exceeds_rmse() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        for n in [1, 2, 7, 30] {
            let errors: Vec<PoseError> = (0..n)
                .map(|_| {
                    let mut draw = |scale: f64| std::array::from_fn(|_| rng.random_range(-scale..scale));
                    PoseError::new(Some(&pose(draw(180.0), draw(2.0))), &pose(draw(45.0), draw(0.5)))
                })
                .collect();
            let s = Scores::from_errors(&errors).unwrap();
            assert!(s.mae_r <= s.rmse_r && s.mae_t <= s.rmse_t);
            near(s.rmse_r * s.rmse_r, s.mse_r, 1e-9 * s.mse_r);
        }
        // Errors of one size are the limit case, where rounding must not raise the alarm.
        assert!(moments(&[0.1; 3001]).is_ok());
    }

    #[test]
    fn mean_over_severities_is_the_mean_of_the_values() {
        let truth = pose([0.0; 3], [0.0; 3]);
        let at = |deg: f64| {
            Scores::from_errors(&[PoseError::new(Some(&pose([deg, 0.0, 0.0], [0.0; 3])), &truth)]).unwrap()
        };
        let mean = Scores::mean(&[at(1.0), at(3.0)]).unwrap();
        near(mean.rmse_r, (1.0 + 3.0) / 2.0 / 3.0_f64.sqrt(), 1e-9);
        near(mean.mse_r, (1.0 + 9.0) / 2.0 / 3.0, 1e-9);
        assert_eq!(mean.pairs, 2);
        assert_eq!(Scores::mean(&[]), None);
    }

    #[test]
    fn refuses_nothing_and_broken_truths() {
        assert_eq!(Scores::from_errors(&[]), Err(MetricError::NoPairs));
        let mut truth = Rigid::identity();
        truth.translation[0] = f64::NAN;
        let errors = [PoseError::new(None, &Rigid::identity()), PoseError::new(None, &truth)];
        assert_eq!(Scores::from_errors(&errors), Err(MetricError::NotFinite { index: 1 }));
    }
}
