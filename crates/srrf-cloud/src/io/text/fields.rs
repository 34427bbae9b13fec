//! The fields of a line, and lines that belong together since a quoted field has line breaks inside.

use std::borrow::Cow;

use super::super::scan::{ByteLines, Line, words};

/// What separates the fields of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Style {
    /// White space.
    Space,
    /// White space, and the decimals have commas: `1,5 2,5 3,5`.
    SpaceDecimalComma,
    /// Single tabs; the decimals may have commas, and a field may be empty.
    Tab,
    /// Commas: `1.5, 2.5, 3.5`.
    Comma,
    /// Semicolons; the decimals may have commas.
    Semicolon,
}

impl Style {
    /// What separates the fields of a line that stands alone: tabs are white space.
    pub fn of(text: &[u8]) -> Self {
        let text = &*without_quoted(text);
        let has = |byte| text.contains(&byte);
        if has(b';') {
            return Self::Semicolon;
        }
        if !has(b',') {
            return Self::Space;
        }
        // A comma inside each of several words is a decimal one; two in one word separate.
        let inner = |word: &[u8]| match word {
            [_, middle @ .., _] => middle.iter().filter(|&&b| b == b',').count(),
            _ => 0,
        };
        let commas: Vec<usize> = words(text).take(3).map(|(_, word)| inner(word)).collect();
        if commas.len() == 3 && commas.contains(&1) { Self::SpaceDecimalComma } else { Self::Comma }
    }

    /// The byte between two fields; `None` for white space.
    fn separator(self) -> Option<u8> {
        match self {
            Self::Space | Self::SpaceDecimalComma => None,
            Self::Tab => Some(b'\t'),
            Self::Comma => Some(b','),
            Self::Semicolon => Some(b';'),
        }
    }

    /// The fields of `text` with their offsets, without the quotes around them. Where something separates that is no
    /// white space, a field is the first word between two of them, and may be empty.
    pub fn fields(self, text: &[u8]) -> Fields<'_> {
        Fields { text, at: Some(0), separator: self.separator() }
    }
}

/// See [`Style::fields`].
pub(super) struct Fields<'a> {
    text: &'a [u8],
    at: Option<usize>,
    separator: Option<u8>,
}

impl<'a> Iterator for Fields<'a> {
    type Item = (usize, &'a [u8]);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        let begin = self.at?;
        let Some(separator) = self.separator else {
            let start = begin + self.text[begin..].iter().position(|b| !b.is_ascii_whitespace())?;
            if let Some(end) = closing(self.text, start) {
                self.at = Some(end + 1);
                return Some((start + 1, &self.text[start + 1..end]));
            }
            let rest = &self.text[start..];
            let end = start + rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
            self.at = Some(end);
            return Some((start, &self.text[start..end]));
        };
        let blank = |b: u8| b.is_ascii_whitespace() && b != separator;
        let start = begin + self.text[begin..].iter().take_while(|b| blank(**b)).count();
        let quoted = closing(self.text, start);
        let from = quoted.map_or(begin, |end| end + 1);
        let length = self.text[from..].iter().position(|&b| b == separator);
        self.at = length.map(|length| from + length + 1);
        if let Some(end) = quoted {
            return Some((start + 1, &self.text[start + 1..end]));
        }
        let chunk = &self.text[begin..length.map_or(self.text.len(), |length| from + length)];
        Some(words(chunk).next().map_or((begin, &chunk[..0]), |(skip, word)| (begin + skip, word)))
    }
}

/// The place of the quote that ends the field which begins with one at `start`.
#[inline]
fn closing(text: &[u8], start: usize) -> Option<usize> {
    if text.get(start) != Some(&b'"') {
        return None;
    }
    let mut at = start + 1;
    loop {
        at += text.get(at..)?.iter().position(|&b| b == b'"')?;
        // Two of them stand for one.
        if text.get(at + 1) != Some(&b'"') {
            return Some(at);
        }
        at += 2;
    }
}

/// The text with letters in place of what is in quotes, so that no separator is inside.
pub(super) fn without_quoted(text: &[u8]) -> Cow<'_, [u8]> {
    if !text.contains(&b'"') {
        return Cow::Borrowed(text);
    }
    let mut copy = text.to_vec();
    let (mut at, mut fresh) = (0, true);
    while at < text.len() {
        if let Some(end) = closing(text, at).filter(|_| fresh) {
            copy[at..=end].fill(b'q');
            (at, fresh) = (end + 1, false);
            continue;
        }
        fresh = matches!(text[at], b',' | b';' | b'\t' | b' ');
        at += 1;
    }
    Cow::Owned(copy)
}

/// Most bytes of lines that one quoted field joins.
const LONGEST_RECORD: usize = 1 << 14;

/// The lines of a text; those are one that a quoted field with line breaks inside joins. A quote that nothing closes
/// soon is a letter as any other.
#[derive(Clone)]
pub(super) struct Records<'a> {
    bytes: &'a [u8],
    lines: ByteLines<'a>,
}

impl<'a> Records<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, lines: ByteLines::new(bytes) }
    }
}

impl<'a> Iterator for Records<'a> {
    type Item = Line<'a>;

    #[inline]
    fn next(&mut self) -> Option<Line<'a>> {
        let line = self.lines.next()?;
        if !line.text.contains(&b'"') || !ends_quoted(line.text, false) {
            return Some(line);
        }
        let mut ahead = self.lines.clone();
        while let Some(next) = ahead.next() {
            let end = next.start + next.text.len();
            if end - line.start > LONGEST_RECORD {
                break;
            }
            if next.text.contains(&b'"') && !ends_quoted(next.text, true) {
                self.lines = ahead;
                return Some(Line { text: &self.bytes[line.start..end], ..line });
            }
        }
        Some(line)
    }
}

/// Whether a line ends inside a quoted field, if it begins so or not.
fn ends_quoted(text: &[u8], mut inside: bool) -> bool {
    let mut fresh = true;
    let mut bytes = text.iter().peekable();
    while let Some(&byte) = bytes.next() {
        if inside {
            if byte == b'"' && bytes.next_if(|next| **next == b'"').is_none() {
                (inside, fresh) = (false, false);
            }
        } else if fresh && byte == b'"' {
            inside = true;
        } else {
            fresh = matches!(byte, b',' | b';' | b'\t' | b' ');
        }
    }
    inside
}

/// Words that stand for a number that is not there, as pandas, R and spreadsheets write them.
pub(super) fn is_missing(word: &[u8]) -> bool {
    const WORDS: [&[u8]; 13] = [
        b"", b"na", b"n/a", b"<na>", b"null", b"none", b"nat", b"#n/a", b"#num!", b"#value!", b"#div/0!",
        b"#ref!", b"#name?",
    ];
    word.len() <= 7 && WORDS.iter().any(|known| word.eq_ignore_ascii_case(known))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_hold_separators() {
        let fields = |text: &'static str| -> Vec<&'static str> {
            let bytes = text.as_bytes();
            Style::of(bytes).fields(bytes).map(|(_, field)| std::str::from_utf8(field).unwrap()).collect()
        };
        assert_eq!(fields("\"a;b, c\",1,2,3"), ["a;b, c", "1", "2", "3"]);
        assert_eq!(
            fields("1; \"a;b\" ;2;\"\";\"say \"\"x;y\"\"\""),
            ["1", "a;b", "2", "", "say \"\"x;y\"\""]
        );
        assert_eq!(fields("\"two words\" 1 2 \"\" 3"), ["two words", "1", "2", "", "3"]);
        assert_eq!(fields("5\" 1 2"), ["5\"", "1", "2"]);
        assert_eq!(fields("\"open,1,2"), ["\"open", "1", "2"]);
        assert_eq!(fields("1,,3,"), ["1", "", "3", ""]);
        let tabs: Vec<_> =
            Style::Tab.fields(b"1\t\t 3 \ta b").map(|(at, field)| (at, field.to_vec())).collect();
        assert_eq!(tabs, [(0, b"1".to_vec()), (2, b"".to_vec()), (4, b"3".to_vec()), (7, b"a".to_vec())]);
    }

    #[test]
    fn line_breaks_in_quotes() {
        let records = |text: &'static str| -> Vec<(usize, &'static [u8])> {
            Records::new(text.as_bytes()).map(|line| (line.number, line.text)).collect()
        };
        let expected: [(usize, &[u8]); 3] = [(1, b"x"), (2, b"1,\"a\r\nb\"\"\n\",2"), (5, b"3")];
        assert_eq!(records("x\r\n1,\"a\r\nb\"\"\n\",2\r\n3"), expected);
        // Nothing closes it.
        assert_eq!(records("1,\"a\n2,b\n3,c").len(), 3);
        assert_eq!(records("1,5\"\n2,5\"\n").len(), 2);
    }
}
