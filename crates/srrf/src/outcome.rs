//! [`Outcome`]: everything that a user may ask of a registration.

use schemars::JsonSchema;
use serde::Serialize;
use srrf_cloud::Rigid;
use srrf_refine::{Evidence, Refinement, Scatter};

use crate::coarse::CoarsePose;
use crate::features::Features;
use crate::network::WeightsId;
use crate::options::Method;
use crate::poses::CandidatePose;
use crate::probability::Probability;
use crate::scale::AppliedScale;
use crate::stage::StageTime;
use crate::start::Start;
use crate::surface::DrawnSurface;
use crate::undetermined::Undetermined;
use crate::warning::Warning;

/// Numbers of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct PointCounts {
    /// Of the source.
    pub source: usize,
    /// Of the target.
    pub target: usize,
}

/// A start that was tried.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct TriedStart {
    /// Where it comes from.
    #[serde(rename = "name")]
    #[schemars(with = "String")]
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
    /// What the clouds of source and target are drawn from, where they are meshes.
    pub surfaces: [Option<DrawnSurface>; 2],
    /// Calibrated probability that the pose is within 5 degrees and a tenth of the target's radius
    /// (root mean square) of the true one; see [`crate::Calibration`].
    pub probability: Probability,
    /// The same as far as the fit of the pose alone tells: what other poses fit as well is left out. For those who can tell which of them is
    /// right, by a third scan or by what a scanner saw.
    pub probability_of_fit: Probability,
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
    /// All poses that fit as well, the answer first, each with its share of the probability.
    pub poses: Vec<CandidatePose>,
    /// The motions that the fit leaves open; empty where it determines the pose.
    pub undetermined: Vec<Undetermined>,
    /// How far the pose would scatter with other noise on the same clouds; its centre is in input coordinates.
    pub spread: Scatter,
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
        let [x, y, z, w] = self.target_from_source.quaternion_xyzw();
        [w, x, y, z]
    }
}
