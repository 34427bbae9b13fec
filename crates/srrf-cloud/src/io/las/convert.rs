//! LAS to LAZ and back: the same records, packed or not.

use std::io;

use laz::{LazItemRecordBuilder, LazVlr};

use super::super::{FormatError, ReadOptions, Room};
use super::header::{LasHeader, put_word};
use super::laz_record::guarded;
use super::{records, zipped};

/// Bytes of a point of each format, without extra bytes.
const LENGTHS: [usize; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// Checks that the points can be packed as LAZ, or unpacked.
///
/// # Errors
/// [`FormatError::Unwritable`].
pub(super) fn check(header: &LasHeader, bytes: &[u8], pack: bool) -> Result<(), FormatError> {
    if header.zipped == pack {
        return Ok(());
    }
    if header.waveforms_inside(bytes) {
        return Err(Room::refusal(
            "a file with waveforms inside stays LAS or LAZ as it is; write the extension that it has",
        ));
    }
    if pack { new_vlr(bytes[104] & 0x3f, header.record_length).map(drop) } else { Ok(()) }
}

/// The file with its points packed as LAZ, or not; all else as it is.
pub(super) fn repacked(bytes: &[u8], options: &ReadOptions, pack: bool) -> io::Result<Vec<u8>> {
    let header = LasHeader::parse(bytes)?;
    if header.zipped == pack {
        return Ok(bytes.to_vec());
    }
    check(&header, bytes, pack)?;
    let records = records(&header, bytes, options)?;
    let mut copy = bytes[..header.length()].to_vec();
    let mut behind = header.length();
    for record in header.variable_records(bytes) {
        behind = record.end;
        if !header.is_laz_record(bytes, &record) {
            copy.extend(&bytes[record]);
        }
    }
    let format = bytes[104] & 0x3f;
    let vlr = if pack { Some(new_vlr(format, header.record_length)?) } else { None };
    if let Some(vlr) = &vlr {
        copy.extend(super::header::laz_record(vlr)?);
    }
    // What a program left between the records and the points.
    copy.extend(&bytes[behind..header.points_at]);
    let count = header.record_count();
    let count = if pack { count.saturating_add(1) } else { count.saturating_sub(1) };
    put_word(&mut copy, 100, &count.to_le_bytes());
    put_word(&mut copy, 104, &[if pack { format | 0x80 } else { format }]);
    let at = copy.len() as u32;
    put_word(&mut copy, 96, &at.to_le_bytes());
    match vlr {
        Some(vlr) => zipped::compress(&mut copy, vlr, &records)?,
        None => copy.extend(&*records),
    }
    if let Some(tail) = header.extended_records(bytes) {
        let at = copy.len() as u64;
        put_word(&mut copy, 235, &at.to_le_bytes());
        copy.extend(tail);
    }
    Ok(copy)
}

/// How points of a format, with extra bytes, are packed.
fn new_vlr(format: u8, length: usize) -> Result<LazVlr, FormatError> {
    let unwritable = || {
        FormatError::Unwritable(format!(
            "points of format {format} in {length} bytes cannot be LAZ; write .las"
        ))
    };
    let least = *LENGTHS.get(usize::from(format)).ok_or_else(unwritable)?;
    let extra =
        length.checked_sub(least).and_then(|extra| u16::try_from(extra).ok()).ok_or_else(unwritable)?;
    let vlr = guarded(|| {
        Ok(LazVlr::from_laz_items(LazItemRecordBuilder::default_for_point_format_id(format, extra)?))
    })
    .map_err(|_| unwritable())?;
    Ok(vlr)
}
