//! Rows of a Parquet file as values: text, numbers and truth values.

use arrow_array::cast::AsArray;
use arrow_array::types::{
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type, UInt32Type,
    UInt64Type,
};
use arrow_array::{Array, ArrayRef};
use arrow_schema::DataType;
use bytes::Bytes;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::{Map, Value};

use super::pair::Record;

/// The rows of a file.
///
/// # Errors
/// What is wrong with the file; the column whose type is none of those.
pub fn records(file: Bytes) -> Result<Vec<Record>, String> {
    let whole = |e: &dyn std::fmt::Display| format!("not a whole Parquet file ({e}); write it again");
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| whole(&e))?;
    let mut rows: Vec<Record> = Vec::new();
    for batch in builder.build().map_err(|e| whole(&e))? {
        let batch = batch.map_err(|e| whole(&e))?;
        let mut some: Vec<Map<String, Value>> = vec![Map::new(); batch.num_rows()];
        for (field, column) in batch.schema().fields().iter().zip(batch.columns()) {
            let name = field.name();
            let values = values(column).ok_or_else(|| {
                format!("the column `{name}` holds {}; text, numbers and truth values can be carried: leave it out", field.data_type())
            })?;
            for (row, value) in some.iter_mut().zip(values) {
                row.insert(name.clone(), value);
            }
        }
        for row in some {
            rows.push((format!("row {}", rows.len() + 1), row));
        }
    }
    Ok(rows)
}

/// The values of a column; `None` for other types.
pub fn values(column: &ArrayRef) -> Option<Vec<Value>> {
    macro_rules! numbers {
        ($kind:ty) => {
            column.as_primitive::<$kind>().iter().map(Value::from).collect()
        };
    }
    Some(match column.data_type() {
        DataType::Null => vec![Value::Null; column.len()],
        DataType::Utf8 => column.as_string::<i32>().iter().map(Value::from).collect(),
        DataType::LargeUtf8 => column.as_string::<i64>().iter().map(Value::from).collect(),
        DataType::Utf8View => column.as_string_view().iter().map(Value::from).collect(),
        DataType::Boolean => column.as_boolean().iter().map(Value::from).collect(),
        DataType::Int8 => numbers!(Int8Type),
        DataType::Int16 => numbers!(Int16Type),
        DataType::Int32 => numbers!(Int32Type),
        DataType::Int64 => numbers!(Int64Type),
        DataType::UInt8 => numbers!(UInt8Type),
        DataType::UInt16 => numbers!(UInt16Type),
        DataType::UInt32 => numbers!(UInt32Type),
        DataType::UInt64 => numbers!(UInt64Type),
        DataType::Float32 => numbers!(Float32Type),
        DataType::Float64 => numbers!(Float64Type),
        DataType::Dictionary(..) => {
            let dictionary = column.as_any_dictionary();
            let (keys, known) = (dictionary.keys(), values(dictionary.values())?);
            if known.is_empty() {
                return Some(vec![Value::Null; column.len()]);
            }
            let places = dictionary.normalized_keys();
            let at = |(i, place): (usize, &usize)| {
                if keys.is_null(i) { Value::Null } else { known.get(*place).cloned().unwrap_or_default() }
            };
            places.iter().enumerate().map(at).collect()
        }
        _ => return None,
    })
}
