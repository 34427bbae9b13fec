//! What formats with several scans in a file share.

use super::scalar::Scalar;
use super::{AttributeValues, FormatError};

/// An error for a scan that a file does not have.
pub(super) fn no_such_scan(number: usize, count: usize) -> FormatError {
    let there = if count == 1 { "one scan".to_owned() } else { format!("{count} scans, numbered from 1") };
    FormatError::Content(format!("scan {number} is asked for, and the file has {there}"))
}

/// Values of one type for each point.
pub(super) fn attribute_values(kind: Scalar, values: impl Iterator<Item = f64>) -> AttributeValues {
    match kind {
        Scalar::I8 => AttributeValues::I8(values.map(|value| value as i8).collect()),
        Scalar::U8 => AttributeValues::U8(values.map(|value| value as u8).collect()),
        Scalar::I16 => AttributeValues::I16(values.map(|value| value as i16).collect()),
        Scalar::U16 => AttributeValues::U16(values.map(|value| value as u16).collect()),
        Scalar::I32 => AttributeValues::I32(values.map(|value| value as i32).collect()),
        Scalar::U32 => AttributeValues::U32(values.map(|value| value as u32).collect()),
        Scalar::I64 => AttributeValues::I64(values.map(|value| value as i64).collect()),
        Scalar::U64 => AttributeValues::U64(values.map(|value| value as u64).collect()),
        Scalar::F16 | Scalar::F32 => AttributeValues::F32(values.map(|value| value as f32).collect()),
        Scalar::F64 => AttributeValues::F64(values.collect()),
    }
}
