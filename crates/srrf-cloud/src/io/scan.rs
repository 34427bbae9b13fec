//! Text in bytes: lines, words and numbers with their places, and copies with parts replaced.

use std::io::{self, Write};
use std::ops::Range;

use super::FormatError;
use crate::Rigid;

/// One line of text without its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line<'a> {
    /// From 1.
    pub number: usize,
    /// Offset of its first byte in the file.
    pub start: usize,
    pub text: &'a [u8],
}

impl<'a> Line<'a> {
    /// The words between white space, each with its offset in the file.
    pub fn words(&self) -> impl Iterator<Item = (usize, &'a [u8])> + use<'a> {
        let start = self.start;
        words(self.text).map(move |(at, word)| (start + at, word))
    }

    /// An error that names this line.
    pub fn error(&self, problem: impl Into<String>) -> FormatError {
        FormatError::line(self.number, problem)
    }
}

/// The lines of a file; they end with `\n`, `\r\n` or a lone `\r`.
#[derive(Debug, Clone)]
pub(super) struct ByteLines<'a> {
    bytes: &'a [u8],
    at: usize,
    number: usize,
    /// Only `\r` ends a line; so that a binary body which begins with `\n` stays whole.
    cr_only: bool,
}

impl<'a> ByteLines<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, number: 0, cr_only: false }
    }

    /// For text before a binary body: what ends the first line ends them all.
    pub fn of_header(bytes: &'a [u8]) -> Self {
        let first = bytes.iter().position(|b| matches!(b, b'\r' | b'\n'));
        let cr_only = first.is_some_and(|at| bytes[at] == b'\r' && bytes.get(at + 1) != Some(&b'\n'));
        Self { cr_only, ..Self::new(bytes) }
    }

    /// Offset of what follows the lines taken so far.
    pub fn offset(&self) -> usize {
        self.at
    }
}

impl<'a> Iterator for ByteLines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let start = self.at;
        let end = rest.iter().position(|&b| b == b'\r' || (b == b'\n' && !self.cr_only));
        let length = end.unwrap_or(rest.len());
        let crlf = !self.cr_only && rest[length..].starts_with(b"\r\n");
        self.at += length + usize::from(end.is_some()) + usize::from(crlf);
        self.number += 1;
        Some(Line { number: self.number, start, text: &rest[..length] })
    }
}

/// The words of `text` between white space, each with its offset in `text`.
pub(super) fn words(text: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let begin = at + text[at..].iter().position(|b| !b.is_ascii_whitespace())?;
        let length = text[begin..].iter().position(u8::is_ascii_whitespace).unwrap_or(text.len() - begin);
        at = begin + length;
        Some((begin, &text[begin..at]))
    })
}

/// Reads a number; also the ways in which Windows and C write NaN.
///
/// # Errors
/// A sentence without place.
pub(super) fn number(word: &[u8]) -> Result<f64, String> {
    let text = std::str::from_utf8(word).unwrap_or_default();
    if let Ok(value) = text.parse() {
        return Ok(value);
    }
    let lower = text.to_ascii_lowercase();
    let bare = lower.trim_start_matches(['+', '-']);
    if bare.starts_with("nan(") || bare.starts_with("1.#qnan") || bare.starts_with("1.#ind") {
        return Ok(f64::NAN);
    }
    if bare.starts_with("1.#inf") {
        return Ok(if lower.starts_with('-') { f64::NEG_INFINITY } else { f64::INFINITY });
    }
    let hint = match text.matches(',').count() {
        1 if text.replace(',', ".").parse::<f64>().is_ok() => "; write decimals with a point, not a comma",
        _ if text.contains(char::is_whitespace) => "; it has no-break spaces in it, write plain ones",
        _ if text.contains('\u{2212}') => "; its sign is the one of print, U+2212, write a hyphen",
        _ => "",
    };
    Err(format!("{} is not a number{hint}", quote(word)))
}

/// `word` for a message: in quotes, cut to 40 characters, without control characters.
pub(super) fn quote(word: &[u8]) -> String {
    let text = String::from_utf8_lossy(&word[..word.len().min(160)]);
    let short: String = text.chars().take(40).collect();
    if word.len() > 160 || short.len() < text.len() { format!("{short:?}...") } else { format!("{short:?}") }
}

/// Writes `value` in the fewest digits that read back as the same bits (NaN as `nan`).
pub(super) fn put_number(out: &mut Vec<u8>, value: f64) {
    let size = value.abs();
    // A vector takes all that is written.
    let _ = if value.is_nan() {
        out.write_all(b"nan")
    } else if size == 0.0 || (1e-5..1e16).contains(&size) || size.is_infinite() {
        write!(out, "{value}")
    } else {
        write!(out, "{value:e}")
    };
}

/// As [`put_number`], in the fewest digits that read back as the same bits in single precision.
pub(super) fn put_single(out: &mut Vec<u8>, value: f32) {
    let size = value.abs();
    // A vector takes all that is written.
    let _ = if value.is_nan() {
        out.write_all(b"nan")
    } else if size == 0.0 || (1e-5..1e9).contains(&size) || size.is_infinite() {
        write!(out, "{value}")
    } else {
        write!(out, "{value:e}")
    };
}

/// Writes three numbers with blanks between them.
pub(super) fn put_point(out: &mut Vec<u8>, point: &[f64; 3]) {
    for (axis, &value) in point.iter().enumerate() {
        if axis > 0 {
            out.push(b' ');
        }
        put_number(out, value);
    }
}

/// `R p + t`; a point with a NaN or infinite coordinate stays as it is.
pub(super) fn moved(motion: &Rigid, point: [f64; 3]) -> [f64; 3] {
    if point.iter().all(|c| c.is_finite()) { motion.apply(&point) } else { point }
}

/// `R n`, for normals; one that is not finite stays as it is.
pub(super) fn turned(motion: &Rigid, normal: [f64; 3]) -> [f64; 3] {
    moved(&Rigid { translation: nalgebra::Vector3::zeros(), ..*motion }, normal)
}

/// A copy of bytes with parts replaced, from the front to the back.
pub(super) struct Splice<'a, 'w> {
    bytes: &'a [u8],
    at: usize,
    out: &'w mut dyn Write,
    /// Numbers are written with a decimal comma.
    pub decimal_comma: bool,
    /// Numbers with a comma are put in quotes, where they are not.
    pub quote_commas: bool,
}

impl<'a, 'w> Splice<'a, 'w> {
    pub fn new(bytes: &'a [u8], out: &'w mut dyn Write) -> Self {
        Self { bytes, at: 0, out, decimal_comma: false, quote_commas: false }
    }

    /// Copies up to `range` and writes `with` in its place. Ranges must come in order.
    pub fn replace(&mut self, range: Range<usize>, with: &[u8]) -> io::Result<()> {
        let between = self.bytes.get(self.at..range.start);
        self.out.write_all(between.ok_or_else(|| io::Error::other("replacements out of order"))?)?;
        self.at = range.end;
        self.out.write_all(with)
    }

    /// Replaces a word of text where its number has changed.
    pub fn number(&mut self, place: Range<usize>, old: f64, new: f64) -> io::Result<()> {
        if old == new || (old.is_nan() && new.is_nan()) {
            return Ok(());
        }
        let mut word = Vec::with_capacity(32);
        put_number(&mut word, new);
        if self.decimal_comma {
            word.iter_mut().filter(|byte| **byte == b'.').for_each(|byte| *byte = b',');
        }
        let quoted = place.start > 0 && self.bytes.get(place.start - 1) == Some(&b'"');
        if self.quote_commas && !quoted && word.contains(&b',') {
            word.insert(0, b'"');
            word.push(b'"');
        }
        self.replace(place, &word)
    }

    /// Replaces three words of text where their numbers have changed.
    pub fn numbers(&mut self, places: &[Range<usize>; 3], old: [f64; 3], new: [f64; 3]) -> io::Result<()> {
        let mut axes = [0, 1, 2];
        axes.sort_by_key(|&axis| places[axis].start);
        axes.into_iter().try_for_each(|axis| self.number(places[axis].clone(), old[axis], new[axis]))
    }

    /// Copies what is left.
    pub fn finish(self) -> io::Result<()> {
        self.out.write_all(self.bytes.get(self.at..).unwrap_or_default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(bytes: &[u8]) -> Vec<(usize, usize, &[u8])> {
        ByteLines::new(bytes).map(|line| (line.number, line.start, line.text)).collect()
    }

    #[test]
    fn three_ends_of_lines() {
        let expected: Vec<(usize, usize, &[u8])> = vec![(1, 0, b"a"), (2, 2, b""), (3, 3, b"bc")];
        assert_eq!(lines(b"a\n\nbc"), expected);
        assert_eq!(lines(b"a\r\rbc\r"), expected);
        assert_eq!(lines(b"a\r\n\r\nbc\r\n")[2], (3, 5, &b"bc"[..]));
        let mut header = ByteLines::of_header(b"ply\rend\r\nbody");
        assert_eq!(header.by_ref().take(2).last().map(|line| line.text), Some(&b"end"[..]));
        assert_eq!(header.offset(), 8, "the line feed belongs to the body");
    }

    #[test]
    fn numbers_of_all_kinds() {
        for (word, value) in [("1.5", 1.5), ("-.5e3", -500.0), ("+2.", 2.0), ("-1.#INF", f64::NEG_INFINITY)] {
            assert_eq!(number(word.as_bytes()), Ok(value));
        }
        for word in ["nan", "-NaN", "nan(snan)", "-1.#IND", "1.#QNAN0"] {
            assert!(number(word.as_bytes()).unwrap().is_nan(), "{word}");
        }
        assert_eq!(
            number(b"1,5").unwrap_err(),
            "\"1,5\" is not a number; write decimals with a point, not a comma"
        );
        assert!(
            number("1\u{a0}2".as_bytes()).unwrap_err().ends_with("no-break spaces in it, write plain ones")
        );
        assert!(number("\u{2212}1.5".as_bytes()).unwrap_err().ends_with("U+2212, write a hyphen"));
        assert!(number(&[0xff; 999]).unwrap_err().len() < 200);
    }

    #[test]
    fn written_numbers_read_back() {
        for value in [0.0, -0.0, 5e-324, -f64::MAX, 1e16, 0.1, 4_812_345.678_901, f64::INFINITY] {
            let mut text = Vec::new();
            put_number(&mut text, value);
            assert!(text.len() < 26);
            assert_eq!(number(&text).unwrap().to_bits(), value.to_bits());
        }
    }

    #[test]
    fn single_precision_has_few_digits() {
        for (value, text) in
            [(0.1f32, "0.1"), (-3e-7, "-3e-7"), (16_777_216.0, "16777216"), (f32::NAN, "nan")]
        {
            let mut out = Vec::new();
            put_single(&mut out, value);
            assert_eq!(out, text.as_bytes());
        }
    }

    #[test]
    fn a_splice_changes_only_its_parts() {
        let mut out = Vec::new();
        let mut splice = Splice::new(b"v 1 2.50 3 # end", &mut out);
        splice.numbers(&[2..3, 4..8, 9..10], [1.0, 2.5, 3.0], [7.25, 2.5, -3.0]).unwrap();
        splice.finish().unwrap();
        assert_eq!(out, b"v 7.25 2.50 -3 # end");
    }
}
