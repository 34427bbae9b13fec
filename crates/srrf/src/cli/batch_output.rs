//! The results of a batch: one JSON line a pair, in the order of the list, and only whole lines.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::batch_pairs::ListedPair;
use srrf_args::Failure;
use srrf_args::{files, interrupt};

/// A file of results that is being filled.
pub struct ResultLines {
    path: PathBuf,
    out: Box<dyn Write + Send>,
    /// The place in the order whose line comes next.
    next: usize,
    /// Lines whose turn has not come.
    waiting: BTreeMap<usize, String>,
}

impl ResultLines {
    /// Opens a file, and finds the pairs that are in it already, of an interrupted run: their numbers, and
    /// whether they have a pose.
    ///
    /// # Errors
    /// [`Failure::usage`] for a file that holds anything but results of `rows` with `options`;
    /// [`Failure::failed`] where it cannot be written.
    pub fn open(
        path: &Path,
        rows: &[ListedPair],
        options: &Value,
    ) -> Result<(Self, BTreeMap<usize, bool>), Failure> {
        if files::is_stream(path) {
            let out = Box::new(io::stdout());
            return Ok((
                Self { path: path.to_owned(), out, next: 0, waiting: BTreeMap::new() },
                BTreeMap::new(),
            ));
        }
        let failed =
            |e: io::Error| Failure::failed(format!("cannot write {path:?}: {e}; choose another --output"));
        let file = OpenOptions::new().read(true).append(true).create(true).open(path).map_err(failed)?;
        let text = if file.metadata().map_err(failed)?.is_file() {
            std::fs::read(path).map_err(failed)?
        } else {
            Vec::new() // a device
        };
        // A line without an end was cut off when the run was ended by force.
        let whole = text.iter().rposition(|b| *b == b'\n').map_or(0, |end| end + 1);
        let done = finished(&text[..whole], rows, options).map_err(|(line, problem)| {
            Failure::usage(format!(
                "{path:?}, line {line}: {problem}; choose another --output, or delete this file"
            ))
        })?;
        if whole < text.len() {
            file.set_len(whole as u64).map_err(failed)?;
        }
        let out: Box<File> = Box::new(file);
        Ok((Self { path: path.to_owned(), out, next: 0, waiting: BTreeMap::new() }, done))
    }

    /// Takes the line of the pair at `place` (from 0, without gaps), and writes all whose turn it is.
    ///
    /// # Errors
    /// [`Failure::failed`] where the file cannot be written.
    pub fn put(&mut self, place: usize, value: &Value) -> Result<(), Failure> {
        self.waiting.insert(place, format!("{value}\n"));
        while let Some(line) = self.waiting.remove(&self.next) {
            let _guard = interrupt::hold();
            self.out
                .write_all(line.as_bytes())
                .and_then(|()| self.out.flush())
                .map_err(|e| Failure::failed(format!("cannot write {:?}: {e}", self.path)))?;
            self.next += 1;
        }
        Ok(())
    }
}

/// The pairs in a file of results, and whether they have a pose. The error is the line and what is wrong with it.
fn finished(
    text: &[u8],
    rows: &[ListedPair],
    options: &Value,
) -> Result<BTreeMap<usize, bool>, (usize, String)> {
    let mut done = BTreeMap::new();
    for (number, line) in (1..).zip(text.split(|b| *b == b'\n')) {
        if line.trim_ascii().is_empty() {
            continue;
        }
        let problem = |what: &str| (number, what.to_owned());
        let value: Value = serde_json::from_slice(line).map_err(|_| problem("not a line of results"))?;
        let pair = value["pair"].as_u64().and_then(|n| usize::try_from(n).ok());
        let row = pair.and_then(|n| rows.get(n.checked_sub(1)?));
        let Some(row) = row else { return Err(problem("a pair that the list does not have")) };
        let initial = value["initial"].as_str();
        let same = value["source"] == *row.source
            && value["target"] == *row.target
            && initial == row.initial.as_deref();
        if !same {
            return Err((number, format!("pair {} is another one in the list", row.number)));
        }
        if value["options"] != *options {
            return Err((number, format!("made with other options ({})", value["options"])));
        }
        done.insert(row.number, value.get("error").is_none());
    }
    Ok(done)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn rows() -> Vec<ListedPair> {
        let row = |number, source: &str| ListedPair {
            number,
            source: source.into(),
            target: "t".into(),
            initial: None,
        };
        vec![row(1, "a"), row(2, "b"), row(3, "c")]
    }

    fn line(pair: usize, source: &str) -> Value {
        json!({ "pair": pair, "source": source, "target": "t", "initial": null, "options": { "seed": 1 } })
    }

    #[test]
    fn lines_come_in_order_and_a_cut_one_goes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.jsonl");
        let options = json!({ "seed": 1 });
        std::fs::write(&path, format!("{}\n{{\"pair\": 2, \"sou", line(1, "a"))).unwrap();
        let (mut results, done) = ResultLines::open(&path, &rows(), &options).unwrap();
        assert_eq!(done, BTreeMap::from([(1, true)]));
        results.put(1, &line(3, "c")).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), 1);
        let mut without = line(2, "b");
        without["error"] = json!("no pose");
        results.put(0, &without).unwrap();
        drop(results);
        let (_, done) = ResultLines::open(&path, &rows(), &options).unwrap();
        assert_eq!(done, BTreeMap::from([(1, true), (2, false), (3, true)]));
        let text = std::fs::read_to_string(&path).unwrap();
        let order: Vec<u64> = text
            .lines()
            .map(|l| serde_json::from_str::<Value>(l).unwrap()["pair"].as_u64().unwrap())
            .collect();
        assert_eq!(order, [1, 2, 3]);
    }

    #[test]
    fn foreign_files_are_refused() {
        let options = json!({ "seed": 1 });
        let error = |text: &str| finished(text.as_bytes(), &rows(), &options).unwrap_err();
        assert_eq!(error("hello\n").0, 1);
        assert!(error(&format!("{}\n{}\n", line(1, "a"), line(2, "x"))).1.contains("pair 2 is another"));
        assert!(error(&format!("{}\n", line(4, "a"))).1.contains("does not have"));
        let other =
            finished(line(1, "a").to_string().as_bytes(), &rows(), &json!({ "seed": 2 })).unwrap_err();
        assert!(other.1.contains("other options"), "{}", other.1);
    }
}
