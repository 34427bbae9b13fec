//! [`Answer`]: the keys of an answer in JSON, each with a sentence. The JSON Schema is made of these types, and the book's
//! table of keys of the schema.

use std::collections::BTreeMap;

use schemars::{JsonSchema, Schema, schema_for};
use serde::{Serialize, Serializer};
use serde_json::Value;
use srrf_cloud::{EulerXyz, Rigid};
use srrf_refine::{Evidence, Refinement, Scatter, Verdict};

use crate::coarse::CoarsePose;
use crate::features::Features;
use crate::network::WeightsId;
use crate::outcome::{Outcome, PointCounts, TriedStart};
use crate::poses::CandidatePose;
use crate::probability::Probability;
use crate::scale::AppliedScale;
use crate::surface::DrawnSurface;
use crate::undetermined::Undetermined;
use crate::warning::Warning;

/// A pose as 4 rows of 4.
type Matrix4 = [[f64; 4]; 4];

/// The version of the keys. A key that goes, or changes its meaning, makes a new one; keys may be added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub enum AnswerVersion {
    /// The first.
    #[serde(rename = "srrf-register/1")]
    V1,
}

/// An answer as `srrf register --json` writes it and as a line of `srrf batch` holds it. Lengths are in the unit of the input.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Answer {
    /// The version of these keys.
    pub schema: AnswerVersion,
    /// The pose, 4 rows of 4: `target ~ R source + t`.
    pub target_from_source: Matrix4,
    /// The factor by which the source was multiplied first; null where there is none.
    pub scale: Option<AppliedScale>,
    /// What the clouds are drawn from, where source or target is a mesh.
    pub surfaces: SurfacesAnswer,
    /// Calibrated probability that the pose is right.
    #[schemars(with = "f64", range(min = 0.0, max = 1.0))]
    pub probability: Probability,
    /// Whether the probability is too small to rely on the pose.
    pub abstain: bool,
    /// The rotation as a unit quaternion `w x y z`, `w` not negative.
    pub quaternion_wxyz: [f64; 4],
    /// The rotation as angles: `R = Rx(a) Ry(b) Rz(c)`, in degrees.
    pub euler_xyz_deg: [f64; 3],
    /// The translation.
    pub translation: [f64; 3],
    /// How starts were found.
    pub method: String,
    /// The start that won.
    pub start: String,
    /// What the network found from the first guess; null where no network was used.
    pub network: Option<NetworkAnswer>,
    /// The refinement; null where it was switched off.
    pub refinement: Option<RefinementAnswer>,
    /// What speaks for the pose.
    pub evidence: EvidenceAnswer,
    /// The numbers that the probability was computed from.
    pub features: Features,
    /// All poses that fit as well, the answer first.
    pub poses: Vec<PoseAnswer>,
    /// The motions that the fit leaves open; none where it determines the pose.
    pub undetermined: Vec<Undetermined>,
    /// How far the pose would scatter with other noise on the same clouds; null where too few points fit.
    pub spread: Option<SpreadAnswer>,
    /// Points of both clouds, without those left out.
    pub points: PointCounts,
    /// Wall time of each stage by its name.
    #[schemars(with = "BTreeMap<String, f64>")]
    pub seconds: serde_json::Map<String, Value>,
    /// Seed of the random draws.
    pub seed: u64,
    /// Name and SHA-256 of the network's weights; null where no network was used.
    pub weights: Option<WeightsId>,
    /// Sentences that a user should know.
    #[schemars(with = "Vec<String>")]
    pub warnings: Vec<Warning>,
    /// What the programs know besides.
    #[serde(flatten)]
    pub run: RunKeys,
}

/// What the clouds of source and target are drawn from; null for a cloud.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct SurfacesAnswer {
    /// The mesh of the source.
    pub source: Option<DrawnSurface>,
    /// The mesh of the target.
    pub target: Option<DrawnSurface>,
}

/// What the programs know of an answer besides: its files, and its line in a batch. The library leaves them out.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
pub struct RunKeys {
    /// The file of the source, as it was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// The file of the target, as it was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Points that were left out because a coordinate is NaN or infinite.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dropped_points: Option<PointCounts>,
    /// The version of the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<String>,
    /// In a batch: what the pair is known by.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// In a batch: the file of the first guess, as it was given, or null.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub initial: Option<Value>,
    /// In a batch: the other columns of the list.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub columns: Option<Value>,
    /// In a batch: what the answer depends on besides the clouds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub options: Option<Value>,
}

/// A pose that fits as well as any other.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct PoseAnswer {
    /// The pose, as that of the answer.
    pub target_from_source: Matrix4,
    /// The probability that it is the right one.
    #[schemars(with = "f64", range(min = 0.0, max = 1.0))]
    pub probability: Probability,
}

/// Standard deviations of the pose by noise.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct SpreadAnswer {
    /// Of the rotation about x, y and z, in degrees.
    pub rotation_deg: [f64; 3],
    /// Of the place of `centre` along x, y and z.
    pub translation: [f64; 3],
    /// The mean of the target.
    pub centre: [f64; 3],
}

/// What the network found, before any refinement.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct NetworkAnswer {
    /// The fused pose.
    pub target_from_source: Matrix4,
    /// The branches, `dense` and `skeleton`.
    pub branches: BTreeMap<String, BranchAnswer>,
    /// Weight of the dense branch in the fused pose.
    pub lambda: Option<f64>,
}

/// What one branch of the network found.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct BranchAnswer {
    /// Its pose.
    pub target_from_source: Matrix4,
    /// Share of its correspondences that agree with it.
    pub inlier_ratio: f64,
}

/// What the refinement decided.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct RefinementAnswer {
    /// Whether the answer is a refined pose, or a start as it was given.
    pub kept: bool,
    /// `rigid`, `deformed` or `unsupported`.
    #[schemars(with = "String")]
    pub verdict: Verdict,
    /// The same in words.
    pub verdict_text: String,
    /// Whether the last stage stood still before it ran out of iterations.
    pub converged: bool,
    /// Iterations of all stages after the choice of the start.
    pub iterations: usize,
    /// Robust share of the source that the answer explains.
    pub support: f64,
    /// Correlation of neighbouring residuals in one cloud.
    pub residual_correlation: f64,
    /// The same across the clouds, along the normals.
    pub residual_correlation_across: f64,
    /// The starts that were tried, in the order of the rounds.
    pub starts: Vec<TriedStart>,
}

/// What speaks for a pose.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct EvidenceAnswer {
    /// Median distance between neighbouring points of the sparser cloud.
    pub spacing: f64,
    /// Distance under which a match is an inlier: one spacing.
    pub inlier_threshold: f64,
    /// Source points with a target point within the threshold.
    pub inliers: usize,
    /// `inliers` over `source_points_asked`.
    pub fitness: f64,
    /// What `fitness` is a share of, in words.
    pub fitness_denominator: String,
    /// Source points that were asked.
    pub source_points_asked: usize,
    /// Root mean square distance of the inliers.
    pub inlier_rmse: f64,
    /// The same as `fitness`.
    pub overlap_source: f64,
    /// Share of the target with a source point within the threshold.
    pub overlap_target: f64,
    /// Target points that were asked.
    pub target_points_asked: usize,
    /// `sum J^T J` over the inliers, 6 rows of 6.
    pub information: [[f64; 6]; 6],
    /// The order of its rows, in words.
    pub information_order: String,
    /// The point about which its rotations turn, in the target frame.
    pub information_centre: [f64; 3],
}

/// A pair of a batch that has no pose.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct NoAnswer {
    /// The version of these keys.
    pub schema: AnswerVersion,
    /// Why there is no pose.
    pub error: String,
    /// What the programs know besides.
    #[serde(flatten)]
    pub run: RunKeys,
}

/// A line of a batch, or the file of one registration.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum AnswerOrError {
    /// A pose was found.
    Found(Box<Answer>),
    /// None was.
    None(Box<NoAnswer>),
}

/// The JSON Schema of [`AnswerOrError`], as `schemas/srrf-register-1.schema.json` in the repository holds it.
pub fn answer_schema() -> Schema {
    let mut schema = schema_for!(AnswerOrError);
    schema.insert("$id".into(), "srrf-register/1".into());
    schema.insert("title".into(), "An answer of srrf register, or a line of srrf batch".into());
    schema
}

impl Answer {
    /// The answer that an outcome is.
    pub fn new(outcome: &Outcome) -> Self {
        let pose = &outcome.target_from_source;
        let seconds = outcome.times.iter().map(|t| (t.stage.to_string(), t.seconds.into())).collect();
        Self {
            schema: AnswerVersion::V1,
            target_from_source: matrix(pose),
            scale: outcome.scale,
            surfaces: SurfacesAnswer { source: outcome.surfaces[0], target: outcome.surfaces[1] },
            probability: outcome.probability,
            abstain: outcome.abstain,
            quaternion_wxyz: outcome.quaternion_wxyz(),
            euler_xyz_deg: EulerXyz::from_matrix(&pose.rotation).to_deg(),
            translation: pose.translation.into(),
            method: outcome.method.name().into(),
            start: outcome.start.to_string(),
            network: outcome.network.as_ref().map(NetworkAnswer::new),
            refinement: outcome.refinement.as_ref().map(|r| RefinementAnswer::new(r, &outcome.tried)),
            evidence: EvidenceAnswer::new(&outcome.evidence),
            features: outcome.features,
            poses: outcome.poses.iter().map(PoseAnswer::new).collect(),
            undetermined: outcome.undetermined.clone(),
            spread: SpreadAnswer::new(&outcome.spread),
            points: outcome.points,
            seconds,
            seed: outcome.seed,
            weights: outcome.weights.clone(),
            warnings: outcome.warnings.clone(),
            run: RunKeys::default(),
        }
    }
}

impl Outcome {
    /// All of it as JSON, with the keys of [`Answer`].
    pub fn to_json(&self) -> Value {
        // Numbers, texts and lists of them always are JSON.
        serde_json::to_value(Answer::new(self)).unwrap_or_default()
    }
}

/// As [`Outcome::to_json`].
impl Serialize for Outcome {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Answer::new(self).serialize(serializer)
    }
}

impl NoAnswer {
    /// A pair without a pose, and why.
    pub fn new(error: String) -> Self {
        Self { schema: AnswerVersion::V1, error, run: RunKeys::default() }
    }
}

impl PoseAnswer {
    fn new(pose: &CandidatePose) -> Self {
        Self { target_from_source: matrix(&pose.target_from_source), probability: pose.probability }
    }
}

impl SpreadAnswer {
    fn new(spread: &Scatter) -> Option<Self> {
        let (rotation_deg, translation) = (spread.rotation_deg(), spread.translation());
        let finite = rotation_deg.iter().chain(&translation).all(|v| v.is_finite());
        finite.then(|| Self { rotation_deg, translation, centre: spread.centre.into() })
    }
}

impl NetworkAnswer {
    fn new(found: &CoarsePose) -> Self {
        let branch = |b: &srrf_cloud::Branch| BranchAnswer {
            target_from_source: matrix(&b.target_from_source),
            inlier_ratio: b.inlier_ratio,
        };
        Self {
            target_from_source: matrix(&found.target_from_source),
            branches: found.branches.iter().map(|b| (b.kind.to_string(), branch(b))).collect(),
            lambda: found.lambda,
        }
    }
}

impl RefinementAnswer {
    fn new(refinement: &Refinement, tried: &[TriedStart]) -> Self {
        Self {
            kept: refinement.kept,
            verdict: refinement.verdict,
            verdict_text: refinement.verdict.to_string(),
            converged: refinement.converged,
            iterations: refinement.iterations,
            support: refinement.support,
            residual_correlation: refinement.residuals.correlation,
            residual_correlation_across: refinement.residuals.across_correlation,
            starts: tried.to_vec(),
        }
    }
}

impl EvidenceAnswer {
    fn new(evidence: &Evidence) -> Self {
        Self {
            spacing: evidence.spacing,
            inlier_threshold: evidence.inlier_threshold,
            inliers: evidence.inliers,
            fitness: evidence.fitness,
            fitness_denominator: "source points asked".into(),
            source_points_asked: evidence.source_points,
            inlier_rmse: evidence.inlier_rmse,
            overlap_source: evidence.fitness,
            overlap_target: evidence.overlap_target,
            target_points_asked: evidence.target_points,
            information: std::array::from_fn(|i| std::array::from_fn(|j| evidence.information[(i, j)])),
            information_order: "rotation x y z (radians), translation x y z, in the target frame about \
                                `information_centre`"
                .into(),
            information_centre: evidence.information_centre.into(),
        }
    }
}

fn matrix(pose: &Rigid) -> Matrix4 {
    let matrix = pose.to_matrix4();
    std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)]))
}
