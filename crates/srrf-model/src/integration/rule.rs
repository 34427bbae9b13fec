//! The rules by which the poses of the two branches are blended, each with its own numbers.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::defaults;

/// How the two poses are blended: what counts as an inlier, and what the inliers of both say of lambda. In files it is a table
/// whose `test` names the rule.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "test", rename_all = "snake_case", try_from = "IntegrationFile")]
pub enum IntegrationRule {
    /// The paper's words: a correspondence `x_i -> yhat_i` is an inlier when
    /// `|R x_i + t - yhat_i| < tau`. Soft matches shrink towards the centroid, more so where there
    /// are more of them, so the ratios of the two branches are not on one scale.
    SoftMatch(BranchRatios),
    /// The same test for both branches: a point of the full source cloud is an inlier when the
    /// branch's pose brings it closer than `tau` to the target cloud.
    Nearest(BranchRatios),
    /// As [`IntegrationRule::Nearest`], from both sides: the mean of the shares of source points near the target
    /// and of target points near the source.
    BothWays(BranchRatios),
    /// The paper's words for both poses with one set of correspondences, the dense branch's. They favour the dense pose, which
    /// was fitted to them: where the skeleton's makes more of them inliers, outliers have drawn the fit away.
    Common(CommonRatios),
    /// The inliers of [`IntegrationRule::Common`], and a decision instead of a weight: the skeleton branch's pose where it is
    /// ahead beyond chance, and the dense one's elsewhere.
    #[serde(rename = "mcnemar")]
    McNemar(McNemar),
}

/// Lambda is `g_c^p / (g_c^p + (w g_s)^p)`, of the inlier ratios `g_c` and `g_s` of the two branches by a threshold each.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct BranchRatios {
    /// Inlier threshold of the dense branch, in network units (clouds of unit radius). RGM: 0.05.
    pub dense_threshold: f64,
    /// Inlier threshold of the skeleton branch, network units; its spacing is 4 times as wide.
    pub skeleton_threshold: f64,
    /// The `p` above; the paper's is 1.
    pub sharpness: f64,
    /// The `w` above. Below 1 the skeleton branch wins only where its pose has that much more inliers: of two poses that
    /// fit about as well, the dense branch's is the better one more often. The paper: 1.
    #[serde(skip_serializing_if = "defaults::is_one")]
    pub skeleton_weight: f64,
}

/// As [`BranchRatios`], by one threshold.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CommonRatios {
    /// Inlier threshold, network units.
    pub threshold: f64,
    /// See [`BranchRatios::sharpness`].
    pub sharpness: f64,
    /// See [`BranchRatios::skeleton_weight`].
    #[serde(skip_serializing_if = "defaults::is_one")]
    pub skeleton_weight: f64,
}

/// Lambda is 0 where the skeleton branch is ahead by more than so many standard errors, and 1 elsewhere (McNemar 1947: of the
/// correspondences that are inliers of one pose alone, `n_s` and `n_c`, that is `n_s - n_c > z sqrt(n_s + n_c)`).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct McNemar {
    /// Inlier threshold, network units.
    pub threshold: f64,
    /// The `z` above.
    pub standard_errors: f64,
}

/// What the inlier ratios of two branches say: `g_c^p / (g_c^p + (w g_s)^p)`, and 0.5 where both are 0.
pub(super) fn weigh(dense: f64, skeleton: f64, sharpness: f64, skeleton_weight: f64) -> f64 {
    let (c, s) = (dense.powf(sharpness), (skeleton_weight * skeleton).powf(sharpness));
    if c + s > 0.0 { c / (c + s) } else { 0.5 }
}

impl IntegrationRule {
    /// Name of the rule, as in files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::SoftMatch(_) => "soft_match",
            Self::Nearest(_) => "nearest",
            Self::BothWays(_) => "both_ways",
            Self::Common(_) => "common",
            Self::McNemar(_) => "mcnemar",
        }
    }

    /// The first number that is out of its range, as its key and what it must be.
    pub(crate) fn wrong(&self) -> Option<(&'static str, &'static str)> {
        let threshold = |key, value: f64| {
            (!(value.is_finite() && value > 0.0))
                .then_some((key, "must be a number above 0, in network units"))
        };
        let at_least_0 = |key, value: f64, why| (!(value.is_finite() && value >= 0.0)).then_some((key, why));
        let ratios = |sharpness, weight| {
            at_least_0("sharpness", sharpness, "must be 0 or more; 1 is the paper").or(at_least_0(
                "skeleton_weight",
                weight,
                "must be 0 or more; 1 is the paper",
            ))
        };
        match self {
            Self::SoftMatch(rule) | Self::Nearest(rule) | Self::BothWays(rule) => {
                threshold("dense_threshold", rule.dense_threshold)
                    .or(threshold("skeleton_threshold", rule.skeleton_threshold))
                    .or(ratios(rule.sharpness, rule.skeleton_weight))
            }
            Self::Common(rule) => {
                threshold("threshold", rule.threshold).or(ratios(rule.sharpness, rule.skeleton_weight))
            }
            Self::McNemar(rule) => threshold("threshold", rule.threshold).or(at_least_0(
                "standard_errors",
                rule.standard_errors,
                "must be 0 or more",
            )),
        }
    }
}

impl fmt::Display for IntegrationRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.name();
        let times = |f: &mut fmt::Formatter<'_>, weight: f64| match weight == 1.0 {
            true => Ok(()),
            false => write!(f, ", skeleton times {weight}"),
        };
        match self {
            Self::SoftMatch(rule) | Self::Nearest(rule) | Self::BothWays(rule) => {
                let BranchRatios { dense_threshold, skeleton_threshold, sharpness, skeleton_weight } = rule;
                write!(f, "{name} {dense_threshold} {skeleton_threshold}, sharpness {sharpness}")?;
                times(f, *skeleton_weight)
            }
            Self::Common(CommonRatios { threshold, sharpness, skeleton_weight }) => {
                write!(f, "{name} {threshold}, sharpness {sharpness}")?;
                times(f, *skeleton_weight)
            }
            Self::McNemar(McNemar { threshold, standard_errors }) => {
                write!(f, "{name} {threshold}, {standard_errors} standard errors")
            }
        }
    }
}

/// The rule in a file. Headers of version 0.1.0 have numbers that their rule does not use, `skeleton_threshold` with `common`
/// and `sharpness` with `standard_errors`: they are read, and left out.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "IntegrationRule")]
struct IntegrationFile {
    /// The rule: what counts as an inlier, and what the inliers of both branches say of lambda.
    test: RuleName,
    /// Inlier threshold of the dense branch, in network units (clouds of unit radius). RGM: 0.05. Not with `mcnemar`.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0))]
    dense_threshold: Option<f64>,
    /// Inlier threshold of the skeleton branch, network units; its spacing is 4 times as wide. Not with `common` and `mcnemar`.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0))]
    skeleton_threshold: Option<f64>,
    /// Inlier threshold of `common` and `mcnemar`, network units.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0))]
    threshold: Option<f64>,
    /// Lambda is `g_c^p / (g_c^p + (w g_s)^p)` with this `p`; the paper's is 1. Not with `mcnemar`.
    #[schemars(range(min = 0.0, max = 1e4))]
    sharpness: Option<f64>,
    /// The `w` above. Below 1 the skeleton branch wins only where its pose has that much more inliers. Default and the
    /// paper: 1. Not with `mcnemar`.
    #[schemars(range(min = 0.0, max = 100.0), extend("default" = 1.0))]
    skeleton_weight: Option<f64>,
    /// With `mcnemar`: lambda is 0 where the skeleton branch is ahead by more than so many standard errors, and 1 elsewhere.
    #[schemars(range(min = 0.0, max = 1e4))]
    standard_errors: Option<f64>,
}

/// Names of the rules in files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum RuleName {
    /// A correspondence of a branch is an inlier when its residual is below the threshold of the branch: the paper's words.
    SoftMatch,
    /// A point of the source is an inlier when the branch's pose brings it near the target.
    Nearest,
    /// The same from both sides.
    BothWays,
    /// The correspondences of the dense branch judge both poses.
    Common,
    /// The same, and the skeleton branch's pose where it is ahead beyond chance.
    #[serde(rename = "mcnemar")]
    McNemar,
}

impl TryFrom<IntegrationFile> for IntegrationRule {
    type Error = String;

    fn try_from(file: IntegrationFile) -> Result<Self, String> {
        let needed = |key: &str, value: Option<f64>| value.ok_or_else(|| format!("missing field `{key}`"));
        let idle = |key: &str, value: Option<f64>| match value {
            Some(_) => Err(format!("`{key}` does nothing with this `test`; leave it out")),
            None => Ok(()),
        };
        let skeleton_weight = file.skeleton_weight.unwrap_or(1.0);
        let make: fn(BranchRatios) -> Self = match file.test {
            RuleName::SoftMatch => Self::SoftMatch,
            RuleName::Nearest => Self::Nearest,
            RuleName::BothWays => Self::BothWays,
            // As version 0.1.0 wrote the two rules below.
            RuleName::Common if file.dense_threshold.is_some() => {
                let threshold = needed("dense_threshold", file.dense_threshold)?;
                return Ok(match file.standard_errors {
                    Some(standard_errors) => Self::McNemar(McNemar { threshold, standard_errors }),
                    None => Self::Common(CommonRatios {
                        threshold,
                        sharpness: needed("sharpness", file.sharpness)?,
                        skeleton_weight,
                    }),
                });
            }
            RuleName::Common | RuleName::McNemar => {
                idle("dense_threshold", file.dense_threshold)?;
                idle("skeleton_threshold", file.skeleton_threshold)?;
                let threshold = needed("threshold", file.threshold)?;
                if file.test == RuleName::Common {
                    idle("standard_errors", file.standard_errors)?;
                    let sharpness = needed("sharpness", file.sharpness)?;
                    return Ok(Self::Common(CommonRatios { threshold, sharpness, skeleton_weight }));
                }
                idle("sharpness", file.sharpness)?;
                idle("skeleton_weight", file.skeleton_weight)?;
                let standard_errors = needed("standard_errors", file.standard_errors)?;
                return Ok(Self::McNemar(McNemar { threshold, standard_errors }));
            }
        };
        idle("threshold", file.threshold)?;
        idle("standard_errors", file.standard_errors)?;
        Ok(make(BranchRatios {
            dense_threshold: needed("dense_threshold", file.dense_threshold)?,
            skeleton_threshold: needed("skeleton_threshold", file.skeleton_threshold)?,
            sharpness: needed("sharpness", file.sharpness)?,
            skeleton_weight,
        }))
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn read(value: serde_json::Value) -> Result<IntegrationRule, String> {
        serde_json::from_value(value).map_err(|e| e.to_string())
    }

    #[test]
    fn headers_of_version_0_1_0_are_read() {
        let srrf = json!({ "test": "common", "dense_threshold": 0.02, "skeleton_threshold": 0.03, "sharpness": 64.0,
            "skeleton_weight": 0.8, "standard_errors": 4.0 });
        let rule = IntegrationRule::McNemar(McNemar { threshold: 0.02, standard_errors: 4.0 });
        assert_eq!(read(srrf).unwrap(), rule);
        let common = json!({ "test": "common", "dense_threshold": 0.02, "skeleton_threshold": 0.03, "sharpness": 2.0 });
        let ratios = CommonRatios { threshold: 0.02, sharpness: 2.0, skeleton_weight: 1.0 };
        assert_eq!(read(common).unwrap(), IntegrationRule::Common(ratios));
    }

    #[test]
    fn every_rule_comes_back_and_has_no_number_that_does_nothing() {
        let ratios = |skeleton_weight| BranchRatios {
            dense_threshold: 0.03,
            skeleton_threshold: 0.04,
            sharpness: 64.0,
            skeleton_weight,
        };
        let common = CommonRatios { threshold: 0.02, sharpness: 1.0, skeleton_weight: 0.5 };
        for rule in [
            IntegrationRule::SoftMatch(ratios(1.0)),
            IntegrationRule::Nearest(ratios(0.8)),
            IntegrationRule::BothWays(ratios(0.8)),
            IntegrationRule::Common(common),
            IntegrationRule::McNemar(McNemar { threshold: 0.02, standard_errors: 4.0 }),
        ] {
            let value = serde_json::to_value(&rule).unwrap();
            assert_eq!(value["test"], rule.name());
            assert_eq!(read(value.clone()).unwrap(), rule);
            for idle in ["threshold", "standard_errors", "skeleton_threshold", "sharpness"] {
                let mut more = value.clone();
                if more.get(idle).is_none() {
                    more[idle] = json!(1.0);
                    let said = read(more).unwrap_err();
                    assert!(said.contains(&format!("`{idle}` does nothing")), "{said}");
                }
            }
            assert!(rule.to_string().starts_with(rule.name()));
        }
        // As files of version 0.1.0 have it, byte for byte.
        let text = serde_json::to_string(&IntegrationRule::SoftMatch(ratios(1.0))).unwrap();
        assert_eq!(
            text,
            r#"{"test":"soft_match","dense_threshold":0.03,"skeleton_threshold":0.04,"sharpness":64.0}"#
        );
        let said = read(json!({ "test": "nearest", "dense_threshold": 0.03, "sharpness": 1.0 })).unwrap_err();
        assert!(said.contains("missing field `skeleton_threshold`"), "{said}");
    }
}
