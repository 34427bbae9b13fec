//! `results.json`: every answer on every pair, and the summary.

use std::io;
use std::path::Path;

use serde::{Serialize, Serializer};
use srrf_cloud::io::write_atomically;
use srrf_cloud::{EulerXyz, Rigid};

use super::Meta;
use crate::answers::{Answer, PairRecord, RunOutcome};
use crate::chamfer::SkeletonAgreement;
use crate::rows::TableRow;
use crate::summary::Summary;

/// Writes the file.
///
/// # Errors
/// Those of the file system.
pub(super) fn write(path: &Path, meta: &Meta, summary: &Summary, outcome: &RunOutcome) -> io::Result<()> {
    write_atomically(path, |out| {
        serde_json::to_writer(&mut *out, &ResultsFile { meta, summary, pairs: ResultPairs(outcome) })?;
        out.write_all(b"\n")
    })
}

#[derive(Serialize)]
struct ResultsFile<'a> {
    meta: &'a Meta,
    summary: &'a Summary,
    pairs: ResultPairs<'a>,
}

/// One object for each pair.
struct ResultPairs<'a>(&'a RunOutcome);

impl Serialize for ResultPairs<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.records.iter().map(|record| ResultPair::new(self.0, record)))
    }
}

#[derive(Serialize)]
struct ResultPair<'a> {
    corruption: &'a str,
    severity: u8,
    item: usize,
    id: &'a str,
    class: &'a str,
    symmetric: bool,
    true_euler_deg: [f64; 3],
    true_t: [f64; 3],
    methods: Answers<'a>,
}

impl<'a> ResultPair<'a> {
    fn new(outcome: &'a RunOutcome, record: &'a PairRecord) -> Self {
        let group = &outcome.groups[record.group];
        Self {
            corruption: &group.corruption,
            severity: group.severity,
            item: record.item,
            id: &record.id,
            class: &record.class,
            symmetric: record.symmetric,
            true_euler_deg: euler_deg(&record.truth),
            true_t: record.truth.translation.into(),
            methods: Answers(&outcome.rows, &record.answers),
        }
    }
}

fn euler_deg(pose: &Rigid) -> [f64; 3] {
    EulerXyz::from_matrix(&pose.rotation).to_deg()
}

/// The answers by name of the method, in the order of the tables.
struct Answers<'a>(&'a [TableRow], &'a [Answer]);

impl Serialize for Answers<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().zip(self.1).map(|(name, answer)| (name, AnswerRow::new(answer))))
    }
}

#[derive(Serialize)]
struct AnswerRow<'a> {
    /// The pose as Euler angles and translation; absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    euler_deg: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    t: Option<[f64; 3]>,
    error_euler_deg: [f64; 3],
    error_t: [f64; 3],
    rot_deg: f64,
    trans: f64,
    recalled: bool,
    failed: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    failure: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    chamfer: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    iterations: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    converged: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    seconds: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    skeletons: Option<SkeletonAgreement>,
    #[serde(skip_serializing_if = "Option::is_none")]
    right: Option<bool>,
    /// How sure the method is, and whether it says not to rely on the pose.
    #[serde(skip_serializing_if = "Option::is_none")]
    probability: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    abstain: Option<bool>,
}

impl<'a> AnswerRow<'a> {
    fn new(answer: &'a Answer) -> Self {
        let error = &answer.error;
        Self {
            euler_deg: answer.pose.as_ref().map(euler_deg),
            t: answer.pose.map(|p| p.translation.into()),
            error_euler_deg: error.euler_deg,
            error_t: error.translation,
            rot_deg: error.rotation_deg,
            trans: error.translation_norm,
            recalled: error.recalled(),
            failed: error.failed,
            failure: answer.failure.as_deref(),
            chamfer: error.chamfer,
            iterations: answer.iterations,
            converged: answer.converged,
            seconds: answer.seconds,
            skeletons: answer.skeletons,
            right: error.right,
            probability: answer.certainty.map(|c| c.probability),
            abstain: answer.certainty.map(|c| c.abstain),
        }
    }
}
