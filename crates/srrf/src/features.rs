//! [`Features`]: what the probability that a pose is right is computed from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use srrf_cloud::Rigid;
use srrf_refine::{Alternative, Assessment, Evidence, Refinement, Verdict};

/// Starts with so much of the best one's rank have a say in whether others agree. However many poor starts are tried, they have none.
const WELL_SUPPORTED: f64 = 0.95;
/// A start counts as another pose when it is turned by more than this.
const APART_DEG: f64 = 5.0;
/// Logarithms beyond this are as good as certain.
const LIMIT: f64 = 100.0;
/// Shares below this are as good as none.
const LEAST_SHARE: f64 = 1e-6;

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
    /// Logarithm of the number of false alarms ([`srrf_refine::Chance`]), kept within 100 of 0: below 0 the clouds agree by more than
    /// chance gives.
    pub log_false_alarms: f64,
    /// How much worse the pose fits when moved as far as matters, at most 100 ([`srrf_refine::Freedom::least_margin`]).
    pub least_margin: f64,
    /// Share of what the fit leaves open that lies near the pose: 1 where it determines all six motions.
    pub certain_share: f64,
    /// The same of the motions alone that go on for as far as was tried, along which any place is as likely: 1 where there are none.
    pub unbounded_share: f64,
    /// Weight of the pose among all that fit as well: 1 where it is the only one.
    pub share_of_poses: f64,
    /// Rank of the best pose that a symmetry of the clouds, a turn, a shift or another start leads to, over that of this one; at most 2.
    pub challenger: f64,
    /// Share that lies within a point spacing by chance, the mean of both clouds.
    pub chance_share: f64,
    /// Support that an affine map has beyond the pose ([`srrf_refine::AffineFit`]); 0 where none was looked for.
    pub affine_gain: f64,
    /// How far it moves the points away from any rigid motion, in point spacings, at most 5.
    pub affine_bend: f64,
}

/// What a pose is compared with.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rivals<'a> {
    /// The poses of all starts after their short run, with their ranks.
    pub starts: &'a [(Rigid, f64)],
    /// The start that the pose comes from.
    pub own: usize,
    /// Other poses that may fit as well.
    pub alternatives: &'a [Alternative],
}

impl Features {
    /// The features of a pose. `rank` is that of the start it comes from, `rivals` are the poses of all starts after their short run,
    /// with their ranks; one counts as another pose when it is turned by more than 5 degrees, and is not the start `own` that the pose comes from.
    pub(crate) fn new(
        evidence: &Evidence,
        refinement: Option<&Refinement>,
        assessment: &Assessment,
        pose: &Rigid,
        rank: f64,
        rivals: &Rivals<'_>,
    ) -> Self {
        let Rivals { starts: rivals, own, alternatives } = *rivals;
        let apart = |other: &Rigid| pose.angle_to_deg(other) > APART_DEG;
        let others = rivals.iter().enumerate().filter(|(number, (p, _))| *number != own && apart(p));
        let rival = others.map(|(_, (_, rank))| *rank).fold(0.0, f64::max);
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
            log_false_alarms: assessment.chance.log_false_alarms.clamp(-LIMIT, LIMIT),
            least_margin: assessment.freedom.least_margin.min(LIMIT),
            certain_share: assessment.freedom.certain_share(),
            unbounded_share: assessment.freedom.unbounded_share(),
            challenger: alternatives.iter().map(|a| a.rank).fold(0.0, f64::max).min(2.0),
            chance_share: 0.5 * (assessment.chance.share_source + assessment.chance.share_target),
            affine_gain: assessment.affine.map_or(0.0, |fit| fit.gain),
            affine_bend: assessment.affine.map_or(0.0, |fit| fit.bend.min(5.0)),
            share_of_poses: 1.0 / (1.0 + alternatives.iter().map(|a| a.log_weight.exp()).sum::<f64>()),
        }
    }

    /// Those of the fit alone: as if no other pose had been looked for.
    #[must_use]
    pub fn alone(&self) -> Self {
        Self { challenger: 0.0, rival_support: 0.0, share_of_poses: 1.0, ..*self }
    }

    /// The numbers, in the order in which the calibration weighs them. Whether other starts agree is none of them,
    /// since an answer from a good first guess has one start, which is not moved; the share among poses is a bound of its own.
    fn values(&self) -> [f64; 15] {
        [
            self.fitness,
            self.overlap_target,
            self.inlier_rmse_over_spacing,
            self.support,
            self.residual_correlation,
            self.residual_median_over_spacing,
            self.deformed,
            self.chance_share,
            self.log_false_alarms / LIMIT,
            (self.least_margin.max(0.0) / LIMIT).sqrt(),
            self.affine_gain,
            self.affine_bend,
            self.challenger.min(2.0),
            self.rival_support.min(2.0),
            self.certain_share.max(LEAST_SHARE).ln(),
        ]
    }

    /// The features, their squares and their products in pairs.
    pub(crate) fn expanded(&self) -> Vec<f64> {
        let x = self.values();
        // NaN must not hide behind a largest or least value.
        let all = [
            self.rival_support,
            self.challenger,
            self.least_margin,
            self.share_of_poses,
            self.certain_share,
            self.unbounded_share,
        ];
        let nan = all.iter().any(|v| v.is_nan());
        let squares = x.iter().map(|v| v * v);
        let products = (0..x.len()).flat_map(|i| (i + 1..x.len()).map(move |j| x[i] * x[j]));
        x.iter().copied().chain(squares).chain(products).map(|v| if nan { f64::NAN } else { v }).collect()
    }
}

#[cfg(test)]
mod tests {
    use srrf_refine::{Chance, Freedom, Scatter};

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
        let assessment = Assessment {
            chance: Chance { log_false_alarms: -1e3, share_source: 0.1, share_target: 0.1 },
            freedom: Freedom { open: Vec::new(), least_margin: 7.0 },
            affine: None,
            spread: Scatter { covariance: nalgebra::Matrix6::zeros(), centre: nalgebra::Vector3::zeros() },
        };
        let turned = |degrees: f64| Rigid {
            rotation: *nalgebra::Rotation3::from_scaled_axis(nalgebra::Vector3::x() * degrees.to_radians())
                .matrix(),
            ..Rigid::identity()
        };
        let agreeing = |rivals: &[(Rigid, f64)]| {
            let rivals = Rivals { starts: rivals, own: 0, alternatives: &[] };
            Features::new(&evidence, None, &assessment, &turned(0.0), 0.5, &rivals).agreeing_starts
        };
        let all = {
            let none = Rivals { starts: &[], own: 0, alternatives: &[] };
            Features::new(&evidence, None, &assessment, &turned(0.0), 0.5, &none)
        };
        assert_eq!((all.log_false_alarms, all.least_margin, all.certain_share), (-100.0, 7.0, 1.0));
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
            "log_false_alarms",
            "least_margin",
            "certain_share",
            "unbounded_share",
            "share_of_poses",
            "challenger",
            "chance_share",
            "affine_gain",
            "affine_bend",
        ]
        .iter()
        .enumerate()
        .map(|(i, name)| ((*name).to_owned(), (i as f64).into()))
        .collect();
        let features: Features = serde_json::from_value(numbered.into()).unwrap();
        let want =
            [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 8.0, 16.0, 0.1, 0.11f64.sqrt(), 17.0, 18.0, 2.0, 2.0, 12f64.ln()];
        assert_eq!(features.values(), want);
        let all = features.expanded();
        assert_eq!((all.len(), all[15 + 6]), (15 + 15 + 15 * 14 / 2, 64.0));
        // The products begin with that of the first two, and end with that of the last two.
        assert_eq!((all[30 + 14], all[all.len() - 1]), (2.0, 2.0 * 12f64.ln()));
        assert!(Features { challenger: f64::NAN, ..features }.expanded()[0].is_nan());
    }
}
