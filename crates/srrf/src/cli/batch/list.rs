//! The list of pairs of a batch: CSV, JSON lines or Parquet.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use super::csv;
use super::pair::{COLUMNS, ListedPair, Record};
use super::parquet_list;
use srrf_args::reading::check_taken;
use srrf_args::{Failure, Places, files};
use srrf_cloud::io::{ReadOptions, Taken, as_utf8, check_parquet};

/// The pairs of a batch.
#[derive(Debug, Clone, PartialEq)]
pub struct PairList {
    /// In the order of the file.
    pub rows: Vec<ListedPair>,
    folder: PathBuf,
}

impl PairList {
    /// Reads the list. Columns are known by their names: `source`, `target` and, if wanted, `initial` and `id`; others are
    /// carried to the results.
    ///
    /// # Errors
    /// [`Failure::usage`], which names the file and the line.
    pub fn read(path: &Path, options: &ReadOptions) -> Result<Self, Failure> {
        let records = records(path, options)?;
        let rows = pairs(records).map_err(|problem| Failure::usage(format!("{path:?}: {problem}")))?;
        Ok(Self { rows, folder: path.parent().map(Path::to_owned).unwrap_or_default() })
    }

    /// The places of a run, with the files of all pairs among those that are read.
    pub fn read_by(&self, mut places: Places) -> Places {
        for ListedPair { id, source, target, initial, .. } in &self.rows {
            let files =
                [("source", Some(source)), ("target", Some(target)), ("first guess", initial.as_ref())];
            for (what, file) in files.into_iter().filter_map(|(what, file)| Some((what, file?))) {
                places = places.reads(format!("the {what} of {id:?}"), &*self.path(file));
            }
        }
        places
    }

    /// Refuses switches of reading that none of the files takes of which they are said.
    ///
    /// # Errors
    /// [`Failure::usage`], which names the switch.
    pub fn check_taken(&self, [source, target]: &[ReadOptions; 2]) -> Result<(), Failure> {
        let files = self.rows.iter().flat_map(|row| [(source, &row.source), (target, &row.target)]);
        check_taken(files.map(|(options, file)| (options, || Taken::by(&self.path(file)))))
    }

    /// The path of a file that is written relative to the list.
    pub fn path(&self, written: &str) -> PathBuf {
        self.folder.join(written)
    }
}

/// The rows of a file: Parquet by its content, JSON lines by the extension, otherwise CSV.
///
/// # Errors
/// [`Failure::usage`], which names the file and the line.
pub(super) fn records(path: &Path, options: &ReadOptions) -> Result<Vec<Record>, Failure> {
    let bytes = files::read_bytes(path, options, "it should be a table: CSV, JSON lines or Parquet")?;
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let rows = if bytes.starts_with(b"PAR1") {
        // What it unpacks to is checked before any of it is.
        check_parquet(&bytes, options).map_err(|e| Failure::usage(format!("{path:?}: {e}")))?;
        parquet_list::records(bytes.into())
    } else if extension == "parquet" {
        Err("it is no Parquet file; was it written whole?".into())
    } else {
        let bytes = as_utf8(&bytes).map_err(|e| Failure::usage(format!("{path:?}: {e}")))?;
        if matches!(&*extension, "jsonl" | "ndjson" | "json") {
            json_lines(&bytes)
        } else {
            csv_records(&bytes)
        }
    };
    rows.map_err(|problem| Failure::usage(format!("{path:?}: {problem}")))
}

fn json_lines(bytes: &[u8]) -> Result<Vec<Record>, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "not UTF-8; save the list in UTF-8")?;
    let lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    lines
        .map(|(number, line)| match serde_json::from_str(line) {
            Ok(Value::Object(fields)) => Ok((format!("line {number}"), fields)),
            Ok(_) => Err(format!("line {number}: not an object; write {{\"source\": ..., \"target\": ...}}")),
            Err(e) => Err(format!("line {number}: not JSON ({e}); write one object a line")),
        })
        .collect()
}

fn csv_records(bytes: &[u8]) -> Result<Vec<Record>, String> {
    // Spreadsheets begin their files with a byte order mark.
    let mut records = csv::records(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))?.into_iter();
    let (_, names) = records.next().ok_or("it is empty; its first line should be `source,target`")?;
    if records.len() == 0 {
        names_are_there(names.iter())?;
    }
    let row = |(line, fields): (u64, Vec<String>)| {
        if fields.len() != names.len() {
            return Err(format!(
                "line {line}: {} fields, where the first line has {}; put names with commas in quotes",
                fields.len(),
                names.len()
            ));
        }
        let named = names.iter().cloned().zip(fields.into_iter().map(Value::from));
        Ok((format!("line {line}"), named.collect()))
    };
    records.map(row).collect()
}

fn pairs(records: Vec<Record>) -> Result<Vec<ListedPair>, String> {
    let mut rows: Vec<ListedPair> = Vec::with_capacity(records.len());
    let mut known: HashMap<String, String> = HashMap::with_capacity(records.len());
    if let Some((_, first)) = records.first() {
        names_are_there(first.keys())?;
    }
    for (place, fields) in records {
        let row = pair(fields).map_err(|problem| format!("{place}: {problem}"))?;
        if let Some(before) = known.insert(row.id.clone(), place.clone()) {
            return Err(format!(
                "{before} and {place} are the same pair, {}; leave one out, or tell them apart by a column `id`",
                row.id
            ));
        }
        rows.push(row);
    }
    if rows.is_empty() { Err("it lists no pairs".into()) } else { Ok(rows) }
}

fn names_are_there<'a>(names: impl Iterator<Item = &'a String>) -> Result<(), String> {
    let names: Vec<&String> = names.collect();
    let has = |wanted: &str| names.iter().any(|name| name.eq_ignore_ascii_case(wanted));
    if has("source") && has("target") {
        return Ok(());
    }
    Err(format!(
        "its columns are {names:?}; name them `source` and `target`, and `initial` if there are first guesses"
    ))
}

fn pair(fields: Map<String, Value>) -> Result<ListedPair, String> {
    let mut text: HashMap<&str, String> = HashMap::new();
    let mut columns = Map::new();
    for (name, value) in fields {
        let Some(known) =
            ["id", "source", "target", "initial"].into_iter().find(|k| name.eq_ignore_ascii_case(k))
        else {
            if COLUMNS.contains(&name.as_str()) {
                return Err(format!(
                    "the results have a column `{name}` of their own; call this one otherwise"
                ));
            }
            columns.insert(name, value);
            continue;
        };
        let value = match value {
            Value::Null => String::new(),
            Value::String(value) => value,
            Value::Number(number) if known == "id" => number.to_string(),
            other => return Err(format!("`{known}` is {other}; write a name in text")),
        };
        text.insert(known, value);
    }
    let mut take = |name: &str| text.remove(name).filter(|value| !value.is_empty());
    let (Some(source), Some(target)) = (take("source"), take("target")) else {
        return Err("the source or the target is empty; name a file for each".into());
    };
    if source == "-" || target == "-" {
        return Err("a list cannot read standard input; name files".into());
    }
    let initial = take("initial");
    let id = take("id").unwrap_or_else(|| by_files(&source, &target, initial.as_deref()));
    Ok(ListedPair { id, source, target, initial, columns })
}

/// What a pair without an `id` is known by.
fn by_files(source: &str, target: &str, initial: Option<&str>) -> String {
    match initial {
        None => format!("{source} -> {target}"),
        Some(initial) => format!("{source} -> {target} ({initial})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Vec<ListedPair>, String> {
        csv_records(text.as_bytes()).and_then(pairs)
    }

    #[test]
    fn columns_by_name() {
        let text =
            "\u{feff}Target, note ,source,initial\r\nb.ply,\"x, y\",\"a 1.ply\",\r\nd.ply,,c.ply,i.txt\r\n";
        let rows = parse(text).unwrap();
        assert_eq!(rows.len(), 2);
        assert_eq!((rows[0].source.as_str(), rows[0].target.as_str()), ("a 1.ply", "b.ply"));
        assert_eq!((rows[0].initial.as_deref(), rows[1].initial.as_deref()), (None, Some("i.txt")));
        assert_eq!((&*rows[0].id, &*rows[1].id), ("a 1.ply -> b.ply", "c.ply -> d.ply (i.txt)"));
        assert_eq!(rows[0].columns["note"], "x, y");
        let lines = "{\"source\":\"a\",\"target\":\"b\",\"id\":7,\"weight\":0.5}\n\n{\"source\":\"a\",\"target\":\"b\"}\n";
        let rows = json_lines(lines.as_bytes()).and_then(pairs).unwrap();
        assert_eq!(
            (&*rows[0].id, &*rows[1].id, &rows[0].columns["weight"]),
            ("7", "a -> b", &Value::from(0.5))
        );
    }

    #[test]
    fn errors_say_where() {
        let error = |text: &str| parse(text).unwrap_err();
        assert!(error("a.ply,b.ply\n").contains("`source` and `target`"));
        assert!(error("source,target\n").contains("no pairs"));
        assert!(error("source,target\na,b\n,c\n").starts_with("line 3"));
        assert!(error("source,target\n-,c\n").contains("standard input"));
        assert!(error("source,target\na,b,c\n").starts_with("line 2: 3 fields"));
        assert!(error("").contains("empty"));
        assert!(
            error("source,target\na,b\nc,d\na,b\n")
                .starts_with("line 2 and line 4 are the same pair, a -> b")
        );
        assert!(error("source,target,probability\na,b,1\n").contains("`probability` of their own"));
        let lines = |text: &str| json_lines(text.as_bytes()).and_then(pairs).unwrap_err();
        assert!(lines("{\"source\":\"a\"}\n").contains("columns are [\"source\"]"));
        assert!(lines("[1]\n").starts_with("line 1: not an object"));
        assert!(lines("{\"source\":[1],\"target\":\"b\"}\n").contains("`source` is [1]"));
    }

    #[test]
    fn memory_is_bounded() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pairs.csv");
        let rows: String = (0..100).map(|i| format!("a{i}.ply,b{i}.ply\n")).collect();
        std::fs::write(&path, format!("source,target\n{rows}")).unwrap();
        let read =
            |bytes| PairList::read(&path, &ReadOptions { max_memory: Some(bytes), ..ReadOptions::default() });
        let error = read(1000).unwrap_err().to_string();
        assert!(error.contains("pairs.csv") && error.contains("--max-memory"), "{error}");
        assert_eq!(read(10_000).unwrap().rows.len(), 100);
    }
}
