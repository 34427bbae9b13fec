//! The arrays of VTK's XML files: numbers as text, or bytes in base64 or behind the XML, as they are
//! or packed by zlib, LZ4 or LZMA.

use std::borrow::Cow;
use std::cell::Cell;
use std::io::Read;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use flate2::read::ZlibDecoder;
use lzma_rust2::XzReader;

use super::super::scalar::Scalar;
use super::super::scan::{number, quote, words};
use super::super::{FormatError, ReadOptions};

/// Packed arrays may be this many times larger than their bytes in the file, and `SLACK` more.
const RATIO: usize = 200;
const SLACK: usize = 1 << 20;

/// The most memory that the dictionary of a block of LZMA may take, in KiB.
const LZMA_MEMORY: u32 = 256 << 10;

/// What packs the blocks of arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Packer {
    Zlib,
    /// Blocks without a frame.
    Lz4,
    /// As `.xz` has it.
    Lzma,
}

impl Packer {
    /// That of this name in VTK.
    pub fn of(name: &str) -> Option<Self> {
        match name {
            "vtkZLibDataCompressor" => Some(Self::Zlib),
            "vtkLZ4DataCompressor" => Some(Self::Lz4),
            "vtkLZMADataCompressor" => Some(Self::Lzma),
            _ => None,
        }
    }

    /// Unpacks `block` to the end of `out`: `most` bytes, or one more where there are more.
    fn unpack(self, block: &[u8], most: usize, out: &mut Vec<u8>) -> Result<(), FormatError> {
        let damaged =
            |e: &dyn std::fmt::Display| FormatError::Content(format!("a packed array is damaged: {e}"));
        match self {
            Self::Zlib => {
                ZlibDecoder::new(block).take(most as u64 + 1).read_to_end(out).map_err(|e| damaged(&e))?
            }
            Self::Lzma => {
                let unpacking = XzReader::new_mem_limit(block, false, LZMA_MEMORY);
                unpacking.take(most as u64 + 1).read_to_end(out).map_err(|e| damaged(&e))?
            }
            Self::Lz4 => {
                let begin = out.len();
                out.resize(begin + most, 0);
                let size =
                    lz4_flex::block::decompress_into(block, &mut out[begin..]).map_err(|e| damaged(&e))?;
                out.truncate(begin + size);
                size
            }
        };
        Ok(())
    }
}

/// How the arrays of a file are kept.
#[derive(Debug)]
pub(super) struct Storage<'a> {
    pub big_endian: bool,
    /// Numbers in front of the bytes have 64 bits, not 32.
    pub long: bool,
    /// What packs them, by VTK's name.
    pub packer: Option<&'a str>,
    /// What follows the XML, behind its underscore.
    pub appended: &'a [u8],
    pub appended_base64: bool,
    /// Numbers that may still be read: arrays can share their bytes, so that few bytes could ask for any
    /// number of them.
    pub budget: Cell<usize>,
    /// How much memory may be taken, beside the bytes of the file.
    pub options: &'a ReadOptions,
    pub held: usize,
}

/// The numbers of text.
pub(super) fn of_text(text: &str) -> Result<Vec<f64>, FormatError> {
    words(text.as_bytes()).map(|(_, word)| number(word).map_err(FormatError::Content)).collect()
}

/// The numbers that a file of `bytes` bytes can hold.
pub(super) fn budget(bytes: usize, zipped: bool) -> Cell<usize> {
    Cell::new(if zipped { bytes.saturating_mul(RATIO).saturating_add(SLACK) } else { bytes })
}

impl Storage<'_> {
    /// What packs the arrays; numbers as text are read whatever it is.
    fn packing(&self) -> Result<Option<Packer>, FormatError> {
        let Some(name) = self.packer else { return Ok(None) };
        let known = Packer::of(name).ok_or_else(|| {
            FormatError::Content(format!(
                "arrays packed by {} are not supported; save with vtkZLibDataCompressor or without",
                quote(name.as_bytes())
            ))
        });
        known.map(Some)
    }

    /// The numbers of an array inside the XML, in base64.
    pub fn inline(&self, text: &str, kind: Scalar) -> Result<Vec<f64>, FormatError> {
        self.packing()?;
        let text: Vec<u8> = text.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
        self.base64(&text, kind)
    }

    /// The numbers of an array behind the XML.
    pub fn appended(&self, offset: usize, kind: Scalar) -> Result<Vec<f64>, FormatError> {
        self.packing()?;
        let bytes = self.appended.get(offset..).filter(|bytes| !bytes.is_empty());
        let bytes = bytes.ok_or_else(|| {
            let found = format!("{} bytes of appended data", self.appended.len());
            FormatError::truncated(format!("an array at byte {offset}"), found)
        })?;
        if self.appended_base64 {
            return self.base64(bytes, kind);
        }
        let word = if self.long { 8 } else { 4 };
        let count = if self.packer.is_some() { self.words(bytes, 1)?[0].saturating_add(3) } else { 1 };
        let length = count.checked_mul(word).filter(|&length| length <= bytes.len());
        let length = length.ok_or_else(|| short("a header", bytes.len()))?;
        let header = self.words(bytes, count)?;
        self.numbers(&header, &bytes[length..], kind)
    }

    /// As [`appended`](Self::appended) for bytes in base64: the header and the data are encoded
    /// apart where the data is packed, otherwise in one go.
    fn base64(&self, text: &[u8], kind: Scalar) -> Result<Vec<f64>, FormatError> {
        let word = if self.long { 8 } else { 4 };
        if self.packer.is_none() {
            // The first characters say how many there are.
            let begin = decoded(text, word)?;
            let size = self.words(&begin, 1)?[0];
            let header = word.div_ceil(3) * 4;
            if text.get(header - 1) == Some(&b'=') {
                // Some writers encode the size apart.
                return self.numbers(&[size], &decoded(text.get(header..).unwrap_or_default(), size)?, kind);
            }
            let all = decoded(text, size.saturating_add(word))?;
            return self.numbers(&[size], &all[word..], kind);
        }
        let blocks = self.words(&decoded(text, word)?, 1)?[0];
        let length = blocks.checked_add(3).and_then(|count| count.checked_mul(word));
        let length = length.filter(|&length| length <= text.len());
        let length = length.ok_or_else(|| short("a header", text.len()))?;
        let header = self.words(&decoded(text, length)?, blocks + 3)?;
        let sizes = header[3..].iter().fold(0usize, |sum, &size| sum.saturating_add(size));
        let text = text.get(length.div_ceil(3) * 4..).unwrap_or_default();
        self.numbers(&header, &decoded(text, sizes)?, kind)
    }

    /// The first `count` words of a header.
    fn words(&self, bytes: &[u8], count: usize) -> Result<Vec<usize>, FormatError> {
        let kind = if self.long { Scalar::U64 } else { Scalar::U32 };
        let word = |index: usize| kind.get(bytes, index * kind.size(), self.big_endian);
        // Sizes above 2^53 do not occur: they are larger than any file.
        (0..count)
            .map(|index| word(index).map(|word| word as usize).ok_or_else(|| short("a header", bytes.len())))
            .collect()
    }

    fn numbers(&self, header: &[usize], bytes: &[u8], kind: Scalar) -> Result<Vec<f64>, FormatError> {
        // Unpacked, and as numbers.
        let size =
            if self.packer.is_some() { unpacked_size(header) } else { header.first().copied().unwrap_or(0) };
        let bytes_of = |packed: usize| packed.saturating_add((size / kind.size()).saturating_mul(8));
        self.options.check_memory(
            "an array",
            self.held,
            bytes_of(if self.packer.is_some() { size } else { 0 }),
        )?;
        let bytes = if let Some(packer) = self.packing()? {
            Cow::Owned(unpacked(header, bytes, packer)?)
        } else {
            let size = header.first().copied().unwrap_or(0);
            Cow::Borrowed(bytes.get(..size).ok_or_else(|| short(&format!("{size} bytes"), bytes.len()))?)
        };
        let left = self.budget.get().checked_sub(bytes.len() / kind.size());
        let left = left.ok_or_else(|| FormatError::Content("arrays that are larger than the file".into()))?;
        self.budget.set(left);
        let rows = bytes.chunks_exact(kind.size());
        Ok(rows.map(|raw| kind.get(raw, 0, self.big_endian).unwrap_or(f64::NAN)).collect())
    }
}

fn short(expected: &str, found: usize) -> FormatError {
    FormatError::truncated(expected, format!("{found} bytes of an array"))
}

/// The first `size` bytes of base64; the rest of `text` may be anything.
fn decoded(text: &[u8], size: usize) -> Result<Vec<u8>, FormatError> {
    const ENGINE: GeneralPurpose = GeneralPurpose::new(
        &STANDARD,
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
    );
    let length = size.div_ceil(3).saturating_mul(4);
    let text = text.get(..length).ok_or_else(|| short(&format!("{size} bytes"), text.len() / 4 * 3))?;
    let mut bytes =
        ENGINE.decode(text).map_err(|e| FormatError::Content(format!("an array is not in base64: {e}")))?;
    if bytes.len() < size {
        return Err(short(&format!("{size} bytes"), bytes.len()));
    }
    bytes.truncate(size);
    Ok(bytes)
}

/// Bytes of the blocks of a header, unpacked.
fn unpacked_size(header: &[usize]) -> usize {
    let [_, size, last, packed @ ..] = header else { return 0 };
    let whole = if *last > 0 { packed.len().saturating_sub(1) } else { packed.len() };
    whole.saturating_mul(*size).saturating_add(if packed.is_empty() { 0 } else { *last })
}

/// Unpacks blocks: the header is their number, the size of each, that of the last, and the sizes of
/// all as they are packed.
fn unpacked(header: &[usize], mut bytes: &[u8], packer: Packer) -> Result<Vec<u8>, FormatError> {
    let [_, size, last, packed @ ..] = header else { return Err(short("a header", 0)) };
    let most = bytes.len().saturating_mul(RATIO).saturating_add(SLACK);
    let mut out = Vec::new();
    for (index, &length) in packed.iter().enumerate() {
        let is_last = index + 1 == packed.len();
        let expected = if is_last && *last > 0 { *last } else { *size };
        let block = bytes.get(..length).ok_or_else(|| short(&format!("{length} bytes"), bytes.len()))?;
        bytes = &bytes[length..];
        let begin = out.len();
        let room = most.saturating_sub(begin).min(expected);
        packer.unpack(block, room, &mut out)?;
        if out.len() - begin != expected {
            return Err(short(&format!("{expected} bytes"), out.len() - begin));
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::write::ZlibEncoder;

    use super::*;

    /// `numpy.arange(6, dtype="<f4").tobytes()` by Python's `lzma.compress(..., preset=6, check=lzma.CHECK_CRC32)`.
    const XZ: &[u8] = &[
        253, 55, 122, 88, 90, 0, 0, 1, 105, 34, 222, 54, 2, 0, 33, 1, 22, 0, 0, 0, 116, 47, 229, 163, 224, 0,
        23, 0, 18, 93, 0, 0, 105, 158, 97, 112, 104, 95, 31, 161, 129, 35, 250, 234, 120, 90, 88, 0, 0, 0, 0,
        0, 23, 144, 231, 145, 0, 1, 42, 24, 85, 225, 129, 92, 144, 66, 153, 13, 1, 0, 0, 0, 0, 1, 89, 90,
    ];

    #[test]
    fn every_packer_unpacks_what_it_packed() {
        let plain: Vec<u8> = (0..6u8).flat_map(|n| f32::from(n).to_le_bytes()).collect();
        let mut zlib = ZlibEncoder::new(Vec::new(), flate2::Compression::default());
        zlib.write_all(&plain).unwrap();
        let blocks = [
            ("vtkZLibDataCompressor", zlib.finish().unwrap()),
            ("vtkLZ4DataCompressor", lz4_flex::block::compress(&plain)),
            ("vtkLZMADataCompressor", XZ.to_vec()),
        ];
        for (name, block) in blocks {
            let packer = Packer::of(name).unwrap();
            let header = [1, 24, 0, block.len()];
            assert_eq!(unpacked(&header, &block, packer), Ok(plain.clone()), "{name}");
            // Two blocks, the second one shorter.
            let both = [&block[..], &block].concat();
            let header = [2, 24, 24, block.len(), block.len()];
            assert_eq!(unpacked(&header, &both, packer), Ok(plain.repeat(2)), "{name}");
            // Damaged, cut short, and of another size than the header says.
            for place in 0..block.len() {
                for bit in 0..8 {
                    let mut other = block.clone();
                    other[place] ^= 1 << bit;
                    let found = unpacked(&[1, 24, 0, other.len()], &other, packer);
                    assert!(found.is_err() || found.unwrap().len() == 24, "{name} {place} {bit}");
                }
                assert!(unpacked(&[1, 24, 0, place], &block[..place], packer).is_err(), "{name} {place}");
            }
            assert!(unpacked(&[1, 23, 0, block.len()], &block, packer).is_err(), "{name}: more than it says");
            assert!(unpacked(&[1, 25, 0, block.len()], &block, packer).is_err(), "{name}: less than it says");
        }
        assert_eq!(Packer::of("otherDataCompressor"), None);
    }
}
