//! Words and numbers of the legacy files of VTK.

use std::ops::Range;

use super::super::FormatError;
use super::super::scalar::Scalar;
use super::super::scan::{number, quote, words};

/// A type of numbers in a file of VTK: one of ours, or single bits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Number(Scalar),
    Bit,
    Text,
}

pub(super) fn kind(word: &[u8]) -> Result<Kind, FormatError> {
    let name = String::from_utf8_lossy(word).to_ascii_lowercase();
    Ok(Kind::Number(match name.as_str() {
        "bit" => return Ok(Kind::Bit),
        "string" | "utf8_string" => return Ok(Kind::Text),
        "char" | "signed_char" => Scalar::I8,
        "unsigned_char" => Scalar::U8,
        "short" => Scalar::I16,
        "unsigned_short" => Scalar::U16,
        // VTK writes its index type as int.
        "int" | "vtkidtype" => Scalar::I32,
        "unsigned_int" => Scalar::U32,
        "long" | "vtktypeint64" => Scalar::I64,
        "unsigned_long" | "vtktypeuint64" => Scalar::U64,
        "float" => Scalar::F32,
        "double" => Scalar::F64,
        _ => return Err(FormatError::Content(format!("{} is no type of numbers of VTK", quote(word)))),
    }))
}

/// Goes through the words and the numbers of a file.
pub(super) struct VtkCursor<'a> {
    pub bytes: &'a [u8],
    pub at: usize,
    pub binary: bool,
}

impl<'a> VtkCursor<'a> {
    pub fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// The next word and where it is.
    pub fn word(&mut self) -> Option<(Range<usize>, &'a [u8])> {
        let (skip, word) = words(self.rest()).next()?;
        let begin = self.at + skip;
        self.at = begin + word.len();
        Some((begin..self.at, word))
    }

    pub fn expect(&mut self, what: &str) -> Result<(Range<usize>, &'a [u8]), FormatError> {
        self.word().ok_or_else(|| FormatError::truncated(what, "the end of the file"))
    }

    pub fn count(&mut self, what: &str) -> Result<usize, FormatError> {
        let (_, word) = self.expect(what)?;
        std::str::from_utf8(word)
            .ok()
            .and_then(|word| word.parse().ok())
            .ok_or_else(|| FormatError::Content(format!("{} where {what} is expected", quote(word))))
    }

    pub fn peeks(&self, keyword: &[u8]) -> bool {
        let next = words(&self.rest()[..self.rest().len().min(64)]).next();
        next.is_some_and(|(_, word)| word.eq_ignore_ascii_case(keyword))
    }

    /// Skips what is left of a line.
    pub fn end_line(&mut self) {
        let end = self.rest().iter().position(|&b| b == b'\n');
        self.at += end.map_or(self.rest().len(), |end| end + 1);
    }

    /// `count` numbers, and where they are.
    pub fn numbers(&mut self, count: usize, kind: Scalar) -> Result<(Vec<f64>, Range<usize>), FormatError> {
        let short = |found: String| FormatError::truncated(format!("{count} numbers"), found);
        if self.binary {
            self.end_line();
            let length = count.checked_mul(kind.size()).filter(|&length| length <= self.rest().len());
            let length = length.ok_or_else(|| short(format!("{} bytes", self.rest().len())))?;
            let place = self.at..self.at + length;
            let values = (0..count).map(|i| kind.get(self.bytes, place.start + i * kind.size(), true));
            self.at = place.end;
            return Ok((values.map(|value| value.unwrap_or(f64::NAN)).collect(), place));
        }
        let mut values = Vec::new();
        let mut place = self.at..self.at;
        for index in 0..count {
            let (range, word) = self.word().ok_or_else(|| short(format!("{index}")))?;
            values.push(number(word).map_err(FormatError::Content)?);
            place.start = if index == 0 { range.start } else { place.start };
            place.end = range.end;
        }
        Ok((values, place))
    }

    /// Passes over `count` values.
    pub fn skip(&mut self, count: usize, kind: Kind) -> Result<(), FormatError> {
        match kind {
            Kind::Number(kind) => self.numbers(count, kind).map(|_| ()),
            Kind::Bit if self.binary => self.numbers(count.div_ceil(8), Scalar::U8).map(|_| ()),
            Kind::Bit => self.numbers(count, Scalar::U8).map(|_| ()),
            Kind::Text if self.binary => {
                Err(FormatError::Content("text values in binary; save the file as text or as .vtp".into()))
            }
            Kind::Text => {
                self.end_line();
                (0..count.min(self.bytes.len())).for_each(|_| self.end_line());
                Ok(())
            }
        }
    }
}

/// The optional number of components behind a type, on the same line.
pub(super) fn components(cursor: &mut VtkCursor) -> usize {
    let line = cursor.rest().split(|&b| b == b'\n').next().unwrap_or_default();
    let word = words(line).next().and_then(|(_, word)| std::str::from_utf8(word).ok());
    match word.and_then(|word| word.parse().ok()) {
        Some(count) => {
            cursor.word();
            count
        }
        None => 1,
    }
}

/// A name, in which VTK writes special characters as `%20`.
pub(super) fn name(word: &[u8]) -> String {
    let mut bytes = Vec::with_capacity(word.len().min(200));
    let mut rest = &word[..word.len().min(200)];
    while let [first, after @ ..] = rest {
        let hex = after.get(..2).and_then(|hex| std::str::from_utf8(hex).ok());
        match hex.filter(|_| *first == b'%').and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                rest = &after[2..];
            }
            None => {
                bytes.push(*first);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// `METADATA` goes up to an empty line.
pub(super) fn skip_metadata(cursor: &mut VtkCursor) {
    cursor.end_line();
    while !cursor.rest().is_empty() {
        let begin = cursor.at;
        cursor.end_line();
        if cursor.bytes[begin..cursor.at].trim_ascii().is_empty() {
            break;
        }
    }
}
