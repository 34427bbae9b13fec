//! The probability that a pose is right, from the evidence of its own fit.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use srrf_cloud::Rigid;
use srrf_refine::{Evidence, Refinement, Verdict};

/// Starts with so much of the best one's rank have a say in whether others agree. However many poor starts are tried, they have none.
const WELL_SUPPORTED: f64 = 0.95;

/// Number of features.
pub const FEATURES: usize = 10;

const NAMES: [&str; FEATURES] = [
    "fitness",
    "overlap_target",
    "inlier_rmse_over_spacing",
    "support",
    "residual_correlation",
    "residual_median_over_spacing",
    "rival_support",
    "agreeing_starts",
    "deformed",
    "rank",
];

/// What the probability is computed from: numbers without a unit, of the pose and of its rivals. The
/// truth plays no part.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Features(pub [f64; FEATURES]);

impl Features {
    /// The features of a pose. `rank` is that of the start it comes from, `rivals` are the poses of all starts after their short run,
    /// with their ranks ([`srrf_refine::StartSupport::rank`]); one counts as another pose when it is turned by more than 5 degrees.
    pub fn new(
        evidence: &Evidence,
        refinement: Option<&Refinement>,
        pose: &Rigid,
        rank: f64,
        rivals: &[(Rigid, f64)],
    ) -> Self {
        let support = refinement.map_or(evidence.fitness, |r| r.support);
        let apart = |other: &Rigid| pose.angle_to_deg(other) > 5.0;
        let rival = rivals.iter().filter(|(p, _)| apart(p)).map(|(_, rank)| *rank).fold(0.0, f64::max);
        let best = rivals.iter().map(|(_, rank)| *rank).fold(0.0, f64::max);
        let with_a_say: Vec<_> = rivals.iter().filter(|(_, rank)| *rank >= WELL_SUPPORTED * best).collect();
        let agreeing =
            with_a_say.iter().filter(|(p, _)| !apart(p)).count() as f64 / with_a_say.len().max(1) as f64;
        let spacing = evidence.spacing.max(f64::MIN_POSITIVE);
        Self([
            evidence.fitness,
            evidence.overlap_target,
            evidence.inlier_rmse / spacing,
            support,
            refinement.map_or(0.0, |r| r.residuals.correlation),
            refinement.map_or(1.0, |r| r.residuals.median.min(3.0)),
            rival / rank.max(1e-3),
            agreeing,
            f64::from(u8::from(refinement.is_some_and(|r| r.verdict == Verdict::Deformed))),
            rank,
        ])
    }

    /// Share of the source that lies on the target.
    pub fn fitness(&self) -> f64 {
        self.0[0]
    }

    /// The features by name.
    pub fn to_json(&self) -> Value {
        let entries: serde_json::Map<String, Value> =
            NAMES.iter().zip(self.0).map(|(name, value)| ((*name).to_owned(), json!(value))).collect();
        Value::Object(entries)
    }

    /// The features with their products of pairs, standardised outside.
    fn expanded(&self) -> Vec<f64> {
        let x = &self.0;
        let mut out = x.to_vec();
        for i in 0..FEATURES {
            for j in i..FEATURES {
                out.push(x[i] * x[j]);
            }
        }
        out
    }
}

/// Logistic regression on the features and their products of pairs.
///
/// Fitted by `cargo run --release -p srrf-lab --bin calibrate` on pairs made from training shapes and
/// built-in shapes, none of which any test uses; the file holds what it was fitted on.
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
    /// The one in the program.
    ///
    /// # Errors
    /// In words, if the file in the program was damaged at build time.
    pub fn embedded() -> Result<Self, String> {
        let model: Self =
            serde_json::from_str(include_str!("../calibration.json")).map_err(|e| e.to_string())?;
        let count = Features([0.0; FEATURES]).expanded().len();
        let fits = [&model.mean, &model.deviation, &model.weights].iter().all(|v| v.len() == count);
        if fits { Ok(model) } else { Err(format!("calibration.json does not hold {count} weights")) }
    }

    /// The probability of being right.
    pub fn probability(&self, features: &Features) -> f64 {
        let z: f64 = features
            .expanded()
            .iter()
            .zip(self.mean.iter().zip(&self.deviation).zip(&self.weights))
            .map(|(x, ((mean, deviation), weight))| weight * ((x - mean) / deviation).clamp(-4.0, 4.0))
            .sum();
        1.0 / (1.0 + (-(z + self.bias)).exp())
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

    #[test]
    fn learns_a_threshold_and_keeps_calibrated() {
        // Right where the first feature is above 0.5, but for one in ten.
        let examples: Vec<(Features, bool)> = (0..2000)
            .map(|i| {
                let u = f64::from((i * 7919) % 2000) / 2000.0;
                let mut x = [0.3; FEATURES];
                (x[0], x[1]) = (u, f64::from((i * 31) % 97) / 97.0);
                (Features(x), (u > 0.5) != (i % 10 == 0))
            })
            .collect();
        let model = Logistic::fit(&examples, 1.0, "a test".into()).unwrap();
        let at = |u: f64| {
            let mut x = [0.3; FEATURES];
            (x[0], x[1]) = (u, 0.5);
            model.probability(&Features(x))
        };
        assert!(at(0.9) > 0.8 && at(0.1) < 0.2, "{} {}", at(0.9), at(0.1));
        let mean: f64 = examples.iter().map(|(f, _)| model.probability(f)).sum::<f64>() / 2000.0;
        let share = examples.iter().filter(|(_, r)| *r).count() as f64 / 2000.0;
        assert!((mean - share).abs() < 0.01);
        assert!(Logistic::fit(&examples[..0], 1.0, String::new()).is_none());
    }

    #[test]
    fn poor_starts_have_no_say() {
        let evidence = Evidence {
            spacing: 0.1,
            inlier_threshold: 0.1,
            inliers: 50,
            source_points: 100,
            target_points: 100,
            fitness: 0.5,
            overlap_target: 0.5,
            inlier_rmse: 0.05,
            information: nalgebra::Matrix6::identity(),
            information_centre: nalgebra::Vector3::zeros(),
        };
        let turned = |degrees: f64| Rigid {
            rotation: *nalgebra::Rotation3::from_scaled_axis(nalgebra::Vector3::x() * degrees.to_radians())
                .matrix(),
            ..Rigid::identity()
        };
        let agreeing = |rivals: &[(Rigid, f64)]| {
            Features::new(&evidence, None, &turned(0.0), 0.5, rivals).to_json()["agreeing_starts"]
                .as_f64()
                .unwrap()
        };
        let mut rivals =
            vec![(turned(0.0), 0.50), (turned(3.0), 0.49), (turned(90.0), 0.48), (turned(1.0), 0.40)];
        assert!((agreeing(&rivals) - 2.0 / 3.0).abs() < 1e-12);
        rivals.extend((0..100).map(|i| (turned(f64::from(i) + 20.0), 0.3)));
        assert!((agreeing(&rivals) - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(agreeing(&[]), 0.0);
    }

    #[test]
    fn the_one_in_the_program_loads() {
        let model = Logistic::embedded().unwrap();
        let good = Features([1.0, 1.0, 0.1, 0.9, 0.0, 0.05, 0.3, 1.0, 0.0, 0.95]);
        let bad = Features([0.3, 0.3, 0.6, 0.2, 0.5, 1.5, 1.0, 0.1, 0.0, 0.4]);
        // What `srrf register --seed 1` finds of bun315 and bun090, two scans that share a tenth, 4 degrees off.
        let doubtful = Features([0.0957, 0.0978, 0.6686, 0.1153, 0.3984, 3.0, 0.9605, 0.5, 0.0, 0.2537]);
        let [good, bad, doubtful] = [good, bad, doubtful].map(|features| model.probability(&features));
        assert!(good > 0.9 && bad < 0.5 && doubtful < 0.3, "{good} {bad} {doubtful}");
    }
}
