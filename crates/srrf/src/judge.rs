//! [`Judge`]: how sure an answer is.

use srrf_refine::Ranking;

use crate::calibration::{CalibrationError, Logistic};
use crate::features::Features;
use crate::options::{Method, Options};
use crate::probability::Probability;

/// With this probability after a round of starts, no other one is made.
const SURE: f64 = 0.9;

/// Says how sure answers are.
#[derive(Debug)]
pub(crate) struct Judge {
    calibration: Logistic,
    /// Whether the calibration was fitted on answers of such options.
    fitted: bool,
    abstain_below: Probability,
}

/// How sure an answer is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Judgement {
    /// That it is right.
    pub probability: Probability,
    /// Whether that is too little.
    pub abstain: bool,
}

impl Judgement {
    /// Whether no other starts are needed.
    pub fn is_sure(self) -> bool {
        self.probability.get() >= SURE
    }
}

impl Judge {
    pub fn new(options: &Options) -> Result<Self, CalibrationError> {
        let ranking = options.refine.map(|config| config.ranking);
        let fitted = options.method == Method::Auto && ranking == Some(Ranking::Planes);
        Ok(Self { calibration: Logistic::embedded()?, fitted, abstain_below: options.abstain_below })
    }

    /// Judges by the evidence. The calibration was fitted on [`Method::Auto`] with refinement and starts ranked by planes; for other
    /// methods, whose few starts give no rivals to compare with, other ranks, and poses without refinement, the probability is kept
    /// below the square of the fitness, which only errs on the side of doubt.
    pub fn judge(&self, features: &Features) -> Judgement {
        let calibrated = self.calibration.probability(features);
        let cautious = Probability::new(features.fitness.powi(2)).unwrap_or(Probability::ZERO);
        let probability = if self.fitted || calibrated <= cautious { calibrated } else { cautious };
        Judgement { probability, abstain: probability < self.abstain_below }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> Features {
        Features {
            fitness: 0.8,
            overlap_target: 0.8,
            support: 0.8,
            agreeing_starts: 1.0,
            rank: 0.8,
            ..Features::default()
        }
    }

    #[test]
    fn other_methods_err_on_the_side_of_doubt() {
        let judged = |method| Judge::new(&Options { method, ..Options::default() }).unwrap().judge(&good());
        let (auto, icp) = (judged(Method::Auto), judged(Method::Icp));
        assert!(auto.is_sure() && !auto.abstain, "{auto:?}");
        assert!((icp.probability.get() - 0.64).abs() < 1e-12 && !icp.is_sure(), "{icp:?}");
    }

    #[test]
    fn no_number_no_answer() {
        let judge = Judge::new(&Options::default()).unwrap();
        let judged = judge.judge(&Features { inlier_rmse_over_spacing: f64::NAN, ..good() });
        assert!(judged.abstain && judged.probability == Probability::ZERO);
    }
}
