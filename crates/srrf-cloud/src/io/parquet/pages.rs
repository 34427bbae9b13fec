//! What the headers of pages ask for, before the `parquet` crate takes memory for it.

use std::io::{self, Read};

use flate2::read::MultiGzDecoder;
use parquet::basic::Compression;

use super::super::FormatError;
use super::thrift::{DEPTH, FALSE, I32, STRUCT, Thrift, damaged};

/// Snappy's longest copy: 64 bytes for 3.
const SNAPPY: u64 = 22;
/// What a byte can unpack to at most, by the design of Deflate and of LZ4.
const DEFLATE: u64 = 1032;
const LZ4: u64 = 255;
/// How a frame of LZ4 begins.
const LZ4_FRAME: [u8; 4] = [0x04, 0x22, 0x4d, 0x18];
/// A block of Zstandard is at most so many bytes, and takes 4 at least.
const ZSTD_BLOCK: u64 = 128 << 10;
/// How a frame of Zstandard begins.
const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// What a column takes once it is unpacked.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Unpacked {
    /// Bytes of its largest page.
    pub page: u64,
    /// Values of all pages.
    pub values: u64,
}

/// Whether this program unpacks it.
pub(super) fn is_known(packing: Compression) -> bool {
    packing != Compression::LZO
}

/// Looks at the headers of the pages of a column in `bytes[begin..end]`. Pages of more than `most` bytes are not looked into.
pub(super) fn pages(
    bytes: &[u8],
    begin: u64,
    end: u64,
    packing: Compression,
    most: u64,
) -> Result<Unpacked, FormatError> {
    let place = |at: u64| usize::try_from(at).ok().filter(|&at| at <= bytes.len());
    let outside = || damaged(format!("a column up to byte {end}"));
    let (mut at, end) = place(begin).zip(place(end)).ok_or_else(outside)?;
    let mut all = Unpacked::default();
    while at < end {
        let mut thrift = Thrift { bytes: &bytes[..end], at };
        let page = page(&mut thrift).ok_or_else(|| damaged("the header of a page makes no sense"))?;
        let PageHeader { unpacked, packed, values, .. } = page;
        let [unpacked, packed, values] = [unpacked, packed, values].map(u64::try_from);
        let (Ok(unpacked), Ok(packed), Ok(values)) = (unpacked, packed, values) else {
            return Err(damaged("the header of a page has negative sizes"));
        };
        at = usize::try_from(packed)
            .ok()
            .and_then(|packed| thrift.at.checked_add(packed))
            .ok_or_else(outside)?;
        let body = bytes.get(thrift.at..at).ok_or_else(outside)?;
        let whole = page.most(body, packing);
        if unpacked > whole {
            return Err(damaged(format!(
                "the header of a page asks for {unpacked} bytes, and what it packs in {packed} is {whole} at most"
            )));
        }
        if unpacked <= most && page.is_larger(body, packing, unpacked) {
            return Err(damaged(format!(
                "a page unpacks to more than the {unpacked} bytes that its header says"
            )));
        }
        all.page = all.page.max(unpacked);
        all.values = all.values.saturating_add(values);
    }
    Ok(all)
}

/// The header of a page.
#[derive(Debug, Clone, Copy, Default)]
struct PageHeader {
    /// Bytes before and after packing.
    unpacked: i64,
    packed: i64,
    values: i64,
    /// Bytes at its front that are never packed.
    levels: i64,
    /// Whether nothing else is packed either.
    plain: bool,
}

impl PageHeader {
    /// Most bytes that `body` can unpack to.
    fn most(self, body: &[u8], packing: Compression) -> u64 {
        let levels = usize::try_from(self.levels).unwrap_or(usize::MAX).min(body.len());
        let (front, rest) = body.split_at(levels);
        let (front, size) = (front.len() as u64, rest.len() as u64);
        front.saturating_add(match packing {
            _ if self.plain || rest.is_empty() => size,
            Compression::UNCOMPRESSED => size,
            Compression::SNAPPY => size.saturating_mul(SNAPPY),
            Compression::GZIP(_) => size.saturating_mul(DEFLATE),
            Compression::LZ4 | Compression::LZ4_RAW => size.saturating_mul(LZ4),
            Compression::ZSTD(_) => zstd_size(rest).unwrap_or((size / 4 + 1).saturating_mul(ZSTD_BLOCK)),
            // Brotli has no such number.
            _ => u64::MAX,
        })
    }

    /// Whether `body` unpacks to more than `unpacked` bytes. The `parquet` crate unpacks to the end whatever the header
    /// says, where the packing does not need to know it.
    fn is_larger(self, body: &[u8], packing: Compression, unpacked: u64) -> bool {
        let levels = usize::try_from(self.levels).unwrap_or(usize::MAX).min(body.len());
        let (front, rest) = body.split_at(levels);
        let most = unpacked.saturating_sub(front.len() as u64);
        let larger = |reader: &mut dyn Read| {
            io::copy(&mut reader.take(most.saturating_add(1)), &mut io::sink()).is_ok_and(|size| size > most)
        };
        match packing {
            _ if self.plain => false,
            Compression::GZIP(_) => larger(&mut MultiGzDecoder::new(rest)),
            Compression::BROTLI(_) => larger(&mut brotli::Decompressor::new(rest, 4096)),
            // Older programs wrote frames.
            Compression::LZ4 if rest.starts_with(&LZ4_FRAME) => {
                larger(&mut lz4_flex::frame::FrameDecoder::new(rest))
            }
            _ => false,
        }
    }
}

/// What a frame of Zstandard says that it unpacks to, where it says so.
fn zstd_size(frame: &[u8]) -> Option<u64> {
    let rest = frame.strip_prefix(&ZSTD)?;
    let (&descriptor, rest) = rest.split_first()?;
    let alone = descriptor & 0x20 != 0;
    let dictionary = [0, 1, 2, 4][usize::from(descriptor & 3)];
    let rest = rest.get(dictionary + usize::from(!alone)..)?;
    let size = match descriptor >> 6 {
        0 if alone => 1,
        0 => return None,
        flag => 1 << flag,
    };
    let mut number = [0; 8];
    number[..size].copy_from_slice(rest.get(..size)?);
    Some(u64::from_le_bytes(number) + if size == 2 { 256 } else { 0 })
}

fn page(thrift: &mut Thrift<'_>) -> Option<PageHeader> {
    let mut found = PageHeader::default();
    let mut last = 0;
    while let Some((id, kind)) = thrift.field(&mut last)? {
        match (id, kind) {
            (2, I32) => found.unpacked = thrift.int()?,
            (3, I32) => found.packed = thrift.int()?,
            // Pages of data (two versions) and of a dictionary; their first field is the number of values.
            (5 | 7 | 8, STRUCT) => {
                let mut last = 0;
                while let Some((inner, kind)) = thrift.field(&mut last)? {
                    match (id, inner, kind) {
                        (_, 1, I32) => found.values = thrift.int()?,
                        (8, 5 | 6, I32) => found.levels = found.levels.checked_add(thrift.int()?.max(0))?,
                        (8, 7, FALSE) => found.plain = true,
                        _ => thrift.skip(kind, DEPTH)?,
                    }
                }
            }
            _ => thrift.skip(kind, DEPTH)?,
        }
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use parquet::basic::ZstdLevel;

    use super::*;

    /// A number below 2^20 as Thrift has it.
    fn int(value: u32) -> Vec<u8> {
        let value = 2 * value;
        vec![value as u8 | 0x80, (value >> 7) as u8 | 0x80, (value >> 14) as u8]
    }

    fn of(unpacked: u32, body: &[u8], packing: Compression) -> Result<Unpacked, String> {
        let mut bytes = vec![0x15, 0];
        for number in [unpacked, body.len() as u32] {
            bytes.push(0x15);
            bytes.extend(int(number));
        }
        bytes.extend([0x2c, 0x15, 6, 0, 0]); // three values
        bytes.extend(body);
        pages(&bytes, 0, bytes.len() as u64, packing, u64::MAX).map_err(|e| e.to_string())
    }

    #[test]
    fn a_page_asks_for_no_more_than_it_can_unpack_to() {
        let zstd = Compression::ZSTD(ZstdLevel::default());
        let body = [7; 100];
        // A frame that says its size in one, two and four bytes, and one that does not say it.
        let [one, two, four, none] = [&[0x20, 200][..], &[0x60, 0, 1], &[0xa0, 0, 0, 1, 0], &[0, 1]]
            .map(|size| [&ZSTD[..], size, &body].concat());
        for (body, packing, most) in [
            (&body[..], Compression::UNCOMPRESSED, 100),
            (&body, Compression::SNAPPY, 2_200),
            (&one, zstd, 200),
            (&two, zstd, 512),
            (&four, zstd, 65_536),
            (&none, Compression::SNAPPY, 22 * 106),
            (&none[..8], zstd, 3 * 131_072),
        ] {
            assert_eq!(of(most, body, packing), Ok(Unpacked { page: u64::from(most), values: 3 }));
            let error = of(most + 1, body, packing).unwrap_err();
            assert!(error.contains(&format!("asks for {} bytes", most + 1)), "{error}");
        }
        assert!(of(9, &[], Compression::SNAPPY).is_err(), "nothing is in nothing");
    }

    #[test]
    fn a_page_holds_no_more_than_it_says() {
        use std::io::Write;

        use flate2::write::GzEncoder;
        use parquet::basic::{BrotliLevel, GzipLevel};

        let plain = [7; 3000];
        let mut gzip = GzEncoder::new(Vec::new(), flate2::Compression::default());
        gzip.write_all(&plain).unwrap();
        let mut brotli = brotli::CompressorWriter::new(Vec::new(), 4096, 5, 20);
        brotli.write_all(&plain).unwrap();
        let mut frame = lz4_flex::frame::FrameEncoder::new(Vec::new());
        frame.write_all(&plain).unwrap();
        for (body, packing) in [
            (gzip.finish().unwrap(), Compression::GZIP(GzipLevel::default())),
            (brotli.into_inner(), Compression::BROTLI(BrotliLevel::default())),
            (frame.finish().unwrap(), Compression::LZ4),
        ] {
            assert_eq!(of(3000, &body, packing), Ok(Unpacked { page: 3000, values: 3 }), "{packing}");
            let error = of(2999, &body, packing).unwrap_err();
            assert!(error.contains("more than the 2999 bytes"), "{packing}: {error}");
        }
        let error = of(1033, &[0], Compression::GZIP(GzipLevel::default())).unwrap_err();
        assert!(error.contains("1032 at most"), "{error}");
        let error = of(256, &[0], Compression::LZ4_RAW).unwrap_err();
        assert!(error.contains("255 at most"), "{error}");
    }

    #[test]
    fn levels_are_not_packed() {
        // Version 2: 3 values, levels of 4 and 6 bytes, and all of it unpacked or not.
        let page = |unpacked: u32, plain: bool| {
            let mut bytes = vec![0x15, 6, 0x15];
            bytes.extend(int(unpacked));
            bytes.extend([0x15, 40, 0x5c, 0x15, 6, 0x45, 8, 0x15, 12, if plain { 0x12 } else { 0x11 }, 0, 0]);
            bytes.extend([0; 20]);
            pages(&bytes, 0, bytes.len() as u64, Compression::SNAPPY, u64::MAX).map(|all| all.page).ok()
        };
        assert_eq!((page(10 + 220, false), page(10 + 221, false)), (Some(230), None));
        assert_eq!((page(20, true), page(21, true)), (Some(20), None));
    }
}
