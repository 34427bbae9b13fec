//! The arrays of VTK's XML files: numbers as text, or bytes in base64 or behind the XML, as they are
//! or packed by zlib.

use std::borrow::Cow;
use std::cell::Cell;
use std::io::Read;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use flate2::read::ZlibDecoder;

use super::super::scalar::Scalar;
use super::super::scan::{number, quote, words};
use super::super::{FormatError, ReadOptions};

/// Packed arrays may be this many times larger than their bytes in the file, and `SLACK` more.
const RATIO: usize = 200;
const SLACK: usize = 1 << 20;

/// How the arrays of a file are kept.
#[derive(Debug)]
pub(super) struct Storage<'a> {
    pub big_endian: bool,
    /// Numbers in front of the bytes have 64 bits, not 32.
    pub long: bool,
    pub zipped: bool,
    /// What packs them where it is not zlib; numbers as text are read all the same.
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
    fn check_packer(&self) -> Result<(), FormatError> {
        self.packer.map_or(Ok(()), |packer| {
            Err(FormatError::Content(format!(
                "arrays packed by {} are not supported; save with vtkZLibDataCompressor or without",
                quote(packer.as_bytes())
            )))
        })
    }

    /// The numbers of an array inside the XML, in base64.
    pub fn inline(&self, text: &str, kind: Scalar) -> Result<Vec<f64>, FormatError> {
        self.check_packer()?;
        let text: Vec<u8> = text.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
        self.base64(&text, kind)
    }

    /// The numbers of an array behind the XML.
    pub fn appended(&self, offset: usize, kind: Scalar) -> Result<Vec<f64>, FormatError> {
        self.check_packer()?;
        let bytes = self.appended.get(offset..).filter(|bytes| !bytes.is_empty());
        let bytes = bytes.ok_or_else(|| {
            let found = format!("{} bytes of appended data", self.appended.len());
            FormatError::truncated(format!("an array at byte {offset}"), found)
        })?;
        if self.appended_base64 {
            return self.base64(bytes, kind);
        }
        let word = if self.long { 8 } else { 4 };
        let count = if self.zipped { self.words(bytes, 1)?[0].saturating_add(3) } else { 1 };
        let length = count.checked_mul(word).filter(|&length| length <= bytes.len());
        let length = length.ok_or_else(|| short("a header", bytes.len()))?;
        let header = self.words(bytes, count)?;
        self.numbers(&header, &bytes[length..], kind)
    }

    /// As [`appended`](Self::appended) for bytes in base64: the header and the data are encoded
    /// apart where the data is packed, otherwise in one go.
    fn base64(&self, text: &[u8], kind: Scalar) -> Result<Vec<f64>, FormatError> {
        let word = if self.long { 8 } else { 4 };
        if !self.zipped {
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
        let size = if self.zipped { unpacked_size(header) } else { header.first().copied().unwrap_or(0) };
        let bytes_of = |packed: usize| packed.saturating_add((size / kind.size()).saturating_mul(8));
        self.options.check_memory("an array", self.held, bytes_of(if self.zipped { size } else { 0 }))?;
        let bytes = if self.zipped {
            Cow::Owned(unpacked(header, bytes)?)
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
fn unpacked(header: &[usize], mut bytes: &[u8]) -> Result<Vec<u8>, FormatError> {
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
        let mut unpacking = ZlibDecoder::new(block).take(room as u64);
        unpacking
            .read_to_end(&mut out)
            .map_err(|e| FormatError::Content(format!("a packed array is damaged: {e}")))?;
        if out.len() - begin != expected {
            return Err(short(&format!("{expected} bytes"), out.len() - begin));
        }
    }
    Ok(out)
}
