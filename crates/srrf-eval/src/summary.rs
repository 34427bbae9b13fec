//! The summary: scores per corruption or group, severity and method.

use serde::{Serialize, Serializer};

use crate::EvalError;
use crate::answers::RunOutcome;
use crate::certainty::{CertaintyScores, Claim};
use crate::chamfer::SkeletonAgreement;
use crate::metrics::{PoseError, Scores};
use crate::protocol::CLEAN;
use crate::rows::TableRow;

/// Which severities a row of the summary covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeverityKey {
    /// One severity; 0 for clean pairs and groups of a file.
    One(u8),
    /// The mean over the severities that were run.
    Mean,
}

impl std::fmt::Display for SeverityKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::One(severity) => severity.fmt(f),
            Self::Mean => f.write_str("mean"),
        }
    }
}

impl Serialize for SeverityKey {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::One(severity) => serializer.serialize_u8(*severity),
            Self::Mean => serializer.serialize_str("mean"),
        }
    }
}

/// One row of the summary.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SummaryRow {
    /// The corruption, `clean`, or the group of a file.
    pub corruption: String,
    /// A number, or `mean`: the mean of the values of the severities.
    pub severity: SeverityKey,
    /// The row of the tables.
    pub method: TableRow,
    /// Scores over all pairs.
    #[serde(flatten)]
    pub scores: Scores,
    /// Mean time of one pair, in seconds; `None` for transforms from a file.
    pub seconds_per_pair: Option<f64>,
    /// Scores without the classes that are symmetric about an axis; `None` where all are.
    pub no_symmetric: Option<Scores>,
    /// How well the skeletons agree; `None` for methods without skeletons.
    pub skeletons: Option<SkeletonAgreement>,
    /// How well the method knows whether it is right, over all pairs of these severities; `None` for methods that do not say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certainty: Option<CertaintyScores>,
}

/// All rows: corruption by corruption; in each the severities, then their mean; in each the methods
/// in the order of the tables.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Summary {
    /// The rows.
    pub rows: Vec<SummaryRow>,
}

impl Summary {
    /// CertaintySums up a run.
    ///
    /// # Errors
    /// [`EvalError::Metric`] where a true pose is not finite.
    pub fn of(outcome: &RunOutcome) -> Result<Self, EvalError> {
        let mut rows: Vec<SummaryRow> = Vec::new();
        let mut start = 0;
        while start < outcome.groups.len() {
            let corruption = &outcome.groups[start].corruption;
            let end = outcome.groups[start..]
                .iter()
                .position(|g| g.corruption != *corruption)
                .map_or(outcome.groups.len(), |n| start + n);
            let first = rows.len();
            for group in start..end {
                for method in 0..outcome.rows.len() {
                    rows.push(row(outcome, group, method)?);
                }
            }
            for method in &outcome.rows {
                let of_method: Vec<&SummaryRow> =
                    rows[first..].iter().filter(|r| r.method == *method).collect();
                rows.extend(mean(&of_method));
            }
            start = end;
        }
        Ok(Self { rows })
    }

    /// The row of these keys.
    pub fn get(&self, corruption: &str, severity: SeverityKey, method: &TableRow) -> Option<&SummaryRow> {
        self.rows.iter().find(|r| r.corruption == corruption && r.severity == severity && r.method == *method)
    }

    /// The corruptions or groups, in order.
    pub fn corruptions(&self) -> Vec<&str> {
        distinct(self.rows.iter().map(|r| r.corruption.as_str()))
    }

    /// The methods, in order.
    pub fn methods(&self) -> Vec<&TableRow> {
        distinct(self.rows.iter().map(|r| &r.method))
    }

    /// How well a method knows whether it is right, over all pairs; `None` for methods that do not say.
    pub fn certainty(&self, method: &TableRow) -> Option<CertaintyScores> {
        let means = self.rows.iter().filter(|r| r.method == *method && r.severity == SeverityKey::Mean);
        CertaintyScores::together(means.filter_map(|r| r.certainty.as_ref()))
    }

    /// The mean of a value over the corruptions, clean pairs aside; `None` where one lacks it, and where
    /// there are fewer than two.
    pub(crate) fn over_corruptions(
        &self,
        method: &TableRow,
        value: impl Fn(&SummaryRow) -> Option<f64>,
    ) -> Option<f64> {
        let corruptions = self.corruptions().into_iter().filter(|c| *c != CLEAN);
        let row = |corruption| self.get(corruption, SeverityKey::Mean, method);
        let values: Vec<f64> = corruptions.map(|c| row(c).and_then(&value)).collect::<Option<_>>()?;
        (values.len() > 1).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }

    /// The severities above 0, ascending.
    pub fn severities(&self) -> Vec<u8> {
        let mut severities: Vec<u8> = self
            .rows
            .iter()
            .filter_map(|r| match r.severity {
                SeverityKey::One(s) if s > 0 => Some(s),
                _ => None,
            })
            .collect();
        severities.sort_unstable();
        severities.dedup();
        severities
    }
}

fn distinct<'a, T: PartialEq + ?Sized>(names: impl Iterator<Item = &'a T>) -> Vec<&'a T> {
    let mut seen = Vec::new();
    names.for_each(|name| {
        if !seen.contains(&name) {
            seen.push(name)
        }
    });
    seen
}

/// One group and method.
fn row(outcome: &RunOutcome, group: usize, method: usize) -> Result<SummaryRow, EvalError> {
    let of_group = || outcome.records.iter().filter(|r| r.group == group);
    let errors: Vec<PoseError> = of_group().map(|r| r.answers[method].error).collect();
    let asymmetric: Vec<PoseError> =
        of_group().filter(|r| !r.symmetric).map(|r| r.answers[method].error).collect();
    let seconds: Vec<f64> = of_group().filter_map(|r| r.answers[method].seconds).collect();
    let skeletons: Vec<SkeletonAgreement> = of_group().filter_map(|r| r.answers[method].skeletons).collect();
    // A method that is sure of one pose in the whole run is one that says so; what it does not answer counts.
    let says = outcome.records.iter().any(|r| r.answers[method].certainty.is_some());
    let claims: Vec<Claim> =
        of_group().filter(|_| says).map(|r| r.answers[method].claim().unwrap_or(Claim::NO_POSE)).collect();
    let scores = |errors: &[PoseError]| {
        Scores::from_errors(errors).map_err(|source| EvalError::Metric {
            group: outcome.groups[group].name(),
            method: outcome.rows[method].to_string(),
            source,
        })
    };
    Ok(SummaryRow {
        corruption: outcome.groups[group].corruption.clone(),
        severity: SeverityKey::One(outcome.groups[group].severity),
        method: outcome.rows[method].clone(),
        scores: scores(&errors)?,
        seconds_per_pair: (!seconds.is_empty()).then(|| seconds.iter().sum::<f64>() / seconds.len() as f64),
        no_symmetric: (!asymmetric.is_empty()).then(|| scores(&asymmetric)).transpose()?,
        skeletons: SkeletonAgreement::mean(&skeletons),
        certainty: CertaintyScores::of(&claims),
    })
}

/// The mean over severities of one method.
fn mean(rows: &[&SummaryRow]) -> Option<SummaryRow> {
    let first = rows.first()?;
    let scores: Vec<Scores> = rows.iter().map(|r| r.scores).collect();
    let asymmetric: Vec<Scores> = rows.iter().filter_map(|r| r.no_symmetric).collect();
    let seconds: Vec<f64> = rows.iter().filter_map(|r| r.seconds_per_pair).collect();
    let skeletons: Vec<SkeletonAgreement> = rows.iter().filter_map(|r| r.skeletons).collect();
    Some(SummaryRow {
        corruption: first.corruption.clone(),
        severity: SeverityKey::Mean,
        method: first.method.clone(),
        scores: Scores::mean(&scores)?,
        seconds_per_pair: (!seconds.is_empty()).then(|| seconds.iter().sum::<f64>() / seconds.len() as f64),
        no_symmetric: Scores::mean(&asymmetric),
        skeletons: SkeletonAgreement::mean(&skeletons),
        certainty: CertaintyScores::together(rows.iter().filter_map(|r| r.certainty.as_ref())),
    })
}

#[cfg(test)]
pub(crate) mod tests {
    use srrf_cloud::{Certainty, EulerXyz, Rigid};

    use super::*;
    use crate::answers::{Answer, PairRecord};
    use crate::pairs::Group;

    /// Clean and cutout at severities 1 and 3, two pairs each, one of them symmetric. Method `a` is
    /// off by 1 degree per severity (2 on symmetric shapes), `b` by 10 times as much; `b` says how sure it is.
    pub(crate) fn outcome() -> RunOutcome {
        let group = |corruption: &str, severity| Group { corruption: corruption.into(), severity, pairs: 2 };
        let groups = vec![group("clean", 0), group("cutout", 1), group("cutout", 3)];
        let mut records = Vec::new();
        for (index, group) in groups.iter().enumerate() {
            for item in 0..2 {
                let symmetric = item == 1;
                let answers = [1.0, 10.0].map(|scale| {
                    let angle = scale * f64::from(group.severity) * if symmetric { 2.0 } else { 1.0 };
                    let rotation = EulerXyz::from_deg([angle, 0.0, 0.0]).to_matrix();
                    let pose = Rigid { rotation, ..Rigid::identity() };
                    let error = PoseError::new(Some(&pose), &Rigid::identity());
                    Answer {
                        error: PoseError { right: Some(error.rotation_deg < 5.0), ..error },
                        pose: Some(pose),
                        failure: None,
                        iterations: Some(4),
                        converged: Some(true),
                        seconds: Some(0.5),
                        skeletons: (scale > 1.0).then_some(SkeletonAgreement {
                            chamfer: 1e-4 * f64::from(group.severity),
                            chamfer_sum: 2.0,
                            spread: 0.3,
                        }),
                        certainty: (scale > 1.0)
                            .then_some(Certainty { probability: 0.9, abstain: group.severity > 1 }),
                    }
                });
                records.push(PairRecord {
                    group: index,
                    item,
                    id: format!("shape_{item}"),
                    class: if symmetric { "vase".into() } else { "chair".into() },
                    symmetric,
                    truth: Rigid::identity(),
                    answers: answers.to_vec(),
                });
            }
        }
        RunOutcome { groups, rows: vec![TableRow::method("a"), TableRow::method("b")], records }
    }

    #[test]
    fn rows_severities_means_and_symmetry() {
        let summary = Summary::of(&outcome()).unwrap();
        let keys: Vec<String> =
            summary.rows.iter().map(|r| format!("{} {} {}", r.corruption, r.severity, r.method)).collect();
        assert_eq!(
            keys,
            [
                "clean 0 a",
                "clean 0 b",
                "clean mean a",
                "clean mean b",
                "cutout 1 a",
                "cutout 1 b",
                "cutout 3 a",
                "cutout 3 b",
                "cutout mean a",
                "cutout mean b"
            ]
        );
        let at = |severity| summary.get("cutout", severity, &TableRow::method("a")).unwrap();
        let three = at(SeverityKey::One(3));
        assert!((three.scores.mean_rot_deg - 4.5).abs() < 1e-9);
        assert!((three.no_symmetric.unwrap().mean_rot_deg - 3.0).abs() < 1e-9);
        assert_eq!((three.scores.pairs, three.no_symmetric.unwrap().pairs), (2, 1));
        let mean = at(SeverityKey::Mean);
        assert!(
            (mean.scores.rmse_r - (at(SeverityKey::One(1)).scores.rmse_r + three.scores.rmse_r) / 2.0).abs()
                < 1e-12
        );
        assert_eq!(mean.seconds_per_pair, Some(0.5));
        assert_eq!(summary.corruptions(), ["clean", "cutout"]);
        assert_eq!(summary.severities(), [1, 3]);
    }

    #[test]
    fn the_fields_that_readers_rely_on() {
        let summary = Summary::of(&outcome()).unwrap();
        let json = serde_json::to_value(&summary).unwrap();
        let (first, mean) = (&json[0], &json[2]);
        assert_eq!(first["severity"], 0);
        assert_eq!(mean["severity"], "mean");
        for field in [
            "corruption",
            "method",
            "mse_r",
            "rmse_r",
            "mae_r",
            "mse_t",
            "rmse_t",
            "mae_t",
            "median_rot_deg",
            "recall",
            "pairs",
            "seconds_per_pair",
        ] {
            assert!(!first[field].is_null() && !mean[field].is_null(), "{field}");
        }
        assert_eq!(first["no_symmetric"]["pairs"], 1);
        assert!(json[0]["skeletons"].is_null());
        assert_eq!(json[1]["skeletons"]["spread"], 0.3);
    }

    /// `b` says 0.9 everywhere and abstains at severity 3; it is right on clean pairs only.
    #[test]
    fn certainty_is_over_all_pairs_of_a_corruption_and_of_the_run() {
        let summary = Summary::of(&outcome()).unwrap();
        let b = TableRow::method("b");
        let of =
            |corruption: &str| summary.get(corruption, SeverityKey::Mean, &b).unwrap().certainty.unwrap();
        assert_eq!((of("clean").right_of_answered, of("clean").answered), (Some(1.0), 1.0));
        let cutout = of("cutout");
        assert_eq!((cutout.pairs, cutout.answered, cutout.right_of_answered), (4, 0.5, Some(0.0)));
        assert!((cutout.brier - 0.81).abs() < 1e-12 && (cutout.calibration_error - 0.9).abs() < 1e-12);
        let all = summary.certainty(&b).unwrap();
        assert_eq!((all.pairs, all.answered), (6, 4.0 / 6.0));
        assert!(summary.certainty(&TableRow::method("a")).is_none(), "a does not say");
        let json = serde_json::to_value(&summary).unwrap();
        assert_eq!(json[1]["certainty"]["pairs"], 2);
        assert!(json[0].get("certainty").is_none());
    }
}
