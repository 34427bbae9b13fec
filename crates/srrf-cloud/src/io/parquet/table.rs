//! A Parquet file by the `parquet` crate, checked before.

use std::panic::{AssertUnwindSafe, catch_unwind};

use arrow_array::RecordBatch;
use bytes::Bytes;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ParquetRecordBatchReaderBuilder};
use parquet::errors::ParquetError;

use super::super::{FormatError, ReadOptions};
use super::{pages, thrift};

/// Values and pages may unpack to this many times the file's size and `SLACK` more.
const RATIO: u64 = 200;
const SLACK: u64 = 1 << 20;
/// Rows that are unpacked at a time.
const ROWS: usize = 16_384;

/// A file whose footer has been read.
pub(super) struct Table {
    bytes: Bytes,
    pub metadata: ArrowReaderMetadata,
}

fn content(problem: impl Into<String>) -> FormatError {
    FormatError::Content(problem.into())
}

/// Runs `work` of the `parquet` crate; a panic on a damaged file becomes an error.
pub(super) fn guarded<T>(work: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, FormatError> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(ParquetError::General(problem) | ParquetError::NYI(problem)))
            if problem.contains("feature") =>
        {
            Err(content(format!(
                "{problem}; save it with compression \"snappy\", which pandas and pyarrow take by themselves, or \
                 without compression"
            )))
        }
        Ok(Err(error)) => Err(content(format!("the Parquet file is damaged: {error}"))),
        Err(_) => Err(content("the Parquet file is damaged: it follows no rules")),
    }
}

impl Table {
    /// # Errors
    /// [`FormatError`] where the footer is damaged.
    pub fn open(bytes: &[u8], options: &ReadOptions) -> Result<Self, FormatError> {
        thrift::check_footer(bytes)?;
        options.check_memory("a second copy of the file", bytes.len(), bytes.len())?;
        let bytes = Bytes::copy_from_slice(bytes);
        let metadata = guarded(|| ArrowReaderMetadata::load(&bytes, Default::default()))?;
        Ok(Self { bytes, metadata })
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        usize::try_from(self.metadata.metadata().file_metadata().num_rows()).unwrap_or(0)
    }

    /// Calls `each` with the rows of the columns `roots`, a part at a time.
    pub fn batches(
        &self,
        roots: &[usize],
        options: &ReadOptions,
        mut each: impl FnMut(&RecordBatch) -> Result<(), FormatError>,
    ) -> Result<(), FormatError> {
        self.check(roots, options)?;
        let mut reader = guarded(|| {
            let mask = ProjectionMask::roots(self.metadata.parquet_schema(), roots.iter().copied());
            ParquetRecordBatchReaderBuilder::new_with_metadata(self.bytes.clone(), self.metadata.clone())
                .with_projection(mask)
                .with_batch_size(ROWS)
                .build()
        })?;
        let next = || Ok(reader.next().transpose()?);
        let mut next = AssertUnwindSafe(next);
        while let Some(batch) = guarded(&mut *next)? {
            each(&batch)?;
        }
        Ok(())
    }

    /// As [`check`](Self::check), of all columns.
    pub fn check_all(&self, options: &ReadOptions) -> Result<(), FormatError> {
        let all: Vec<usize> = (0..self.metadata.schema().fields().len()).collect();
        self.check(&all, options)
    }

    /// Checks what the columns unpack to before any memory is taken for it.
    fn check(&self, roots: &[usize], options: &ReadOptions) -> Result<(), FormatError> {
        let size = self.bytes.len() as u64;
        let most = size.saturating_mul(RATIO).saturating_add(SLACK);
        let schema = self.metadata.parquet_schema();
        let rows = self.rows() as u64;
        let mut largest = 0;
        for leaf in 0..schema.num_columns() {
            if !roots.contains(&schema.get_column_root_idx(leaf)) {
                continue;
            }
            let mut values = 0u64;
            for group in self.metadata.metadata().row_groups() {
                let Some(column) = group.columns().get(leaf) else { continue };
                let packing = column.compression();
                if !pages::is_known(packing) {
                    return Err(content(format!(
                        "its columns are packed by {packing}; save it with compression \"snappy\", which pandas and pyarrow take \
                         by themselves, or \"zstd\""
                    )));
                }
                // The same bytes as those that the crate reads.
                let begin = column.dictionary_page_offset().unwrap_or(column.data_page_offset());
                let [begin, length] =
                    [begin, column.compressed_size()].map(|number| u64::try_from(number).unwrap_or(u64::MAX));
                let end = begin.saturating_add(length);
                let pages = pages::pages(&self.bytes, begin, end, packing, most)?;
                values = values.saturating_add(pages.values);
                largest = largest.max(pages.page);
            }
            if values.saturating_mul(8) > most || values < rows || largest > most {
                return Err(content(format!(
                    "the Parquet file is damaged or cut short: {values} values for {rows} rows, in pages of up to \
                     {largest} bytes, announced in {size} bytes"
                )));
            }
        }
        options.check_memory(
            "a page of a column",
            2 * self.bytes.len(),
            usize::try_from(largest).unwrap_or(usize::MAX),
        )
    }
}
