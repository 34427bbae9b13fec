//! [`CandidatePose`]: one of the poses that fit as well.

use srrf_cloud::Rigid;
use srrf_refine::Alternative;

use crate::probability::Probability;

/// Poses with less than this share of the best one's weight are not listed.
const LISTED: f64 = 0.05;

/// A pose that fits as well as any other, in input coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CandidatePose {
    /// The pose: `target ~ R source + t`.
    pub target_from_source: Rigid,
    /// The probability that it is the right one.
    pub probability: Probability,
}

impl CandidatePose {
    /// The answer and its alternatives; `undo` gives back the coordinates of the input.
    pub(crate) fn all(answer: Self, others: &[Alternative], undo: impl Fn(&Rigid) -> Rigid) -> Vec<Self> {
        let weight = |other: &Alternative| other.log_weight.exp();
        let largest = others.iter().map(weight).fold(1.0, f64::max);
        let listed = others.iter().filter(|o| weight(o) >= LISTED * largest).filter_map(|other| {
            let probability = Probability::new(answer.probability.get() * weight(other))?;
            Some(Self { target_from_source: undo(&other.target_from_source), probability })
        });
        std::iter::once(answer).chain(listed).collect()
    }
}
