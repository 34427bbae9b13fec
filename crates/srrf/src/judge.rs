//! [`Judge`]: how sure an answer is.

use srrf_refine::Ranking;

use crate::calibration::{Calibration, CalibrationError, Logistic};
use crate::features::Features;
use crate::options::Options;
use crate::probability::Probability;

/// With this probability after a round of starts, no other one is made.
const SURE: f64 = 0.9;

/// Of poses that fit as well the best one is right so many times as often as its weight says: measured on answers that the calibration is fitted
/// on, of which 45 % are right where the share is 0.25, and 72 % where it is 0.55.
const BEST_OF_ALL: f64 = 2.0;

/// Says how sure answers are.
#[derive(Debug, Clone)]
pub struct Judge {
    calibration: Calibration,
    /// Whether the calibration was fitted on answers of such options.
    fitted: bool,
    abstain_below: Probability,
}

/// How sure an answer is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judgement {
    /// That it is right.
    pub probability: Probability,
    /// Whether that is too little.
    pub abstain: bool,
    /// That it is right as far as its own fit tells, without the other poses that fit as well.
    pub alone: Probability,
}

/// Whether no other starts are needed.
pub(crate) fn is_sure(probability: Probability) -> bool {
    probability.get() >= SURE
}

impl Judge {
    pub(crate) fn new(options: &Options) -> Result<Self, CalibrationError> {
        let ranking = options.refine.map(|config| config.ranking);
        let fitted = ranking == Some(Ranking::Planes);
        Ok(Self { calibration: Calibration::embedded()?, fitted, abstain_below: options.abstain_below })
    }

    /// One with another calibration, for answers of the default options.
    pub fn with(calibration: Calibration) -> Self {
        Self { calibration, fitted: true, abstain_below: Probability::HALF }
    }

    /// Judges by the evidence: the regression, less what chance would give; never more than the share of the pose among all that fit as
    /// well makes likely, nor than what the fit leaves open allows.
    ///
    /// The calibration was fitted on refined poses whose starts are ranked by planes; for others the probability is kept below the
    /// square of the fitness, which only errs on the side of doubt.
    pub fn judge(&self, features: &Features) -> Judgement {
        let Calibration { among_others, alone } = &self.calibration;
        let probability = self.by(among_others, features);
        let alone = self.by(alone, &features.alone());
        Judgement { probability, abstain: probability < self.abstain_below, alone }
    }

    fn by(&self, regression: &Logistic, features: &Features) -> Probability {
        let cautious = if self.fitted { 1.0 } else { features.fitness.powi(2) };
        let calibrated = regression.probability(features).get().min(cautious);
        let fits = calibrated * beyond_chance(features.log_false_alarms);
        Probability::new(fits.min(allowed(features))).unwrap_or(Probability::ZERO)
    }
}

/// The most that [`Judge::judge`] says of such features, whatever the regression says.
pub fn ceiling(features: &Features) -> f64 {
    beyond_chance(features.log_false_alarms).min(allowed(features))
}

/// What endless motions and other poses that fit as well allow to be sure of, in [0, 1]. A motion that ends somewhere fits worst there, and
/// the truth is seldom at an end: how much it counts is for the regression to say. Where clouds look deformed the answer is a start, and other
/// poses that fit better are no better guesses.
fn allowed(features: &Features) -> f64 {
    let share = features.share_of_poses;
    let best = BEST_OF_ALL * share / (BEST_OF_ALL * share + 1.0 - share);
    let among_poses = if features.deformed > 0.0 { 1.0 } else { best };
    among_poses.min(features.unbounded_share).min(1.0)
}

/// The probability that clouds with so many false alarms, of which this is the logarithm, do not agree by chance.
fn beyond_chance(log_false_alarms: f64) -> f64 {
    // NaN, too, is none.
    if log_false_alarms < 0.0 { 1.0 - log_false_alarms.exp() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Method;

    fn good() -> Features {
        Features {
            fitness: 0.8,
            overlap_target: 0.8,
            inlier_rmse_over_spacing: 0.4,
            residual_median_over_spacing: 0.4,
            support: 0.5,
            rank: 0.9,
            rival_support: 0.6,
            chance_share: 0.05,
            log_false_alarms: -100.0,
            least_margin: 100.0,
            certain_share: 1.0,
            unbounded_share: 1.0,
            share_of_poses: 1.0,
            ..Features::default()
        }
    }

    #[test]
    fn an_answer_means_the_same_for_every_method_and_less_without_refinement() {
        let judged = |options: Options| Judge::new(&options).unwrap().judge(&good());
        let by = |method| judged(Options { method, ..Options::default() });
        assert!(
            by(Method::Auto).probability.get() > 0.8 && !by(Method::Auto).abstain,
            "{:?}",
            by(Method::Auto)
        );
        assert!(Method::ALL.into_iter().all(|method| by(method) == by(Method::Auto)));
        let coarse = judged(Options { refine: None, ..Options::default() }).probability.get();
        assert!((coarse - 0.64).abs() < 1e-12, "{coarse}");
    }

    #[test]
    fn chance_open_motions_and_other_poses_count() {
        let judge = Judge::new(&Options::default()).unwrap();
        let judged = |features: Features| judge.judge(&features).probability.get();
        let sure = judged(good());
        assert!(judged(Features { unbounded_share: 0.05, ..good() }) <= 0.05);
        assert!(judged(Features { share_of_poses: 0.25, ..good() }) <= 0.4);
        assert_eq!(judged(Features { log_false_alarms: 0.5, ..good() }), 0.0);
        let coin = judged(Features { log_false_alarms: 0.5f64.ln(), ..good() });
        assert!(coin <= 0.5 && sure > coin, "{coin} {sure}");
        assert_eq!(judged(Features { log_false_alarms: f64::NAN, ..good() }), 0.0);
    }

    #[test]
    fn other_poses_say_nothing_of_the_fit_itself() {
        let judge = Judge::new(&Options::default()).unwrap();
        let sound = judge.judge(&good());
        let crowded =
            judge.judge(&Features { challenger: 1.0, rival_support: 1.0, share_of_poses: 0.1, ..good() });
        assert!(sound.alone.get() > 0.9 && crowded.alone == sound.alone);
        assert!(crowded.abstain && crowded.probability.get() < 0.2, "{crowded:?}");
        let poor =
            judge.judge(&Features { fitness: 0.1, overlap_target: 0.1, support: 0.05, rank: 0.1, ..good() });
        assert!(poor.alone < sound.alone);
    }

    #[test]
    fn no_number_no_answer() {
        let judge = Judge::new(&Options::default()).unwrap();
        let judged = judge.judge(&Features { inlier_rmse_over_spacing: f64::NAN, ..good() });
        assert!(judged.abstain && judged.probability == Probability::ZERO);
    }
}
