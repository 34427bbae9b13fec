//! Parquet, the format of tables in columns, by the `parquet` crate.

mod columns;
mod pages;
mod table;
mod thrift;
mod write;

use std::io::{self, Write};

use arrow_schema::DataType;

use self::columns::Place;
use self::table::Table;
use super::scalar::Scalar;
use super::{Attribute, CloudFormat, Contents, FormatError, Outgoing, ReadOptions, ReadSwitch, Room};
use crate::Rigid;

/// Parquet files. The points are the columns x, y and z of any type of numbers, or a column of lists
/// or structures of three numbers; missing numbers are NaN. Written with the columns x, y and z, and
/// one for each attribute. A moved copy keeps all other columns; nx, ny and nz are turned.
pub(super) struct Parquet;

fn read(bytes: &[u8], options: &ReadOptions) -> Result<(Table, Place, Vec<[f64; 3]>), FormatError> {
    let table = Table::open(bytes, options)?;
    let place = columns::find(table.metadata.schema(), options.columns.as_ref())?;
    options.check_points(2 * bytes.len(), table.rows())?;
    let mut points = Vec::new();
    // The pages of a table without rows are no pages at times.
    if table.rows() == 0 {
        return Ok((table, place, points));
    }
    table.batches(&place.roots(), options, |batch| columns::points(&place, batch.columns(), &mut points))?;
    Ok((table, place, points))
}

impl CloudFormat for Parquet {
    fn name(&self) -> &'static str {
        "parquet"
    }

    fn extensions(&self) -> &[&'static str] {
        &["parquet", "pq"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        bytes.starts_with(b"PAR1")
    }

    fn takes(&self) -> &'static [ReadSwitch] {
        &[ReadSwitch::Columns]
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let (table, place, points) = read(bytes, options)?;
        let kinds = place.roots();
        let single =
            kinds.iter().all(|&column| columns::is_single(table.metadata.schema().field(column).data_type()));
        Ok(Contents { points, single, ..Contents::default() })
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        let table = Table::open(bytes, options)?;
        let place = columns::find(table.metadata.schema(), options.columns.as_ref())?;
        let coordinates = place.roots();
        let columns = table.metadata.schema().fields().len().saturating_sub(coordinates.len());
        let planned = table.rows().saturating_mul(16).saturating_mul(columns);
        options.check_memory("the attributes", 2 * bytes.len(), planned)?;
        let mut attributes = Vec::new();
        for (column, field) in table.metadata.schema().fields().iter().enumerate() {
            let kind = match field.data_type() {
                DataType::Int8 => Scalar::I8,
                DataType::UInt8 => Scalar::U8,
                DataType::Int16 => Scalar::I16,
                DataType::UInt16 => Scalar::U16,
                DataType::Int32 => Scalar::I32,
                DataType::UInt32 => Scalar::U32,
                DataType::Int64 => Scalar::I64,
                DataType::UInt64 => Scalar::U64,
                DataType::Float16 | DataType::Float32 => Scalar::F32,
                DataType::Float64 => Scalar::F64,
                _ => continue,
            };
            if coordinates.contains(&column) {
                continue;
            }
            let mut values = Vec::new();
            let mut missing = false;
            table.batches(&[column], options, |batch| {
                let array = batch.column(0);
                missing |= array.null_count() > 0;
                values.extend(columns::numbers(array)?);
                Ok(())
            })?;
            // Integers have no way to say that one is missing.
            let kind = if missing && !matches!(kind, Scalar::F32) { Scalar::F64 } else { kind };
            let values = super::scans::attribute_values(kind, values.into_iter());
            attributes.push(Attribute { name: field.name().to_lowercase(), values });
        }
        Ok(attributes)
    }

    fn keeps(&self, _: &Attribute, _: &Outgoing<'_>) -> bool {
        true
    }

    fn has_both_precisions(&self) -> bool {
        true
    }

    fn check_rewrite(
        &self,
        from: &str,
        bytes: &[u8],
        options: &ReadOptions,
    ) -> Option<Result<Room, FormatError>> {
        let check = || {
            let table = Table::open(bytes, options)?;
            let place = columns::find(table.metadata.schema(), options.columns.as_ref())?;
            write::moved_columns(&place).map(|_| Room::Anything)
        };
        (from == self.name()).then(check)
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(&write::file(cloud)?)
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        let (table, place, points) = read(bytes, options)?;
        if *motion == Rigid::identity() {
            return out.write_all(bytes);
        }
        out.write_all(&write::rewritten(&table, options, &place, &points, motion)?)
    }
}

/// Checks what a Parquet file of any columns unpacks to, before it is read by other means.
///
/// # Errors
/// [`FormatError`] where the file is damaged, or unpacks to more than is in proportion or allowed.
pub fn check_parquet(bytes: &[u8], options: &ReadOptions) -> Result<(), FormatError> {
    Table::open(bytes, options)?.check_all(options)
}

#[cfg(test)]
mod tests;
