//! [`CertaintyScores`]: how well a method knows whether its own poses are right.

use serde::Serialize;

/// Number of bins of the expected calibration error, of equal width in probability.
const BINS: usize = 10;

/// What a method said of one of its poses, and whether the pose is right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Claim {
    /// Probability that the pose is right, in [0, 1], as the method says.
    pub probability: f64,
    /// Whether the method says not to rely on the pose.
    pub abstain: bool,
    /// Whether the pose is right ([`is_right`](crate::is_right)).
    pub right: bool,
}

impl Claim {
    /// No pose at all: nothing is answered, and nothing is expected to be right.
    pub const NO_POSE: Self = Self { probability: 0.0, abstain: true, right: false };
}

/// Scores of the probabilities of one method over many pairs. A pair without a pose counts as one of probability 0 that
/// is not answered.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CertaintyScores {
    /// Number of pairs.
    pub pairs: usize,
    /// Share of right poses, answered or not, in [0, 1].
    pub right: f64,
    /// Brier score: mean of `(probability - right)^2`; 0.25 for who always says one half (Brier 1950).
    pub brier: f64,
    /// Expected calibration error: mean over the pairs of `|mean probability - share of right poses|` of the pair's bin, of
    /// ten of equal width (Naeini et al. 2015).
    pub calibration_error: f64,
    /// Share of pairs on which the method does not abstain, in [0, 1].
    pub answered: f64,
    /// Share of right poses of those; `None` where the method abstains on all.
    pub right_of_answered: Option<f64>,
    /// The bins of the calibration error.
    pub bins: [CertaintyBin; BINS],
    #[serde(skip)]
    sums: CertaintySums,
}

/// The pairs whose probability is in one bin.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct CertaintyBin {
    /// Number of pairs.
    pub pairs: usize,
    /// Sum of the probabilities.
    pub probability: f64,
    /// Number of right poses.
    pub right: usize,
}

/// What can be added up over groups.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct CertaintySums {
    squares: f64,
    answered: usize,
    answered_right: usize,
    bins: [CertaintyBin; BINS],
}

impl CertaintyScores {
    /// Scores of some pairs; `None` without pairs. A probability that is not finite counts as 0, and is not answered.
    pub fn of(claims: &[Claim]) -> Option<Self> {
        let mut sums = CertaintySums::default();
        for claim in claims {
            let known = claim.probability.is_finite();
            let probability = if known { claim.probability.clamp(0.0, 1.0) } else { 0.0 };
            let right = f64::from(u8::from(claim.right));
            sums.squares += (probability - right).powi(2);
            let bin = &mut sums.bins[((probability * BINS as f64) as usize).min(BINS - 1)];
            bin.pairs += 1;
            bin.probability += probability;
            bin.right += usize::from(claim.right);
            if known && !claim.abstain {
                sums.answered += 1;
                sums.answered_right += usize::from(claim.right);
            }
        }
        Self::from_sums(sums)
    }

    /// Scores of all pairs of several groups together; `None` without pairs.
    pub fn together<'a>(groups: impl IntoIterator<Item = &'a Self>) -> Option<Self> {
        let mut sums = CertaintySums::default();
        for group in groups {
            sums.squares += group.sums.squares;
            sums.answered += group.sums.answered;
            sums.answered_right += group.sums.answered_right;
            for (bin, other) in sums.bins.iter_mut().zip(&group.sums.bins) {
                bin.pairs += other.pairs;
                bin.probability += other.probability;
                bin.right += other.right;
            }
        }
        Self::from_sums(sums)
    }

    fn from_sums(sums: CertaintySums) -> Option<Self> {
        let pairs: usize = sums.bins.iter().map(|bin| bin.pairs).sum();
        if pairs == 0 {
            return None;
        }
        let count = pairs as f64;
        let gap = |bin: &CertaintyBin| (bin.probability - bin.right as f64).abs();
        Some(Self {
            pairs,
            right: sums.bins.iter().map(|bin| bin.right).sum::<usize>() as f64 / count,
            brier: sums.squares / count,
            calibration_error: sums.bins.iter().map(gap).sum::<f64>() / count,
            answered: sums.answered as f64 / count,
            right_of_answered: (sums.answered > 0).then(|| sums.answered_right as f64 / sums.answered as f64),
            bins: sums.bins,
            sums,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(probability: f64, abstain: bool, right: bool) -> Claim {
        Claim { probability, abstain, right }
    }

    /// Bins 9 (0.9 right, 1.0 right, 0.95 wrong), 2 (0.2 wrong) and 0 (no pose).
    fn five() -> Vec<Claim> {
        vec![
            claim(0.9, false, true),
            claim(1.0, false, true),
            claim(0.95, false, false),
            claim(0.2, true, false),
            Claim::NO_POSE,
        ]
    }

    #[test]
    fn values_by_hand() {
        let scores = CertaintyScores::of(&five()).unwrap();
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} is not {b}");
        near(scores.brier, (0.01 + 0.0 + 0.9025 + 0.04 + 0.0) / 5.0);
        near(scores.calibration_error, ((2.85 - 2.0) + 0.2) / 5.0);
        near(scores.right, 0.4);
        near(scores.answered, 0.6);
        near(scores.right_of_answered.unwrap(), 2.0 / 3.0);
        assert_eq!(scores.bins[9].pairs, 3);
        assert_eq!(CertaintyScores::of(&[]), None);
        assert_eq!(CertaintyScores::of(&[Claim::NO_POSE]).unwrap().right_of_answered, None);
    }

    #[test]
    fn groups_together_are_all_their_pairs() {
        let claims = five();
        let groups = [CertaintyScores::of(&claims[..2]).unwrap(), CertaintyScores::of(&claims[2..]).unwrap()];
        let (together, all) =
            (CertaintyScores::together(&groups).unwrap(), CertaintyScores::of(&claims).unwrap());
        assert!((together.brier - all.brier).abs() < 1e-15);
        assert_eq!((together.bins[9].pairs, together.answered), (all.bins[9].pairs, all.answered));
        assert!((together.calibration_error - all.calibration_error).abs() < 1e-15);
        assert_eq!(CertaintyScores::together(&[]), None);
    }

    #[test]
    fn what_is_no_probability_is_no_answer() {
        let scores = CertaintyScores::of(&[claim(f64::NAN, false, true), claim(7.0, false, true)]).unwrap();
        assert_eq!((scores.answered, scores.right_of_answered), (0.5, Some(1.0)));
        assert!((scores.brier - 0.5).abs() < 1e-15, "{}", scores.brier);
    }
}
