//! [`Outcome`]: everything that a user may ask of a registration.

use nalgebra::{Rotation3, UnitQuaternion};
use serde::Serialize;
use serde_json::{Value, json};
use srrf_cloud::{Branch, EulerXyz, Rigid, Skeletons, SoftMatch};
use srrf_refine::{Evidence, Refinement};

use crate::options::Method;
use crate::probability::Features;

/// What the network found, before any refinement, in input coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct CoarsePose {
    /// The fused pose.
    pub target_from_source: Rigid,
    /// The poses of the branches (`dense` and `skeleton`), each with its inlier ratio gamma.
    pub branches: Vec<Branch>,
    /// Weight of the dense branch in the fusion, `gamma_c / (gamma_c + gamma_s)`.
    pub lambda: f64,
    /// Skeletons, in input coordinates.
    pub skeletons: Option<Skeletons>,
    /// Soft matches of the dense branch, in input coordinates.
    pub matches: Vec<SoftMatch>,
}

/// Numbers of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct PointCounts {
    /// Of the source.
    pub source: usize,
    /// Of the target.
    pub target: usize,
}

/// Time that a stage took.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageTime {
    /// The stage.
    pub stage: &'static str,
    /// Its wall time.
    pub seconds: f64,
}

/// A registration, and what speaks for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The pose, in input coordinates: `target ~ R source + t`.
    pub target_from_source: Rigid,
    /// Calibrated probability that the pose is within 5 degrees and a tenth of the target's radius
    /// (root mean square) of the true one; see [`crate::Logistic`].
    pub probability: f64,
    /// Whether the probability is too small to rely on the pose.
    pub abstain: bool,
    /// The method.
    pub method: Method,
    /// Name of the start that won, such as `network fused` or `fpfh-ransac`.
    pub start: String,
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
    /// Name of the network's weights, and their SHA-256; `None` where no network was used.
    pub weights: Option<(String, String)>,
    /// What a user should know, each a sentence.
    pub warnings: Vec<String>,
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
            self.times.iter().map(|t| (t.stage.to_owned(), json!(t.seconds))).collect();
        json!({
            "target_from_source": matrix(&self.target_from_source),
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
                "starts": r.starts.iter().map(|s| json!({ "name": s.name, "support": s.support, "rank": s.rank })).collect::<Vec<_>>(),
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
            "features": self.features.to_json(),
            "points": self.points,
            "seconds": times,
            "seed": self.seed,
            "weights": self.weights.as_ref().map(|(name, sha256)| json!({ "name": name, "sha256": sha256 })),
            "warnings": self.warnings,
        })
    }
}

impl CoarsePose {
    fn to_json(&self) -> Value {
        let branches: serde_json::Map<String, Value> = self
            .branches
            .iter()
            .map(|b| {
                let value =
                    json!({ "target_from_source": matrix(&b.target_from_source), "inlier_ratio": b.inlier_ratio });
                (b.name.to_owned(), value)
            })
            .collect();
        json!({
            "target_from_source": matrix(&self.target_from_source),
            "branches": branches,
            "lambda": self.lambda,
        })
    }
}

/// A pose as 4 rows of 4.
fn matrix(pose: &Rigid) -> Value {
    let m = pose.to_matrix4();
    json!((0..4).map(|i| m.row(i).iter().copied().collect::<Vec<f64>>()).collect::<Vec<_>>())
}
