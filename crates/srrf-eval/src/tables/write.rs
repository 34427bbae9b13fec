//! The files of the report.

use std::io;
use std::path::Path;

use serde::Serialize;
use srrf_cloud::io::write_atomically;

use super::document::Document;
use super::options::TablesOptions;
use super::{Evidence, page};
use crate::EvalError;
use crate::summary::Summary;

/// Writes the report, file by file under temporary names, and gives their names.
///
/// # Errors
/// [`EvalError::Output`] names the file that cannot be written.
pub(super) fn all(
    options: &TablesOptions,
    document: &Document,
    evidence: &Evidence,
) -> Result<Vec<String>, EvalError> {
    let mut names = Vec::new();
    let mut put = |name: String, content: &str| {
        write(&options.out, &name, content)?;
        names.push(name);
        Ok::<_, EvalError>(())
    };
    put("report.html".into(), &page::html(document))?;
    put("tables.md".into(), &document.markdown())?;
    put("results.json".into(), &json(document, evidence)?)?;
    for sheet in document.sheets() {
        put(format!("{}.csv", sheet.key), &sheet.csv())?;
    }
    for figure in document.figures() {
        put(figure.file.clone(), &figure.svg)?;
    }
    Ok(names)
}

fn write(out: &Path, name: &str, content: &str) -> Result<(), EvalError> {
    let path = out.join(name);
    write_atomically(&path, |file| file.write_all(content.as_bytes()))
        .map_err(|source| EvalError::Output { path, source })
}

/// All summaries, with where they come from.
fn json(document: &Document, evidence: &Evidence) -> Result<String, EvalError> {
    #[derive(Serialize)]
    struct Part<'a> {
        part: &'a str,
        data: &'a str,
        summary: &'a Summary,
    }
    #[derive(Serialize)]
    struct Results<'a> {
        facts: &'a [(String, String)],
        parts: Vec<Part<'a>>,
    }
    let parts = evidence
        .parts
        .iter()
        .map(|(part, measured)| (*part, measured))
        .chain(evidence.variants.iter().map(|(name, measured)| (name.as_str(), measured)))
        .map(|(part, measured)| Part { part, data: &measured.data, summary: &measured.summary })
        .collect();
    let results = Results { facts: &document.facts, parts };
    serde_json::to_string(&results)
        .map(|text| text + "\n")
        .map_err(|e| EvalError::Output { path: "results.json".into(), source: io::Error::from(e) })
}
