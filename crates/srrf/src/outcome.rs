//! [`Outcome`]: everything that a user may ask of a registration.

use nalgebra::{Rotation3, UnitQuaternion};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};
use srrf_cloud::{EulerXyz, Rigid};
use srrf_refine::{Evidence, Refinement};

use crate::coarse::{CoarsePose, matrix};
use crate::features::Features;
use crate::network::WeightsId;
use crate::options::Method;
use crate::probability::Probability;
use crate::scale::AppliedScale;
use crate::stage::StageTime;
use crate::start::Start;
use crate::warning::Warning;

/// Numbers of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct PointCounts {
    /// Of the source.
    pub source: usize,
    /// Of the target.
    pub target: usize,
}

/// A start that was tried.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TriedStart {
    /// Where it comes from.
    #[serde(rename = "name")]
    pub start: Start,
    /// As [`srrf_refine::StartSupport::support`].
    pub support: f64,
    /// As [`srrf_refine::StartSupport::rank`].
    pub rank: f64,
}

/// A registration, and what speaks for it.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The pose, in input coordinates: `target ~ R source + t`.
    pub target_from_source: Rigid,
    /// The factor by which the source was multiplied first, if there is one: `target ~ R (factor * source) + t`.
    pub scale: Option<AppliedScale>,
    /// Calibrated probability that the pose is within 5 degrees and a tenth of the target's radius
    /// (root mean square) of the true one; see [`crate::Logistic`].
    pub probability: Probability,
    /// Whether the probability is too small to rely on the pose.
    pub abstain: bool,
    /// The method.
    pub method: Method,
    /// The start that won.
    pub start: Start,
    /// All starts that were tried, in the order of the rounds; as many as `refinement` holds.
    pub tried: Vec<TriedStart>,
    /// What the network found from the given pose, where the method uses it.
    pub network: Option<CoarsePose>,
    /// The refinement, unless it was switched off; poses in it are between the centred clouds.
    pub refinement: Option<Refinement>,
    /// What speaks for the pose.
    pub evidence: Evidence,
    /// The numbers that the probability was computed from.
    pub features: Features,
    /// Sizes of the inputs.
    pub points: PointCounts,
    /// Times, in the order of the stages.
    pub times: Vec<StageTime>,
    /// Seed of the random samples.
    pub seed: u64,
    /// The network's weights; `None` where no network was used.
    pub weights: Option<WeightsId>,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

impl Outcome {
    /// The rotation as a unit quaternion `[w, x, y, z]` with `w >= 0`.
    pub fn quaternion_wxyz(&self) -> [f64; 4] {
        let rotation = Rotation3::from_matrix_unchecked(self.target_from_source.rotation);
        let q = UnitQuaternion::from_rotation_matrix(&rotation).into_inner();
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        [sign * q.w, sign * q.i, sign * q.j, sign * q.k]
    }

    /// All of it as JSON: `target_from_source` (4 rows of 4), `probability`, `abstain`, and the rest under
    /// names of their own. Lengths are in the unit of the input.
    pub fn to_json(&self) -> Value {
        let evidence = &self.evidence;
        let times: serde_json::Map<String, Value> =
            self.times.iter().map(|t| (t.stage.to_string(), json!(t.seconds))).collect();
        json!({
            "target_from_source": matrix(&self.target_from_source),
            "scale": self.scale,
            "probability": self.probability,
            "abstain": self.abstain,
            "quaternion_wxyz": self.quaternion_wxyz(),
            "euler_xyz_deg": EulerXyz::from_matrix(&self.target_from_source.rotation).to_deg(),
            "translation": self.target_from_source.translation.as_slice(),
            "method": self.method.name(),
            "start": self.start,
            "network": self.network.as_ref().map(CoarsePose::to_json),
            "refinement": self.refinement.as_ref().map(|r| json!({
                "kept": r.kept,
                "verdict": r.verdict,
                "verdict_text": r.verdict.to_string(),
                "converged": r.converged,
                "iterations": r.iterations,
                "support": r.support,
                "residual_correlation": r.residuals.correlation,
                "residual_correlation_across": r.residuals.across_correlation,
                "starts": self.tried,
            })),
            "evidence": {
                "spacing": evidence.spacing,
                "inlier_threshold": evidence.inlier_threshold,
                "inliers": evidence.inliers,
                "fitness": evidence.fitness,
                "fitness_denominator": "source points asked",
                "source_points_asked": evidence.source_points,
                "inlier_rmse": evidence.inlier_rmse,
                "overlap_source": evidence.fitness,
                "overlap_target": evidence.overlap_target,
                "target_points_asked": evidence.target_points,
                "information": (0..6).map(|i| evidence.information.row(i).iter().copied().collect::<Vec<f64>>()).collect::<Vec<_>>(),
                "information_order": "rotation x y z (radians), translation x y z, in the target frame about `information_centre`",
                "information_centre": evidence.information_centre.as_slice(),
            },
            "features": self.features,
            "points": self.points,
            "seconds": times,
            "seed": self.seed,
            "weights": self.weights,
            "warnings": self.warnings,
        })
    }
}

/// As [`Outcome::to_json`].
impl Serialize for Outcome {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_json().serialize(serializer)
    }
}
