//! The compressed points of LAZ, by the `laz` crate. It allocates by the words of a file and panics
//! on some of them; so the words are checked before, and a panic becomes an error.

use std::io::{self, Cursor};

use laz::laszip::LazItemType;
use laz::{LasZipCompressor, LasZipDecompressor, LazVlr};

use super::super::{FormatError, ReadOptions};
use super::header::LasHeader;
use super::laz_record::{damaged, guarded};

/// Points may unpack to this many times the file's size and `SLACK` more: real clouds do not come
/// near, and a small file cannot fill the memory.
const RATIO: usize = 200;
const SLACK: usize = 1 << 20;

/// Layers of a chunk where fields are compressed apart; `None` where they are not.
fn layers(vlr: &LazVlr) -> Option<usize> {
    let count = |item: LazItemType| match item {
        LazItemType::Point14 => Some(9),
        LazItemType::RGB14 | LazItemType::WavePacket14 => Some(1),
        LazItemType::RGBNIR14 => Some(2),
        LazItemType::Byte14(count) => Some(usize::from(count)),
        _ => None,
    };
    vlr.items().iter().map(|item| count(item.item_type())).sum()
}

fn long(bytes: &[u8], at: usize) -> Option<i64> {
    bytes.get(at..)?.first_chunk().map(|&word| i64::from_le_bytes(word))
}

fn int(bytes: &[u8], at: usize) -> Option<usize> {
    bytes.get(at..)?.first_chunk().map(|&word| u32::from_le_bytes(word) as usize)
}

/// Checks that the table of chunks is no longer than the file allows.
fn check_table(bytes: &[u8], at: usize, length: usize) -> Result<(), FormatError> {
    let first = long(bytes, at).ok_or_else(|| damaged("there is no table of chunks"))?;
    let last = bytes.len().checked_sub(8).and_then(|at| long(bytes, at));
    for table in [Some(first), last].into_iter().flatten().filter_map(|at| usize::try_from(at).ok()) {
        let chunks = table.checked_add(4).and_then(|at| int(bytes, at)).unwrap_or(0);
        // Each chunk begins with an uncompressed point. Words at the end of the file may be data.
        if table as i64 == first && chunks > bytes.len() / length + 1 {
            return Err(damaged(format!("{chunks} chunks announced")));
        }
        if first <= at as i64 && chunks > bytes.len() / length + 1 {
            return Err(damaged(format!("{chunks} chunks announced")));
        }
    }
    Ok(())
}

/// Checks the sizes of the layers of the chunk that begins at `at`; the number of its points.
fn check_layers(bytes: &[u8], at: usize, length: usize, layers: usize) -> Result<usize, FormatError> {
    let sizes = at.saturating_add(length).saturating_add(4);
    let points = int(bytes, sizes.saturating_sub(4)).ok_or_else(|| damaged("a chunk is missing"))?;
    let mut end = sizes.saturating_add(layers * 4);
    for layer in 0..layers {
        let size =
            int(bytes, sizes.saturating_add(layer * 4)).ok_or_else(|| damaged("a chunk is missing"))?;
        end = end.saturating_add(size);
    }
    if end > bytes.len() {
        return Err(damaged(format!("a chunk up to byte {end} of {}", bytes.len())));
    }
    Ok(points)
}

/// The records of all points.
pub(super) fn decompress(
    header: &LasHeader,
    vlr: LazVlr,
    bytes: &[u8],
    options: &ReadOptions,
) -> Result<Vec<u8>, FormatError> {
    let length = header.record_length;
    let size = usize::try_from(header.points).ok().and_then(|n| n.checked_mul(length));
    let most = bytes.len().saturating_mul(RATIO).saturating_add(SLACK);
    let size = size.filter(|&size| size <= most).ok_or_else(|| {
        damaged(format!("{} points of {length} bytes announced in {} bytes", header.points, bytes.len()))
    })?;
    // The records, which grow as points come.
    options.check_memory("the unpacked points", bytes.len(), size.saturating_mul(2))?;
    if size == 0 {
        return Ok(Vec::new());
    }
    check_table(bytes, header.points_at, length)?;
    let layers = layers(&vlr);
    let (fixed, variable) = (vlr.chunk_size(), vlr.uses_variable_size_chunks());
    guarded(|| {
        let mut source = Cursor::new(bytes);
        source.set_position(header.points_at as u64);
        let mut decompressor = LasZipDecompressor::new(source, vlr)?;
        // Grown as points come, in case the file has fewer.
        let mut records: Vec<u8> = Vec::new();
        let mut left = 0;
        while records.len() < size {
            if let Some(layers) = layers.filter(|_| left == 0) {
                let at = decompressor.get().position() as usize;
                let points = check_layers(bytes, at, length, layers).map_err(io::Error::from)?;
                left = if variable { points } else { fixed as usize };
            }
            let begin = records.len();
            records.resize(begin + length, 0);
            decompressor.decompress_one(&mut records[begin..])?;
            left = left.saturating_sub(1);
        }
        Ok(records)
    })
}

/// Appends compressed records to `bytes`.
pub(super) fn compress(bytes: &mut Vec<u8>, vlr: LazVlr, records: &[u8]) -> io::Result<()> {
    let mut out = Cursor::new(std::mem::take(bytes));
    out.set_position(out.get_ref().len() as u64);
    let written = guarded(|| {
        let mut compressor = LasZipCompressor::new(out, vlr)?;
        compressor.compress_many(records)?;
        compressor.done()?;
        Ok(compressor.into_inner().into_inner())
    });
    *bytes = written.map_err(|e| FormatError::Unwritable(format!("cannot compress as LAZ: {e}")))?;
    Ok(())
}
