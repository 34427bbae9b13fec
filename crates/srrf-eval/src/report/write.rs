//! The files of the report.

use std::io;
use std::path::Path;

use serde::Serialize;
use srrf_cloud::io::write_atomically;

use super::document::Document;
use super::page;
use crate::EvalError;
use crate::summary::Summary;

/// What was scored in one part of the report.
#[derive(Serialize)]
pub(crate) struct ReportPart<'a> {
    /// Name of the part, or of the network of a variant.
    pub part: &'a str,
    /// The data, and how the pairs were made.
    pub data: &'a str,
    /// Its scores.
    pub summary: &'a Summary,
}

/// Writes the report to the folder `out`, file by file under temporary names, and gives their names.
///
/// # Errors
/// [`EvalError::Output`] names the file that cannot be written.
pub(crate) fn all(
    out: &Path,
    document: &Document,
    parts: &[ReportPart<'_>],
) -> Result<Vec<String>, EvalError> {
    let mut names = Vec::new();
    let mut put = |name: String, content: &str| {
        file(out, &name, content)?;
        names.push(name);
        Ok::<_, EvalError>(())
    };
    put("report.html".into(), &page::html(document))?;
    put("tables.md".into(), &document.markdown())?;
    put("results.json".into(), &json(document, parts)?)?;
    for sheet in document.sheets() {
        put(format!("{}.csv", sheet.key), &sheet.csv())?;
    }
    for figure in document.figures() {
        put(figure.file.clone(), &figure.svg)?;
    }
    Ok(names)
}

/// Writes one file, whole or not at all.
///
/// # Errors
/// [`EvalError::Output`] names it.
pub(crate) fn file(out: &Path, name: &str, content: &str) -> Result<(), EvalError> {
    let path = out.join(name);
    write_atomically(&path, |file| file.write_all(content.as_bytes()))
        .map_err(|source| EvalError::Output { path, source })
}

/// All summaries, with where they come from.
fn json(document: &Document, parts: &[ReportPart<'_>]) -> Result<String, EvalError> {
    #[derive(Serialize)]
    struct ResultsFile<'a> {
        facts: &'a [(String, String)],
        parts: &'a [ReportPart<'a>],
    }
    let results = ResultsFile { facts: &document.facts, parts };
    serde_json::to_string(&results)
        .map(|text| text + "\n")
        .map_err(|e| EvalError::Output { path: "results.json".into(), source: io::Error::from(e) })
}
