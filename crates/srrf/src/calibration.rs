//! [`Calibration`]: the probability that a pose is right, from its fit and from the other poses that fit as well.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::features::Features;
use crate::probability::Probability;

/// What is wrong with the calibration in the program.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// It is no JSON of a [`Calibration`].
    #[error("calibration.json: {0}")]
    Format(#[source] serde_json::Error),
    /// It was fitted to other features.
    #[error("calibration.json holds {have} weights of a regression where there are {need} features")]
    Length {
        /// Numbers in the file.
        have: usize,
        /// Numbers that the features need.
        need: usize,
    },
}

/// What the program knows of how often answers are right.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// From the fit of a pose and the other poses that fit as well.
    pub among_others: Logistic,
    /// From its fit alone ([`Features::alone`]), for those who know more of the other poses than two clouds tell.
    pub alone: Logistic,
}

impl Calibration {
    /// The one in the program.
    ///
    /// # Errors
    /// [`CalibrationError`] if the file in the program was damaged at build time.
    pub fn embedded() -> Result<Self, CalibrationError> {
        let both: Self =
            serde_json::from_str(include_str!("calibration.json")).map_err(CalibrationError::Format)?;
        let need = Features::default().expanded().len();
        let models = [&both.among_others, &both.alone];
        let lengths = models.map(|m| [m.mean.len(), m.deviation.len(), m.weights.len()]);
        match lengths.as_flattened().iter().copied().find(|n| *n != need) {
            Some(have) => Err(CalibrationError::Length { have, need }),
            None => Ok(both),
        }
    }
}

/// Logistic regression on the features, their squares and their products in pairs.
///
/// Fitted by `cargo run -p srrf-calibrate --bin calibrate` on pairs made from training shapes and
/// built-in shapes, and public scans, none of which any test uses; the file holds what it was fitted on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Logistic {
    /// What it was fitted on.
    pub fitted_on: String,
    /// Mean of each expanded feature.
    pub mean: Vec<f64>,
    /// Deviation of each expanded feature.
    pub deviation: Vec<f64>,
    /// Weight of each standardised feature.
    pub weights: Vec<f64>,
    /// The constant.
    pub bias: f64,
}

impl Logistic {
    /// The probability of being right; 0 where a feature is NaN.
    pub fn probability(&self, features: &Features) -> Probability {
        let z: f64 = features
            .expanded()
            .iter()
            .zip(self.mean.iter().zip(&self.deviation).zip(&self.weights))
            .map(|(x, ((mean, deviation), weight))| weight * ((x - mean) / deviation).clamp(-4.0, 4.0))
            .sum();
        Probability::new(1.0 / (1.0 + (-(z + self.bias)).exp())).unwrap_or(Probability::ZERO)
    }

    /// Fits the weights by Newton's method with a penalty of `ridge` on their squares.
    ///
    /// Returns `None` where the examples are all right or all wrong, or not finite.
    pub fn fit(examples: &[(Features, bool)], ridge: f64, fitted_on: String) -> Option<Self> {
        let rows: Vec<Vec<f64>> = examples.iter().map(|(f, _)| f.expanded()).collect();
        let right = examples.iter().filter(|(_, right)| *right).count();
        let columns = rows.first()?.len();
        if right == 0 || right == rows.len() || rows.iter().flatten().any(|v| !v.is_finite()) {
            return None;
        }
        let n = rows.len() as f64;
        let mean: Vec<f64> = (0..columns).map(|c| rows.iter().map(|r| r[c]).sum::<f64>() / n).collect();
        let deviation: Vec<f64> = (0..columns)
            .map(|c| (rows.iter().map(|r| (r[c] - mean[c]).powi(2)).sum::<f64>() / n).sqrt().max(1e-6))
            .collect();
        let standard = |r: usize, c: usize| ((rows[r][c] - mean[c]) / deviation[c]).clamp(-4.0, 4.0);
        // The last column is the constant.
        let x =
            DMatrix::from_fn(rows.len(), columns + 1, |r, c| if c < columns { standard(r, c) } else { 1.0 });
        let y =
            DVector::from_iterator(rows.len(), examples.iter().map(|(_, right)| f64::from(u8::from(*right))));
        let mut beta = DVector::zeros(columns + 1);
        for _ in 0..30 {
            let p = (&x * &beta).map(|z: f64| 1.0 / (1.0 + (-z).exp()));
            let mut gradient = x.transpose() * (&y - &p);
            let w = p.map(|p| (p * (1.0 - p)).max(1e-6));
            let weighted = DMatrix::from_fn(x.nrows(), x.ncols(), |r, c| x[(r, c)] * w[r]);
            let mut hessian = x.transpose() * weighted;
            for c in 0..columns {
                gradient[c] -= ridge * beta[c];
                hessian[(c, c)] += ridge;
            }
            hessian[(columns, columns)] += 1e-9;
            let step = hessian.cholesky()?.solve(&gradient);
            beta += &step;
            if step.norm() < 1e-9 {
                break;
            }
        }
        let weights = beta.rows(0, columns).iter().copied().collect();
        Some(Self { fitted_on, mean, deviation, weights, bias: beta[columns] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn features(fitness: f64, overlap_target: f64) -> Features {
        Features {
            fitness,
            overlap_target,
            inlier_rmse_over_spacing: 0.3,
            support: 0.3,
            residual_correlation: 0.3,
            residual_median_over_spacing: 0.3,
            rival_support: 0.3,
            agreeing_starts: 0.3,
            deformed: 0.3,
            rank: 0.3,
            ..Features::default()
        }
    }

    #[test]
    fn learns_a_threshold_and_keeps_calibrated() {
        // Right where the first feature is above 0.5, but for one in ten.
        let examples: Vec<(Features, bool)> = (0..2000)
            .map(|i| {
                let u = f64::from((i * 7919) % 2000) / 2000.0;
                (features(u, f64::from((i * 31) % 97) / 97.0), (u > 0.5) != (i % 10 == 0))
            })
            .collect();
        let model = Logistic::fit(&examples, 1.0, "a test".into()).unwrap();
        let at = |u: f64| model.probability(&features(u, 0.5)).get();
        assert!(at(0.9) > 0.8 && at(0.1) < 0.2, "{} {}", at(0.9), at(0.1));
        let mean: f64 = examples.iter().map(|(f, _)| model.probability(f).get()).sum::<f64>() / 2000.0;
        let share = examples.iter().filter(|(_, r)| *r).count() as f64 / 2000.0;
        assert!((mean - share).abs() < 0.01);
        assert!(Logistic::fit(&examples[..0], 1.0, String::new()).is_none());
    }

    #[test]
    fn the_one_in_the_program_loads() {
        let model = Calibration::embedded().unwrap().among_others;
        let good = Features {
            fitness: 1.0,
            overlap_target: 1.0,
            inlier_rmse_over_spacing: 0.1,
            support: 0.9,
            residual_correlation: 0.0,
            residual_median_over_spacing: 0.05,
            rival_support: 0.3,
            agreeing_starts: 1.0,
            deformed: 0.0,
            rank: 0.95,
            log_false_alarms: -100.0,
            least_margin: 100.0,
            certain_share: 1.0,
            unbounded_share: 1.0,
            share_of_poses: 1.0,
            challenger: 0.3,
            chance_share: 0.05,
            ..Features::default()
        };
        let bad = Features {
            fitness: 0.3,
            overlap_target: 0.3,
            inlier_rmse_over_spacing: 0.6,
            support: 0.2,
            residual_correlation: 0.5,
            residual_median_over_spacing: 1.5,
            rival_support: 1.0,
            agreeing_starts: 0.1,
            deformed: 0.0,
            rank: 0.4,
            log_false_alarms: -30.0,
            least_margin: 0.1,
            certain_share: 0.02,
            unbounded_share: 0.02,
            share_of_poses: 1.0,
            challenger: 1.0,
            chance_share: 0.05,
            ..Features::default()
        };
        // What `srrf register --seed 1` finds of bun315 and bun090, two scans that share a tenth, 4 degrees off.
        let doubtful = Features {
            fitness: 0.0949,
            overlap_target: 0.098,
            inlier_rmse_over_spacing: 0.6619,
            support: 0.1156,
            residual_correlation: 0.4003,
            residual_median_over_spacing: 3.0,
            rival_support: 0.9382,
            agreeing_starts: 1.0,
            deformed: 0.0,
            rank: 0.2417,
            log_false_alarms: -36.18,
            least_margin: 0.7342,
            certain_share: 0.1048,
            unbounded_share: 1.0,
            share_of_poses: 0.9518,
            challenger: 0.9022,
            chance_share: 0.0307,
            ..Features::default()
        };
        assert_eq!(model.probability(&Features { fitness: f64::NAN, ..good }), Probability::ZERO);
        let [good, bad, doubtful] = [good, bad, doubtful].map(|features| model.probability(&features).get());
        assert!(good > 0.9 && bad < 0.3 && (0.3..0.7).contains(&doubtful), "{good} {bad} {doubtful}");
    }
}
