//! What a run leaves: tables, curves, pictures and pages.
//!
//! A `Sheet` is one table, as Markdown, CSV and HTML; `sheets` makes them from a summary. The plain run
//! writes a few of them ([`write()`]); `srrf-eval tables` joins many, with curves and pictures, into a `document::Document`,
//! which is written as one page, as Markdown, and as pages of the book.

pub(crate) mod book;
pub(crate) mod curves;
pub(crate) mod document;
pub(crate) mod figures;
mod meta;
pub(crate) mod numbers;
pub(crate) mod page;
pub(crate) mod paper;
mod plain;
mod results;
pub(crate) mod sheet;
pub(crate) mod sheets;
pub(crate) mod write;

pub use meta::{Meta, machine};

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::EvalError;
use crate::answers::RunOutcome;
use crate::quantities::QUANTITIES;
use crate::summary::Summary;

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

/// The names of all files that [`write()`] may leave.
pub fn file_names() -> impl Iterator<Item = String> {
    let curves = QUANTITIES.iter().filter(|q| q.principal).map(|q| format!("curves_{}.svg", q.key));
    ["table.md", "table.csv", "results.json"].into_iter().map(str::to_owned).chain(curves)
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
    outcome: &RunOutcome,
) -> Result<Vec<PathBuf>, EvalError> {
    let mut written = Vec::new();
    let mut text = |name: &str, content: &str| {
        write::file(out, name, content)?;
        written.push(out.join(name));
        Ok::<_, EvalError>(())
    };
    text("table.md", &plain::markdown(summary, &meta.head()))?;
    text("table.csv", &plain::csv(summary))?;
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
    results::write(&path, meta, summary, outcome)
        .map_err(|source| EvalError::Output { path: path.clone(), source })?;
    written.push(path);
    Ok(written)
}

/// The tables for the screen.
pub fn screen(summary: &Summary) -> String {
    plain::screen(summary)
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
