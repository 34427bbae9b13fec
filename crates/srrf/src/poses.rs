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
    /// The answer and its alternatives; `undo` gives back the coordinates of the input. Those have at most what the answer leaves, by
    /// their weights, and none more than its weight has against that of the answer.
    pub(crate) fn all(answer: Self, others: &[Alternative], undo: impl Fn(&Rigid) -> Rigid) -> Vec<Self> {
        let weight = |other: &Alternative| other.log_weight.exp();
        let (largest, sum) = others.iter().map(weight).fold((1.0, 0.0), |(m, s), w| (f64::max(m, w), s + w));
        let p = answer.probability.get();
        let for_each = if sum > 0.0 { p.min((1.0 - p) / sum) } else { p };
        let listed = others.iter().filter(|o| weight(o) >= LISTED * largest).filter_map(|other| {
            let probability = Probability::new(for_each * weight(other))?;
            Some(Self { target_from_source: undo(&other.target_from_source), probability })
        });
        std::iter::once(answer).chain(listed).collect()
    }
}
