//! What the page's script reads, as it stands in the page.

use serde::Serialize;

use crate::Number;
use crate::quantise::{QuantisedPoints, QuantisedValues};
use crate::residual::ResidualSummary;

#[derive(Debug, Serialize)]
pub(crate) struct EncodedPair {
    pub name: String,
    pub unit: String,
    pub up: &'static str,
    pub source: EncodedCloud,
    pub target: EncodedCloud,
    pub before: EncodedPose,
    pub poses: Vec<EncodedPose>,
    pub skeletons: Option<[EncodedSkeleton; 2]>,
    pub matches: Vec<EncodedMatch>,
    pub match_count: usize,
    /// Distances of this and more are given as this.
    pub distance_limit: Option<f64>,
    pub numbers: Vec<Number>,
    pub warnings: Vec<String>,
    pub description: String,
}

#[derive(Debug, Serialize)]
pub(crate) struct EncodedCloud {
    /// Points of the cloud; `shown` of them are in `points`.
    pub count: usize,
    pub shown: usize,
    #[serde(flatten)]
    pub points: QuantisedPoints,
    /// Base64 of red, green and blue, a byte each, of the points shown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub colours: Option<String>,
    /// Base64 of a byte for each point shown: 0 and 255 are the first and the last percent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intensities: Option<String>,
}

#[derive(Debug, Serialize)]
pub(crate) struct EncodedPose {
    pub name: String,
    /// From the source's local frame to the view's, 3 rows of 4.
    pub matrix: [f64; 12],
    /// Angle and length of the motion from the pose before, the latter of the centre of the source.
    pub turn_deg: f64,
    pub shift: f64,
    pub residual: Option<QuantisedValues>,
    pub summary: Option<ResidualSummary>,
    pub numbers: Vec<Number>,
}

#[derive(Debug, Serialize)]
pub(crate) struct EncodedSkeleton {
    pub points: Vec<[f32; 3]>,
    pub radii: Vec<f32>,
}

#[derive(Debug, Serialize)]
pub(crate) struct EncodedMatch {
    pub source: [f32; 3],
    pub target: [f32; 3],
    pub weight: f32,
}
