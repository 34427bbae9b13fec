//! Results as tables: CSV and Parquet, with one schema (book/src/use/batch.md). Both hold every row whole, as JSON, in the
//! column `answer`, so that tables turn into each other without loss.

use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use arrow_array::types::Float64Type;
use arrow_array::{
    ArrayRef, BooleanArray, FixedSizeListArray, Float64Array, Int64Array, RecordBatch, StringArray,
    StructArray,
};
use arrow_schema::{DataType, Field};
use parquet::arrow::ArrowWriter;
use parquet::basic::Compression;
use parquet::file::properties::WriterProperties;
use serde_json::Value;

use super::csv;
use super::pair::COLUMNS;
use super::row::BatchRow;

/// Rows of one row group of Parquet.
const ROW_GROUP: usize = 1024;

/// The numbers in the column `evidence`.
const EVIDENCE: [&str; 6] =
    ["spacing", "inlier_threshold", "inliers", "fitness", "inlier_rmse", "overlap_target"];

/// A format of results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// One object a line.
    JsonLines,
    /// Comma-separated values.
    Csv,
    /// Apache Parquet.
    Parquet,
}

impl Format {
    /// By the extension; JSON lines for any other.
    pub fn of(path: &Path) -> Self {
        match path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase().as_str() {
            "csv" => Self::Csv,
            "parquet" => Self::Parquet,
            _ => Self::JsonLines,
        }
    }
}

/// Rows on their way into a file.
pub struct TableWriter<'a> {
    format: Format,
    columns: &'a [String],
    out: &'a mut dyn Write,
    /// Rows of the next row group.
    waiting: Vec<BatchRow>,
    parquet: Option<ArrowWriter<Vec<u8>>>,
}

impl<'a> TableWriter<'a> {
    /// Begins a table; `columns` are those of the list.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn new(format: Format, columns: &'a [String], out: &'a mut dyn Write) -> io::Result<Self> {
        if format == Format::Csv {
            let columns: Vec<String> = columns.iter().map(|name| csv::harmless(name)).collect();
            let names = COLUMNS.into_iter().chain(columns.iter().map(String::as_str));
            out.write_all(csv::line(names).as_bytes())?;
        }
        Ok(Self { format, columns, out, waiting: Vec::new(), parquet: None })
    }

    /// One more row.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn put(&mut self, row: BatchRow) -> io::Result<()> {
        match self.format {
            Format::JsonLines => writeln!(self.out, "{}", row.to_line()),
            Format::Csv => self.out.write_all(csv_line(&row, self.columns).as_bytes()),
            Format::Parquet => {
                self.waiting.push(row);
                if self.waiting.len() < ROW_GROUP { Ok(()) } else { self.row_group() }
            }
        }
    }

    /// The end of the table.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn finish(mut self) -> io::Result<()> {
        if self.format != Format::Parquet {
            return Ok(());
        }
        if self.parquet.is_none() || !self.waiting.is_empty() {
            self.row_group()?;
        }
        let Some(writer) = self.parquet.take() else { return Ok(()) };
        let rest = writer.into_inner().map_err(io::Error::other)?;
        self.out.write_all(&rest)
    }

    fn row_group(&mut self) -> io::Result<()> {
        let rows = std::mem::take(&mut self.waiting);
        let batch = record_batch(&rows, self.columns).map_err(io::Error::other)?;
        let mut writer = match self.parquet.take() {
            Some(writer) => writer,
            None => {
                let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
                ArrowWriter::try_new(Vec::new(), batch.schema(), Some(properties))
                    .map_err(io::Error::other)?
            }
        };
        writer.write(&batch).and_then(|()| writer.flush()).map_err(io::Error::other)?;
        writer.sync()?;
        self.out.write_all(&std::mem::take(writer.inner_mut()))?;
        self.parquet = Some(writer);
        Ok(())
    }
}

/// A value of the list's column as text, empty where there is none.
fn words(value: Option<&Value>) -> Option<String> {
    match value? {
        Value::Null => None,
        Value::String(text) => Some(text.clone()),
        other => Some(other.to_string()),
    }
}

fn csv_line(row: &BatchRow, columns: &[String]) -> String {
    let number = |way: &[&str]| row.number(way).map_or_else(String::new, |n| n.to_string());
    let text = |key: &str| csv::harmless(row.text(key).unwrap_or_default());
    let spaced = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let fixed = [
        csv::harmless(row.id()),
        text("source"),
        text("target"),
        text("initial"),
        row.pose().map_or_else(String::new, |pose| spaced(&pose)),
        number(&["probability"]),
        row.abstain().map_or_else(String::new, |abstain| abstain.to_string()),
        row.0.get("evidence").map_or_else(String::new, Value::to_string),
        text("start"),
        number(&["points", "source"]),
        number(&["points", "target"]),
        row.seconds().map_or_else(String::new, |seconds| seconds.to_string()),
        text("error"),
        row.to_line(),
    ];
    let of_list = columns.iter().map(|name| csv::harmless(&words(row.column(name)).unwrap_or_default()));
    let fields: Vec<String> = fixed.into_iter().chain(of_list).collect();
    csv::line(fields.iter().map(String::as_str))
}

/// The rows in Arrow's columns.
fn record_batch(
    rows: &[BatchRow],
    columns_of_list: &[String],
) -> Result<RecordBatch, arrow_schema::ArrowError> {
    let text = |of: &dyn Fn(&BatchRow) -> Option<String>| -> ArrayRef {
        Arc::new(rows.iter().map(of).collect::<StringArray>())
    };
    let key = |name: &'static str| text(&move |row: &BatchRow| row.text(name).map(str::to_owned));
    let number =
        |way: &[&str]| -> ArrayRef { Arc::new(rows.iter().map(|r| r.number(way)).collect::<Float64Array>()) };
    let whole = |way: &[&str]| -> ArrayRef {
        Arc::new(rows.iter().map(|r| r.number(way).map(|n| n as i64)).collect::<Int64Array>())
    };
    // Without a pose 16 nulls: PyArrow (26) writes and cannot read a list of fixed size that is null itself.
    let poses = rows.iter().map(|row| Some(row.pose().map_or([None; 16], |pose| pose.map(Some))));
    let evidence: Vec<(Arc<Field>, ArrayRef)> = EVIDENCE
        .iter()
        .map(|name| (Arc::new(Field::new(*name, DataType::Float64, true)), number(&["evidence", name])))
        .collect();
    let mut columns: Vec<(String, ArrayRef, bool)> = Vec::new();
    let mut push = |name: &str, column: ArrayRef, nullable| columns.push((name.to_owned(), column, nullable));
    push("id", key("id"), false);
    push("source", key("source"), false);
    push("target", key("target"), false);
    push("initial", key("initial"), true);
    push(
        "target_from_source",
        Arc::new(FixedSizeListArray::from_iter_primitive::<Float64Type, _, _>(poses, 16)),
        true,
    );
    push("probability", number(&["probability"]), true);
    push("abstain", Arc::new(rows.iter().map(BatchRow::abstain).collect::<BooleanArray>()), true);
    push("evidence", Arc::new(StructArray::from(evidence)), true);
    push("start", key("start"), true);
    push("points_source", whole(&["points", "source"]), true);
    push("points_target", whole(&["points", "target"]), true);
    push("seconds", Arc::new(rows.iter().map(BatchRow::seconds).collect::<Float64Array>()), true);
    push("error", key("error"), true);
    push("answer", text(&|row| Some(row.to_line())), false);
    for name in columns_of_list {
        push(name, text(&|row| words(row.column(name))), true);
    }
    RecordBatch::try_from_iter_with_nullable(columns)
}

#[cfg(test)]
mod tests {
    use arrow_array::cast::AsArray;
    use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

    use super::super::row::testing::{answered, failed};
    use super::*;

    fn write(format: Format, rows: &[BatchRow], out: &mut dyn Write) {
        let columns = ["site".to_owned()];
        let mut table = TableWriter::new(format, &columns, out).unwrap();
        rows.iter().for_each(|row| table.put(row.clone()).unwrap());
        table.finish().unwrap();
    }

    #[test]
    fn the_parquet_schema_is_that_of_the_book() {
        let rows = [answered("a", 2.5, 0.9), failed("b")];
        let file = tempfile::NamedTempFile::new().unwrap();
        write(Format::Parquet, &rows, &mut file.reopen().unwrap());
        let reader =
            ParquetRecordBatchReaderBuilder::try_new(file.reopen().unwrap()).unwrap().build().unwrap();
        let batches: Vec<RecordBatch> = reader.map(Result::unwrap).collect();
        assert_eq!((batches.len(), batches[0].num_rows()), (1, 2));
        let batch = &batches[0];
        let schema = batch.schema();
        let names: Vec<&str> = schema.fields().iter().map(|f| f.name().as_str()).collect();
        assert_eq!(names, [&COLUMNS[..], &["site"]].concat());
        let pose = batch["target_from_source"].as_fixed_size_list();
        assert_eq!((pose.value_length(), pose.value(0).as_primitive::<Float64Type>().value(3)), (16, 2.5));
        assert_eq!(pose.value(0).as_primitive::<Float64Type>().value(7), 0.1 + 0.2);
        assert_eq!(arrow_array::Array::null_count(&pose.value(1)), 16);
        let evidence = batch["evidence"].as_struct();
        assert_eq!(evidence.column_by_name("fitness").unwrap().as_primitive::<Float64Type>().value(0), 0.75);
        assert_eq!(batch["error"].as_string::<i32>().value(1), "no \"pose\"");
        assert_eq!(batch["answer"].as_string::<i32>().value(0), rows[0].to_line());
        assert_eq!(batch["site"].as_string::<i32>().value(1), "ü, 1");
    }

    #[test]
    fn long_tables_come_in_row_groups() {
        for rows in [0, 1, ROW_GROUP, 2 * ROW_GROUP + 1] {
            let file = tempfile::NamedTempFile::new().unwrap();
            let all: Vec<BatchRow> = (0..rows).map(|i| answered(&i.to_string(), i as f64, 0.5)).collect();
            write(Format::Parquet, &all, &mut file.reopen().unwrap());
            let reader =
                ParquetRecordBatchReaderBuilder::try_new(file.reopen().unwrap()).unwrap().build().unwrap();
            let found: usize = reader.map(|batch| batch.unwrap().num_rows()).sum();
            assert_eq!(found, rows);
        }
    }

    #[test]
    fn csv_says_the_same() {
        let rows = [answered("a", 2.5, 0.9), failed("b")];
        let mut text = Vec::new();
        write(Format::Csv, &rows, &mut text);
        let records = csv::records(&text).unwrap();
        assert_eq!(records[0].1, [&COLUMNS[..], &["site"]].concat());
        let first = &records[1].1;
        assert_eq!(first[4], "1 0 0 2.5 0 1 0 0.30000000000000004 0 0 1 -0 0 0 0 1");
        assert_eq!((&*first[5], &*first[6], &*first[11], &*first[14]), ("0.9", "false", "0.75", "ü, 1"));
        assert_eq!((&*records[2].1[4], &*records[2].1[12]), ("", "no \"pose\""));
        assert_eq!(Format::of(Path::new("a.PARQUET")), Format::Parquet);
        assert_eq!(Format::of(Path::new("a")), Format::JsonLines);
    }
}
