//! [`Verdict`]: what was decided about a refined pose, and the rules behind it, one function each.
//!
//! The numbers were chosen on training shapes of ModelNet40 and built-in shapes with `lab/src/bin/refine_choices.rs` and
//! `lab/src/bin/tune.rs`, none on test shapes.

use std::fmt;

use serde::Serialize;
use srrf_cloud::Rigid;

use crate::Deformed;
use crate::affine::AffineFit;
use crate::deformation::ResidualStructure;

/// What was decided about the refined pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The clouds fit rigidly: the refined pose is the answer.
    Rigid,
    /// Neighbouring residuals point the same way, as deformation makes them, or an affine map fits better; the best fit is then
    /// no better a guess of the motion than a good start: the answer is what [`crate::RefineConfig::deformed`] says.
    Deformed,
    /// Refinement lowered the support, so the answer is the start.
    Unsupported,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rigid => "the clouds fit rigidly",
            Self::Deformed => "the residuals look like deformation: no exact fit",
            Self::Unsupported => "refinement lowered the support of the start",
        })
    }
}

/// Whether the clouds are two samplings: half of the matches are farther apart than 0.15 point spacings. Clouds that share points
/// leave holes over, which are no deformation.
pub(crate) fn are_two_samplings(residuals: &ResidualStructure) -> bool {
    residuals.median > 0.15
}

/// Whether residuals look bent: they correlate with those of their neighbours in the same cloud, and along the normals with those
/// of their neighbours in the other cloud. Each test alone takes partial views for bent ones.
///
/// Where a start is no worse an answer than a halfway pose, the bounds are lower: strong bends have little structure left within
/// reach of a match.
pub(crate) fn look_bent(residuals: &ResidualStructure, answer: Deformed) -> bool {
    let (near, across) = match answer {
        Deformed::Start => (0.13, 0.04),
        Deformed::Halfway => (0.15, 0.09),
    };
    residuals.correlation > near && residuals.across_correlation > across
}

/// Whether the refinement wandered: it turned by more than 20 degrees away from the start of a method that knows shapes. A sheared
/// box fits as well in a wrong pose as a noisy one in the right one.
pub(crate) fn wandered(start: &Rigid, refined: &Rigid, answer: Deformed) -> bool {
    answer == Deformed::Start && start.angle_to_deg(refined) > 20.0
}

/// Whether the clouds look sheared: an affine map moves the points by more than 0.75 point spacings away from any rigid motion, and
/// has more support than the pose, by more than 0.03. Partial views of rigid shapes gain less.
///
/// After a refinement that wandered 0.01 is enough: where a turn repairs the start, no affine map is better.
pub(crate) fn look_sheared(affine: &AffineFit, wandered: bool) -> bool {
    let gain = if wandered { 0.01 } else { 0.03 };
    affine.bend > 0.75 && affine.gain > gain
}

/// Whether the refined pose has so much more support than its cautious variant, 0.05, that it is right, whatever the residuals
/// look like.
pub(crate) fn clearly_better(support: f64, cautious: f64) -> bool {
    support >= cautious + 0.05
}

/// Whether two starts are guesses of one pose, within 15 degrees; the first of such, by the caller's order, stands for all.
pub(crate) fn same_guess(a: &Rigid, b: &Rigid) -> bool {
    a.angle_to_deg(b) < 15.0
}

/// Whether refinement lost support against the start, by more than 0.01. Soft matches may lose a little, since they do not seek the
/// nearest neighbours that support counts.
pub(crate) fn lost_support(support: f64, of_start: f64) -> bool {
    support < of_start - 0.01
}

#[cfg(test)]
mod tests {
    use srrf_cloud::EulerXyz;

    use super::*;

    fn residuals(correlation: f64, across: f64) -> ResidualStructure {
        ResidualStructure { correlation, normal_correlation: 0.0, across_correlation: across, median: 0.4 }
    }

    fn turned(degrees: f64) -> Rigid {
        Rigid { rotation: EulerXyz::from_deg([0.0, degrees, 0.0]).to_matrix(), ..Rigid::identity() }
    }

    #[test]
    fn bends_show_in_both_clouds() {
        let weak = residuals(0.14, 0.06);
        assert!(look_bent(&weak, Deformed::Start) && !look_bent(&weak, Deformed::Halfway));
        assert!(look_bent(&residuals(0.2, 0.2), Deformed::Halfway));
        // Partial views: structure in the same cloud alone.
        assert!(!look_bent(&residuals(0.5, 0.0), Deformed::Start));
        assert!(!look_bent(&residuals(0.1, 0.5), Deformed::Start));
        assert!(are_two_samplings(&weak));
        assert!(!are_two_samplings(&ResidualStructure { median: 0.1, ..weak }));
    }

    #[test]
    fn shears_gain_more_unless_the_run_wandered() {
        let fit = AffineFit { bend: 1.0, gain: 0.02 };
        assert!(look_sheared(&fit, true) && !look_sheared(&fit, false));
        assert!(!look_sheared(&AffineFit { bend: 0.7, ..fit }, true));
        assert!(wandered(&turned(0.0), &turned(21.0), Deformed::Start));
        assert!(!wandered(&turned(0.0), &turned(19.0), Deformed::Start));
        assert!(!wandered(&turned(0.0), &turned(21.0), Deformed::Halfway));
    }

    #[test]
    fn support_decides_between_poses() {
        assert!(clearly_better(0.56, 0.5) && !clearly_better(0.54, 0.5));
        assert!(lost_support(0.48, 0.5) && !lost_support(0.495, 0.5));
        assert!(same_guess(&turned(0.0), &turned(14.0)) && !same_guess(&turned(0.0), &turned(16.0)));
    }
}
