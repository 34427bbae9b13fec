//! [`Features`]: what the probability that a pose is right is computed from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use srrf_cloud::Rigid;
use srrf_refine::{Evidence, Refinement, Verdict};

/// Starts with so much of the best one's rank have a say in whether others agree. However many poor starts are tried, they have none.
const WELL_SUPPORTED: f64 = 0.95;
/// A start counts as another pose when it is turned by more than this.
const APART_DEG: f64 = 5.0;

/// What the probability is computed from: numbers without a unit, of the pose and of its rivals. The truth plays no part.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Features {
    /// Share of the source that lies on the target.
    pub fitness: f64,
    /// Share of the target that lies on the source.
    pub overlap_target: f64,
    /// Root mean square distance of the inliers, in point spacings.
    pub inlier_rmse_over_spacing: f64,
    /// Support of the pose ([`Refinement::support`]).
    pub support: f64,
    /// Correlation of neighbouring residuals.
    pub residual_correlation: f64,
    /// Median distance of the matches, in point spacings, at most 3.
    pub residual_median_over_spacing: f64,
    /// Rank of the best other pose over that of this one.
    pub rival_support: f64,
    /// Share of the well supported starts that agree with the pose.
    pub agreeing_starts: f64,
    /// 1 where the clouds look deformed, 0 elsewhere.
    pub deformed: f64,
    /// Rank of the start that the pose comes from ([`srrf_refine::StartSupport::rank`]).
    pub rank: f64,
}

impl Features {
    /// The features of a pose. `rank` is that of the start it comes from, `rivals` are the poses of all starts after their short run,
    /// with their ranks; one counts as another pose when it is turned by more than 5 degrees.
    pub fn new(
        evidence: &Evidence,
        refinement: Option<&Refinement>,
        pose: &Rigid,
        rank: f64,
        rivals: &[(Rigid, f64)],
    ) -> Self {
        let apart = |other: &Rigid| pose.angle_to_deg(other) > APART_DEG;
        let rival = rivals.iter().filter(|(p, _)| apart(p)).map(|(_, rank)| *rank).fold(0.0, f64::max);
        let best = rivals.iter().map(|(_, rank)| *rank).fold(0.0, f64::max);
        let with_a_say: Vec<_> = rivals.iter().filter(|(_, rank)| *rank >= WELL_SUPPORTED * best).collect();
        let agreeing = with_a_say.iter().filter(|(p, _)| !apart(p)).count();
        let deformed = refinement.is_some_and(|r| r.verdict == Verdict::Deformed);
        Self {
            fitness: evidence.fitness,
            overlap_target: evidence.overlap_target,
            inlier_rmse_over_spacing: evidence.inlier_rmse / evidence.spacing.max(f64::MIN_POSITIVE),
            support: refinement.map_or(evidence.fitness, |r| r.support),
            residual_correlation: refinement.map_or(0.0, |r| r.residuals.correlation),
            residual_median_over_spacing: refinement.map_or(1.0, |r| r.residuals.median.min(3.0)),
            rival_support: rival / rank.max(1e-3),
            agreeing_starts: agreeing as f64 / with_a_say.len().max(1) as f64,
            deformed: f64::from(u8::from(deformed)),
            rank,
        }
    }

    /// The numbers, in the order in which the calibration weighs them.
    fn values(&self) -> [f64; 10] {
        [
            self.fitness,
            self.overlap_target,
            self.inlier_rmse_over_spacing,
            self.support,
            self.residual_correlation,
            self.residual_median_over_spacing,
            self.rival_support,
            self.agreeing_starts,
            self.deformed,
            self.rank,
        ]
    }

    /// The features with their products of pairs.
    pub(crate) fn expanded(&self) -> Vec<f64> {
        let x = self.values();
        let mut out = x.to_vec();
        for i in 0..x.len() {
            for j in i..x.len() {
                out.push(x[i] * x[j]);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            Features::new(&evidence, None, &turned(0.0), 0.5, rivals).agreeing_starts
        };
        let mut rivals =
            vec![(turned(0.0), 0.50), (turned(3.0), 0.49), (turned(90.0), 0.48), (turned(1.0), 0.40)];
        assert!((agreeing(&rivals) - 2.0 / 3.0).abs() < 1e-12);
        rivals.extend((0..100).map(|i| (turned(f64::from(i) + 20.0), 0.3)));
        assert!((agreeing(&rivals) - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(agreeing(&[]), 0.0);
    }

    #[test]
    fn each_number_has_its_place_in_the_calibration() {
        let numbered: serde_json::Map<String, serde_json::Value> = [
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
        ]
        .iter()
        .enumerate()
        .map(|(i, name)| ((*name).to_owned(), (i as f64).into()))
        .collect();
        let features: Features = serde_json::from_value(numbered.into()).unwrap();
        assert_eq!(features.values(), std::array::from_fn(|i| i as f64));
        assert_eq!((features.expanded().len(), features.expanded()[64]), (65, 81.0));
    }
}
