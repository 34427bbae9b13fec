//! The report: `table.md`, `table.csv`, `results.json` and the severity curves.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Serialize, Serializer};
use srrf_cloud::io::write_atomically;
use srrf_cloud::{EulerXyz, Rigid};

use crate::chamfer::SkeletonAgreement;
use crate::run::{Answer, Outcome, PairRecord};
use crate::summary::Summary;
use crate::{EvalError, curves, quantities::QUANTITIES, table};

/// Where a result comes from: what is needed to get it again.
#[derive(Debug, Clone, Serialize)]
pub struct Meta {
    /// Version of this program.
    pub version: String,
    /// The command line.
    pub command: String,
    /// The data, the split, and how the pairs were made.
    pub data: String,
    /// Seed of the pairs.
    pub seed: u64,
    /// For each method that learns, its weights.
    pub weights: BTreeMap<String, String>,
    /// Where tensors lived.
    pub device: String,
    /// Worker threads.
    pub threads: usize,
    /// Processor and number of cores.
    pub machine: String,
    /// Duration of the whole run, in seconds.
    pub seconds: f64,
    /// Start of the run, in seconds since 1970.
    pub started_unix: u64,
}

impl Meta {
    /// The lines above the tables.
    fn head(&self) -> String {
        let mut head = format!("- Data: {}\n- Seed: {}\n", self.data, self.seed);
        for (method, weights) in &self.weights {
            head += &format!("- Weights of {method}: {weights}\n");
        }
        head + &format!(
            "- Run: version {}, {:.0} s on {} threads of {}, device {}\n- Command: `{}`\n",
            self.version, self.seconds, self.threads, self.machine, self.device, self.command
        )
    }
}

/// Processor and number of cores of this machine, as far as the system tells.
pub fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let model = fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|l| l.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    });
    format!("{} with {cores} cores", model.unwrap_or_else(|| std::env::consts::ARCH.to_owned()))
}

/// Makes the folder `out` and checks that it can be written to.
///
/// # Errors
/// [`EvalError::OutDir`] if not.
pub fn prepare(out: &Path) -> Result<(), EvalError> {
    fs::create_dir_all(out)
        .and_then(|()| tempfile::tempfile_in(out))
        .map(drop)
        .map_err(|source| EvalError::OutDir { path: out.to_owned(), source })
}

/// Writes the whole report to the folder `out`, file by file under temporary names, and gives the
/// paths. Curves of an earlier run that this run does not draw are removed.
///
/// # Errors
/// [`EvalError::Output`] or [`EvalError::Picture`] names the file that cannot be written.
pub fn write(
    out: &Path,
    meta: &Meta,
    summary: &Summary,
    outcome: &Outcome,
) -> Result<Vec<PathBuf>, EvalError> {
    let mut written = Vec::new();
    let mut text = |name: &str, content: &str| {
        let path = out.join(name);
        write_atomically(&path, |out| out.write_all(content.as_bytes()))
            .map_err(|source| EvalError::Output { path: path.clone(), source })?;
        written.push(path);
        Ok::<_, EvalError>(())
    };
    text("table.md", &table::markdown(summary, &meta.head()))?;
    text("table.csv", &table::csv(summary))?;
    for quantity in QUANTITIES.iter().filter(|q| q.principal) {
        let name = format!("curves_{}.svg", quantity.key);
        let path = out.join(&name);
        match curves::svg(quantity, summary) {
            Ok(Some(svg)) => text(&name, &svg)?,
            Ok(None) => match fs::remove_file(&path) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(EvalError::Output { path, source });
                }
                _ => {}
            },
            Err(problem) => return Err(EvalError::Picture { path, problem }),
        }
    }
    let path = out.join("results.json");
    results(&path, meta, summary, outcome)
        .map_err(|source| EvalError::Output { path: path.clone(), source })?;
    written.push(path);
    Ok(written)
}

/// The tables for the screen.
pub fn screen(summary: &Summary) -> String {
    table::screen(summary)
}

fn results(path: &Path, meta: &Meta, summary: &Summary, outcome: &Outcome) -> io::Result<()> {
    write_atomically(path, |out| {
        serde_json::to_writer(&mut *out, &Results { meta, summary, pairs: Pairs(outcome) })?;
        out.write_all(b"\n")
    })
}

#[derive(Serialize)]
struct Results<'a> {
    meta: &'a Meta,
    summary: &'a Summary,
    pairs: Pairs<'a>,
}

/// One object for each pair.
struct Pairs<'a>(&'a Outcome);

impl Serialize for Pairs<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.records.iter().map(|record| PairRow::new(self.0, record)))
    }
}

#[derive(Serialize)]
struct PairRow<'a> {
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

impl<'a> PairRow<'a> {
    fn new(outcome: &'a Outcome, record: &'a PairRecord) -> Self {
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
struct Answers<'a>(&'a [String], &'a [Answer]);

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
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::outcome;

    fn meta() -> Meta {
        Meta {
            version: "1".into(),
            command: "srrf-eval".into(),
            data: "shapes".into(),
            seed: 5,
            weights: [("a".to_owned(), "built in".to_owned())].into(),
            device: "flex".into(),
            threads: 2,
            machine: machine(),
            seconds: 1.5,
            started_unix: 0,
        }
    }

    #[test]
    fn every_file_is_written_and_the_json_holds_every_pair() {
        let folder = tempfile::tempdir().unwrap();
        let (outcome, out) = (outcome(), folder.path());
        let summary = Summary::of(&outcome).unwrap();
        let written = write(out, &meta(), &summary, &outcome).unwrap();
        assert!(written.iter().all(|p| p.is_file()));
        assert_eq!(fs::read_dir(out).unwrap().count(), written.len(), "no temporary file is left");
        assert!(out.join("curves_rmse_r.svg").is_file());
        let json: serde_json::Value =
            serde_json::from_slice(&fs::read(out.join("results.json")).unwrap()).unwrap();
        assert_eq!(json["meta"]["weights"]["a"], "built in");
        assert_eq!(json["summary"].as_array().unwrap().len(), summary.rows.len());
        let pairs = json["pairs"].as_array().unwrap();
        assert_eq!(pairs.len(), 6);
        assert_eq!(pairs[4]["corruption"], "cutout");
        assert_eq!(pairs[4]["severity"], 3);
        assert!((pairs[4]["methods"]["b"]["rot_deg"].as_f64().unwrap() - 30.0).abs() < 1e-9);

        // Without severities there are no curves, not even old ones.
        let mut clean = outcome.clone();
        clean.groups.truncate(1);
        clean.records.truncate(2);
        write(out, &meta(), &Summary::of(&clean).unwrap(), &clean).unwrap();
        assert!(!out.join("curves_rmse_r.svg").exists());
    }

    #[test]
    fn a_folder_that_cannot_be_is_refused_at_the_start() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let error = prepare(&file.path().join("report")).unwrap_err();
        assert!(error.to_string().contains("--output"), "{error}");
        assert!(error.is_usage());
    }
}
