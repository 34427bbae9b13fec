//! The record of a LAZ file that says how its points are compressed, read and written by the `laz` crate, whose panics
//! become errors.

use std::panic::{AssertUnwindSafe, catch_unwind};

use laz::laszip::LazItemType;
use laz::{LazItemRecordBuilder, LazVlr};

use super::super::FormatError;

pub(super) fn damaged(problem: impl std::fmt::Display) -> FormatError {
    FormatError::Content(format!("the compressed points are damaged or cut short: {problem}"))
}

/// Runs `work` of the `laz` crate.
pub(super) fn guarded<T>(work: impl FnOnce() -> laz::Result<T>) -> Result<T, FormatError> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(result) => result.map_err(damaged),
        Err(_) => Err(damaged("they follow no rules")),
    }
}

/// Reads the record that says how points of `length` bytes are compressed.
pub(super) fn vlr(content: &[u8], length: usize) -> Result<LazVlr, FormatError> {
    // The first word says the compressor: 1 is that of LASzip 1, point by point without chunks.
    if content.first_chunk() == Some(&[1, 0]) {
        return Err(FormatError::Content(
            "this kind of LAZ (LASzip 1, points without chunks) is not supported; write it anew as .las, with `las2las` or \
             `pdal translate`"
                .into(),
        ));
    }
    let vlr = guarded(|| LazVlr::from_buffer(content))?;
    let size = vlr.items().iter().map(|item| usize::from(item.size())).sum::<usize>();
    let known = vlr.items().iter().all(|item| match item.item_type() {
        LazItemType::Byte(_) | LazItemType::Byte14(_) => item.size() > 0,
        LazItemType::Point10 => item.size() == 20,
        LazItemType::GpsTime => item.size() == 8,
        LazItemType::RGB12 | LazItemType::RGB14 => item.size() == 6,
        LazItemType::WavePacket13 | LazItemType::WavePacket14 => item.size() == 29,
        LazItemType::Point14 => item.size() == 30,
        LazItemType::RGBNIR14 => item.size() == 8,
    });
    if size != length || !known || vlr.items().is_empty() {
        return Err(damaged(format!("items of {size} bytes for points of {length}")));
    }
    Ok(vlr)
}

pub(super) fn new_vlr(format: u8) -> Result<LazVlr, FormatError> {
    guarded(|| Ok(LazVlr::from_laz_items(LazItemRecordBuilder::default_for_point_format_id(format, 0)?)))
}

pub(super) fn vlr_bytes(vlr: &LazVlr) -> Result<Vec<u8>, FormatError> {
    let mut content = Vec::new();
    vlr.write_to(&mut content).map_err(damaged)?;
    Ok(content)
}
