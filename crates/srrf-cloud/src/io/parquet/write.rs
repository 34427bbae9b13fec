//! Writing Parquet, and moved copies of it.

use std::ops::Range;
use std::sync::Arc;

use arrow_array::{
    Array, ArrayRef, Float32Array, Float64Array, Int8Array, Int16Array, Int32Array, Int64Array, RecordBatch,
    UInt8Array, UInt16Array, UInt32Array, UInt64Array,
};
use arrow_schema::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;
use parquet::basic::Compression;
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;

use super::super::outgoing::stays_single;
use super::super::scalar::Scalar;
use super::super::scan::{moved, turned};
use super::super::{AttributeValues, FormatError, Outgoing, ReadOptions, Room};
use super::columns::{Place, numbers};
use super::table::{Table, guarded};
use crate::Rigid;

/// Rows of a part.
const ROWS: usize = 1 << 16;

fn writer(schema: &Arc<Schema>) -> Result<ArrowWriter<Vec<u8>>, ParquetError> {
    let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
    ArrowWriter::try_new(Vec::new(), Arc::clone(schema), Some(properties))
}

fn failed(error: FormatError) -> FormatError {
    FormatError::Unwritable(format!("cannot write Parquet: {error}"))
}

/// A file with the columns x, y and z and those of the attributes.
pub(super) fn file(cloud: &Outgoing<'_>) -> Result<Vec<u8>, FormatError> {
    let kind = if cloud.single { DataType::Float32 } else { DataType::Float64 };
    let mut fields = ["x", "y", "z"].map(|axis| Field::new(axis, kind.clone(), false)).to_vec();
    fields.extend(cloud.attributes.iter().map(|a| {
        let values = &column_of(&a.values, 0..0);
        Field::new(a.name.as_str(), values.data_type().clone(), false)
    }));
    let schema = Arc::new(Schema::new(fields));
    let written = guarded(|| {
        let mut writer = writer(&schema)?;
        for (number, part) in cloud.points.chunks(ROWS).enumerate() {
            let axis = |axis: usize| -> ArrayRef {
                let values = part.iter().map(|point| point[axis]);
                match kind {
                    DataType::Float32 => Arc::new(values.map(|value| value as f32).collect::<Float32Array>()),
                    _ => Arc::new(values.collect::<Float64Array>()),
                }
            };
            let begin = number * ROWS;
            let mut columns = vec![axis(0), axis(1), axis(2)];
            let rows = begin..begin + part.len();
            columns.extend(cloud.attributes.iter().map(|a| column_of(&a.values, rows.clone())));
            writer.write(&RecordBatch::try_new(Arc::clone(&schema), columns)?)?;
        }
        writer.into_inner()
    });
    written.map_err(failed)
}

/// Values as they are; 0 past their end.
fn column_of(values: &AttributeValues, rows: Range<usize>) -> ArrayRef {
    macro_rules! column {
        ($values:expr, $array:ty) => {
            Arc::new(rows.map(|row| $values.get(row).copied().unwrap_or_default()).collect::<$array>())
        };
    }
    match values {
        AttributeValues::I8(v) => column!(v, Int8Array),
        AttributeValues::U8(v) => column!(v, UInt8Array),
        AttributeValues::I16(v) => column!(v, Int16Array),
        AttributeValues::U16(v) => column!(v, UInt16Array),
        AttributeValues::I32(v) => column!(v, Int32Array),
        AttributeValues::U32(v) => column!(v, UInt32Array),
        AttributeValues::I64(v) => column!(v, Int64Array),
        AttributeValues::U64(v) => column!(v, UInt64Array),
        AttributeValues::F32(v) => column!(v, Float32Array),
        AttributeValues::F64(v) => column!(v, Float64Array),
    }
}

/// Three columns that change together.
struct Change {
    axes: [usize; 3],
    new: Vec<[f64; 3]>,
    kinds: [DataType; 3],
}

impl Change {
    fn column(&self, axis: usize, begin: usize, length: usize) -> ArrayRef {
        let values = || self.new.iter().skip(begin).take(length).map(|point| point[axis]);
        match self.kinds[axis] {
            DataType::Float32 => Arc::new(values().map(|value| value as f32).collect::<Float32Array>()),
            _ => Arc::new(values().collect::<Float64Array>()),
        }
    }
}

/// The columns that a moved copy changes.
///
/// # Errors
/// [`FormatError::Unwritable`] for points in lists.
pub(super) fn moved_columns(place: &Place) -> Result<[usize; 3], FormatError> {
    match place {
        Place::Columns(axes) => Ok(*axes),
        _ => Err(Room::refusal(
            "a moved copy of points in lists is not supported; write .ply, or save columns x, y and z",
        )),
    }
}

/// The file anew with `points` moved and the columns nx, ny and nz turned; all other columns stay.
pub(super) fn rewritten(
    table: &Table,
    options: &ReadOptions,
    place: &Place,
    points: &[[f64; 3]],
    motion: &Rigid,
) -> Result<Vec<u8>, FormatError> {
    let axes = moved_columns(place)?;
    let old = table.metadata.schema();
    let kind = |column: usize| old.field(column).data_type().clone();
    let new: Vec<[f64; 3]> = points.iter().map(|&point| moved(motion, point)).collect();
    let floats = axes.iter().all(|&axis| kind(axis) == DataType::Float32);
    let enough = floats && stays_single(points, &new).is_ok();
    let kinds = [0, 1, 2].map(|axis| {
        let single = kind(axes[axis]) == DataType::Float32
            && Scalar::F32.for_moved(axis, points, &new, enough) == Scalar::F32;
        if single { DataType::Float32 } else { DataType::Float64 }
    });
    let mut changes = vec![Change { axes, new, kinds }];
    let find = |name: &str| old.fields().iter().position(|field| field.name().eq_ignore_ascii_case(name));
    if let (Some(x), Some(y), Some(z)) = (find("nx"), find("ny"), find("nz")) {
        let axes = [x, y, z];
        let floats = axes.map(kind).iter().all(|kind| matches!(kind, DataType::Float32 | DataType::Float64));
        if floats {
            let new =
                triples(table, axes, options)?.into_iter().map(|normal| turned(motion, normal)).collect();
            changes.push(Change { axes, new, kinds: axes.map(kind) });
        }
    }
    let fields: Vec<Field> = old
        .fields()
        .iter()
        .enumerate()
        .map(|(column, field)| {
            let change = changes
                .iter()
                .find_map(|change| Some(&change.kinds[change.axes.iter().position(|&axis| axis == column)?]));
            let field = field.as_ref().clone();
            match change {
                Some(kind) => field.with_data_type(kind.clone()),
                None => field,
            }
        })
        .collect();
    let schema = Arc::new(Schema::new_with_metadata(fields, old.metadata().clone()));
    let mut writer = guarded(|| writer(&schema)).map_err(failed)?;
    let all: Vec<usize> = (0..schema.fields().len()).collect();
    let mut begin = 0;
    table.batches(&all, options, |batch| {
        let mut columns = batch.columns().to_vec();
        for change in &changes {
            for (axis, &column) in change.axes.iter().enumerate() {
                columns[column] = change.column(axis, begin, batch.num_rows());
            }
        }
        begin += batch.num_rows();
        guarded(|| writer.write(&RecordBatch::try_new(Arc::clone(&schema), columns)?)).map_err(failed)
    })?;
    guarded(|| writer.into_inner()).map_err(failed)
}

/// The numbers of three columns.
fn triples(table: &Table, axes: [usize; 3], options: &ReadOptions) -> Result<Vec<[f64; 3]>, FormatError> {
    let mut triples = Vec::new();
    let mut order = axes.to_vec();
    order.sort_unstable();
    table.batches(&axes, options, |batch| {
        let mut columns = Vec::new();
        for axis in axes {
            let at = order.iter().position(|&column| column == axis).unwrap_or(0);
            columns.push(numbers(batch.column(at))?);
        }
        triples.extend((0..batch.num_rows()).map(|row| [columns[0][row], columns[1][row], columns[2][row]]));
        Ok(())
    })?;
    Ok(triples)
}
