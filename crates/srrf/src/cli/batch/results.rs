//! The results of a batch while it runs: one JSON line a pair, in the order of the list, and only whole lines. Tables are made
//! of the lines at the end.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::pair::ListedPair;
use super::row::BatchRow;
use super::store;
use super::table::Format;
use srrf_args::Failure;
use srrf_args::{files, interrupt};

/// A file of results that is being filled.
pub struct Results {
    path: PathBuf,
    /// Where the lines of this run go; for JSON lines the output itself.
    lines: PathBuf,
    out: Box<dyn Write + Send>,
    /// The place in the order whose line comes next.
    next: usize,
    /// Lines whose turn has not come.
    waiting: BTreeMap<usize, String>,
}

/// The pairs that are done, by id, and whether they have a pose.
pub type Done = HashMap<String, bool>;

impl Results {
    /// Opens a file, and finds the pairs that are in it already. With `retry_failed` those without a pose are taken out.
    ///
    /// # Errors
    /// [`Failure::usage`] for a file that holds anything but results of `rows` with `options`;
    /// [`Failure::failed`] where it cannot be written.
    pub fn open(
        path: &Path,
        rows: &[ListedPair],
        options: &Value,
        retry_failed: bool,
    ) -> Result<(Self, Done), Failure> {
        let lines = lines_of(path);
        let fresh = |out| Self {
            path: path.to_owned(),
            lines: lines.clone(),
            out,
            next: 0,
            waiting: BTreeMap::new(),
        };
        if files::is_stream(path) {
            return Ok((fresh(Box::new(io::stdout())), Done::new()));
        }
        let failed =
            |e: io::Error| Failure::failed(format!("cannot write {path:?}: {e}; choose another --output"));
        let known: HashMap<&str, &ListedPair> = rows.iter().map(|row| (&*row.id, row)).collect();
        let mut done = Done::new();
        for place in places(path) {
            store::each_row(&place, &mut |row| {
                let pair = known
                    .get(row.id())
                    .ok_or_else(|| format!("the list does not have the pair {:?}", row.id()))?;
                row.belongs_to(pair, options)?;
                done.insert(row.id().to_owned(), row.error().is_none());
                Ok(())
            })?;
        }
        let before = done.len();
        if retry_failed {
            done.retain(|_, has_pose| *has_pose);
        }
        if done.len() < before {
            keep(path, &done)?;
        }
        let file = OpenOptions::new().read(true).append(true).create(true).open(&lines).map_err(failed)?;
        if file.metadata().map_err(failed)?.is_file() {
            // A line without an end was cut off when the run was ended by force.
            let text = std::fs::read(&lines).map_err(failed)?;
            let whole = store::whole(&text);
            if whole < text.len() {
                file.set_len(whole as u64).map_err(failed)?;
            }
        }
        Ok((fresh(Box::new(file)), done))
    }

    /// Takes the line of the pair at `place` (from 0, without gaps), and writes all whose turn it is.
    ///
    /// # Errors
    /// [`Failure::failed`] where the file cannot be written.
    pub fn put(&mut self, place: usize, row: &BatchRow) -> Result<(), Failure> {
        self.waiting.insert(place, format!("{}\n", row.to_line()));
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

    /// The end: a table is made of the lines, in the order of the list.
    ///
    /// # Errors
    /// [`Failure::failed`] where it cannot be written.
    pub fn finish(self, order: &[ListedPair]) -> Result<(), Failure> {
        if self.lines == self.path {
            return Ok(());
        }
        drop(self.out);
        let places = places(&self.path);
        if places.contains(&self.lines) {
            let ids: Vec<&str> = order.iter().map(|pair| &*pair.id).collect();
            join(&places, &ids, &self.path)?;
            let _ = std::fs::remove_file(&self.lines);
        }
        Ok(())
    }
}

/// Where the lines of a run with this output go.
fn lines_of(path: &Path) -> PathBuf {
    if Format::of(path) == Format::JsonLines {
        return path.to_owned();
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.jsonl"))
}

/// The files that hold results of this output.
fn places(path: &Path) -> Vec<PathBuf> {
    let lines = lines_of(path);
    let table = (lines != path).then(|| path.to_owned());
    let all = table.into_iter().chain([lines]);
    all.filter(|place| std::fs::metadata(place).is_ok_and(|m| m.is_file() && m.len() > 0)).collect()
}

/// Takes out the rows of all pairs but those of `done`.
fn keep(path: &Path, done: &Done) -> Result<(), Failure> {
    for place in places(path) {
        let mut columns = BTreeSet::new();
        store::each_row(&place, &mut |row| {
            columns.extend(row.columns().cloned());
            Ok(())
        })?;
        store::write(&place, &columns, &mut |put| {
            store::each_row(&place, &mut |row| if done.contains_key(row.id()) { put(row) } else { Ok(()) })
        })?;
    }
    Ok(())
}

/// Joins files of results: each pair once, in the order of `ids`, the others after them. Of two rows of one pair the one with a
/// pose counts; two poses must be the same.
///
/// # Errors
/// [`Failure::usage`] for two poses of one pair, and files that are no results; [`Failure::failed`] where nothing can be written.
pub fn join(from: &[PathBuf], ids: &[&str], to: &Path) -> Result<usize, Failure> {
    let mut columns = BTreeSet::new();
    let mut best: HashMap<String, BatchRow> = HashMap::new();
    let mut seen: Vec<String> = Vec::new();
    for path in from {
        store::each_row(path, &mut |row| {
            columns.extend(row.columns().cloned());
            match best.get(row.id()) {
                None => seen.push(row.id().to_owned()),
                Some(known) if known.error().is_some() => {}
                Some(_) if row.error().is_some() => return Ok(()),
                Some(known) if known.agrees_with(&row) => return Ok(()),
                Some(_) => {
                    return Err(format!("another answer for the pair {:?} than in a file before", row.id()));
                }
            }
            best.insert(row.id().to_owned(), row);
            Ok(())
        })?;
    }
    let pairs = best.len();
    let order: Vec<String> = ids.iter().map(|id| (*id).to_owned()).chain(seen).collect();
    store::write(to, &columns, &mut |put| {
        order.iter().filter_map(|id| best.remove(id)).try_for_each(&mut *put).map_err(Failure::failed)
    })?;
    Ok(pairs)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::row::testing::{answered, failed, listed};
    use super::*;

    fn rows() -> Vec<ListedPair> {
        ["a", "b", "c"].map(|source| listed(source, "t")).to_vec()
    }

    fn ids(path: &Path) -> Vec<String> {
        let mut found = Vec::new();
        store::each_row(path, &mut |row| {
            found.push(row.id().to_owned());
            Ok(())
        })
        .unwrap();
        found
    }

    #[test]
    fn lines_come_in_order_and_a_cut_one_goes() {
        let folder = tempfile::tempdir().unwrap();
        let options = json!({ "seed": 1 });
        for name in ["r.jsonl", "r.csv", "r.parquet"] {
            let path = folder.path().join(name);
            let cut = format!("{}\n{{\"id\": 2, \"sou", answered("a", 1.0, 0.9).to_line());
            std::fs::write(lines_of(&path), cut).unwrap();
            let (mut results, done) = Results::open(&path, &rows(), &options, false).unwrap();
            assert_eq!(done, Done::from([("a -> t".into(), true)]));
            results.put(1, &answered("c", 3.0, 0.9)).unwrap();
            assert_eq!(std::fs::read_to_string(lines_of(&path)).unwrap().lines().count(), 1);
            results.put(0, &failed("b")).unwrap();
            results.finish(&rows()).unwrap();
            assert_eq!(ids(&path), ["a -> t", "b -> t", "c -> t"], "{name}");
            assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);

            let (_, done) = Results::open(&path, &rows(), &options, false).unwrap();
            assert_eq!(done.values().filter(|has_pose| **has_pose).count(), 2);
            let (mut again, done) = Results::open(&path, &rows(), &options, true).unwrap();
            assert_eq!((done.len(), done.contains_key("b -> t")), (2, false));
            again.put(0, &answered("b", 2.0, 0.9)).unwrap();
            again.finish(&rows()).unwrap();
            let mut all = ids(&path);
            all.sort();
            assert_eq!(all, ["a -> t", "b -> t", "c -> t"], "{name}");
            std::fs::remove_file(&path).unwrap();
        }
    }

    #[test]
    fn foreign_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.jsonl");
        let error = |line: &str, seed: i32| {
            std::fs::write(&path, format!("{line}\n")).unwrap();
            let opened = Results::open(&path, &rows(), &json!({ "seed": seed }), false);
            opened.err().unwrap().to_string()
        };
        assert!(error("hello", 1).contains("line 1"));
        assert!(error(&answered("x", 1.0, 0.5).to_line(), 1).contains("does not have the pair \"x -> t\""));
        assert!(error(&answered("a", 1.0, 0.5).to_line(), 2).contains("other options"));
    }

    #[test]
    fn of_two_rows_the_one_with_a_pose_counts() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let write = |name: &str, rows: &[BatchRow]| {
            let text: String = rows.iter().map(|row| row.to_line() + "\n").collect();
            std::fs::write(at(name), text).unwrap();
        };
        write("1.jsonl", &[failed("a"), answered("b", 2.0, 0.5)]);
        write("2.jsonl", &[answered("c", 3.0, 0.5), answered("a", 1.0, 0.5), answered("b", 2.0, 0.5)]);
        let joined = join(&[at("1.jsonl"), at("2.jsonl")], &["c -> t"], &at("all.parquet")).unwrap();
        assert_eq!(
            (joined, ids(&at("all.parquet"))),
            (3, vec!["c -> t".into(), "a -> t".into(), "b -> t".into()])
        );
        write("3.jsonl", &[answered("b", 9.0, 0.5)]);
        let error = join(&[at("1.jsonl"), at("3.jsonl")], &[], &at("all.csv")).unwrap_err().to_string();
        assert!(
            error.contains("another answer for the pair \"b -> t\"") && error.contains("3.jsonl"),
            "{error}"
        );
        assert!(!at("all.csv").exists());
    }
}
