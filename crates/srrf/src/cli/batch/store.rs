//! Files of results: read row by row in any format, written whole.

use std::collections::BTreeSet;
use std::path::Path;

use bytes::Bytes;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::Value;
use srrf_cloud::io::{ReadOptions, check_parquet, write_atomically};

use super::csv;
use super::parquet_list;
use super::row::BatchRow;
use super::table::{Format, TableWriter};
use srrf_args::{Failure, files, interrupt};

/// What takes the rows of a file, one after the other; an error of it names what is wrong with the row.
pub type Take<'a> = &'a mut dyn FnMut(BatchRow) -> Result<(), String>;

/// Gives all rows of a file. A last line of JSON that was cut off, as a killed run leaves it, is passed over.
///
/// # Errors
/// [`Failure::usage`], which names the file and the line.
pub fn each_row(path: &Path, take: Take<'_>) -> Result<(), Failure> {
    let bytes = files::read_bytes(path, &ReadOptions::default(), "it should be results of a batch")?;
    let problem = |(place, problem): (String, String)| {
        Failure::usage(format!("{path:?}, {place}: {problem}; choose another file, or delete this one"))
    };
    match Format::of(path) {
        Format::JsonLines => lines(&bytes[..whole(&bytes)], take).map_err(problem),
        Format::Csv => csv_rows(&bytes, take).map_err(problem),
        Format::Parquet => {
            // What it unpacks to is checked before any of it is.
            let damaged =
                |e: String| problem(("its end".to_owned(), format!("not a whole Parquet file ({e})")));
            check_parquet(&bytes, &ReadOptions::default()).map_err(|e| damaged(e.to_string()))?;
            parquet_rows(bytes.into(), take).map_err(problem)
        }
    }
}

/// How many bytes of a text are whole lines.
pub fn whole(text: &[u8]) -> usize {
    text.iter().rposition(|b| *b == b'\n').map_or(0, |end| end + 1)
}

fn lines(text: &[u8], take: Take<'_>) -> Result<(), (String, String)> {
    for (number, line) in (1..).zip(text.split(|b| *b == b'\n')) {
        if !line.trim_ascii().is_empty() {
            let row = std::str::from_utf8(line).map_err(|e| e.to_string()).and_then(BatchRow::parse);
            row.and_then(&mut *take).map_err(|problem| (format!("line {number}"), problem))?;
        }
    }
    Ok(())
}

fn csv_rows(text: &[u8], take: Take<'_>) -> Result<(), (String, String)> {
    let whole = |problem: String| ("line 1".to_owned(), problem);
    let mut records = csv::records(text).map_err(whole)?.into_iter();
    let names = records.next().map(|(_, names)| names).unwrap_or_default();
    let column = names.iter().position(|name| name == "answer");
    let column =
        column.ok_or_else(|| whole("not results of a batch: the column `answer` is missing".into()))?;
    for (line, fields) in records {
        let text = fields.get(column).map(String::as_str).unwrap_or_default();
        BatchRow::parse(text).and_then(&mut *take).map_err(|problem| (format!("line {line}"), problem))?;
    }
    Ok(())
}

fn parquet_rows(file: Bytes, take: Take<'_>) -> Result<(), (String, String)> {
    let whole = |e: &dyn std::fmt::Display| ("its end".to_owned(), format!("not a whole Parquet file ({e})"));
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| whole(&e))?;
    let place = builder.schema().index_of("answer").map_err(|_| {
        ("its schema".to_owned(), "not results of a batch: the column `answer` is missing".to_owned())
    })?;
    let mask = ProjectionMask::roots(builder.parquet_schema(), [place]);
    let mut number = 0;
    for batch in builder.with_projection(mask).build().map_err(|e| whole(&e))? {
        let batch = batch.map_err(|e| whole(&e))?;
        for value in parquet_list::values(batch.column(0)).unwrap_or_default() {
            number += 1;
            let text = value.as_str().unwrap_or_default();
            BatchRow::parse(text)
                .and_then(&mut *take)
                .map_err(|problem| (format!("row {number}"), problem))?;
        }
    }
    Ok(())
}

/// Writes a file of results whole or not at all: `give` puts the rows, in the order of the file. `columns` are those of the list.
///
/// # Errors
/// [`Failure::failed`] where it cannot be written; those of `give`.
pub fn write(
    path: &Path,
    columns: &BTreeSet<String>,
    give: &mut dyn FnMut(Take<'_>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let columns: Vec<String> = columns.iter().cloned().collect();
    let _guard = interrupt::hold();
    let mut given = Ok(());
    let written = write_atomically(path, |out| {
        let mut table = TableWriter::new(Format::of(path), &columns, out)?;
        let mut failed = None;
        given = give(&mut |row| match table.put(row) {
            Ok(()) => Ok(()),
            Err(e) => {
                let message = e.to_string();
                failed = Some(e);
                Err(message)
            }
        });
        match (failed, &given) {
            (Some(e), _) => Err(e),
            (None, Err(_)) => Err(std::io::Error::other("given up")),
            (None, Ok(())) => table.finish(),
        }
    });
    match (written, given) {
        (Ok(()), _) => Ok(()),
        (Err(e), Err(failure)) if e.to_string() == "given up" => Err(failure),
        (Err(e), _) => {
            Err(Failure::failed(format!("cannot write {path:?}: {e}; choose another place")).because(e))
        }
    }
}

/// The value of a column in words, for people.
pub fn in_words(value: Option<&Value>) -> String {
    match value {
        None | Some(Value::Null) => String::new(),
        Some(Value::String(text)) => text.clone(),
        Some(other) => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::row::testing::{answered, failed};
    use super::*;

    fn read(path: &Path) -> Result<Vec<BatchRow>, String> {
        let mut rows = Vec::new();
        each_row(path, &mut |row| {
            rows.push(row);
            Ok(())
        })
        .map_err(|e| e.to_string())?;
        Ok(rows)
    }

    #[test]
    fn rows_come_back_from_every_format() {
        let folder = tempfile::tempdir().unwrap();
        let rows = [answered("a", 2.5, 0.9), failed("b"), answered("c,\"d\"", -1e-300, 0.1)];
        let columns = BTreeSet::from(["site".to_owned()]);
        for name in ["r.jsonl", "r.csv", "r.parquet"] {
            let path = folder.path().join(name);
            write(&path, &columns, &mut |put| {
                rows.iter().try_for_each(|row| put(row.clone())).map_err(Failure::failed)
            })
            .unwrap();
            assert_eq!(read(&path).unwrap(), rows, "{name}");
        }
        let path = folder.path().join("r.jsonl");
        let text = std::fs::read(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 9]).unwrap();
        assert_eq!(read(&path).unwrap(), rows[..2], "a line that was cut off is passed over");
    }

    #[test]
    fn other_files_are_refused_and_nothing_is_half_written() {
        let folder = tempfile::tempdir().unwrap();
        for (name, text, words) in [
            ("a.jsonl", "{\"id\":\"x\"}\nhello\n", "line 2: not a line of results"),
            ("a.csv", "source,target\na,b\n", "`answer` is missing"),
            ("a.parquet", "PAR1", "not a whole Parquet file"),
        ] {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            let error = read(&path).unwrap_err();
            assert!(error.contains(words) && error.contains(name), "{error}");
        }
        let path = folder.path().join("b.csv");
        let given = write(&path, &BTreeSet::new(), &mut |_| Err(Failure::usage("no".into())));
        assert_eq!(given.unwrap_err().to_string(), "no");
        assert!(!path.exists());
        assert_eq!((in_words(None), in_words(Some(&Value::from(2)))), (String::new(), "2".into()));
    }
}
