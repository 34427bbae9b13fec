//! The lines of an OFF file, and its words across them.

use super::super::FormatError;
use super::super::scan::{ByteLines, Line, quote};

/// The lines that hold anything, without their comments.
#[derive(Clone)]
pub(super) struct Lines<'a> {
    lines: ByteLines<'a>,
    /// What is left of a line, and whether a part of it has been taken.
    rest: Option<(Line<'a>, bool)>,
}

/// A line without its comment and the space around it.
pub(super) fn bare(line: Line<'_>) -> Line<'_> {
    let content = line.text.split(|&b| b == b'#').next().unwrap_or_default();
    let skipped = content.len() - content.trim_ascii_start().len();
    Line { start: line.start + skipped, text: content.trim_ascii(), ..line }
}

impl<'a> Lines<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { lines: ByteLines::new(bytes), rest: None }
    }

    /// Gives what is left of a line back.
    pub fn put_back(&mut self, line: Line<'a>) {
        self.rest = (!line.text.is_empty()).then_some((line, true));
    }

    /// The next line, without taking it.
    pub fn peek(&mut self) -> Option<Line<'a>> {
        if self.rest.is_none() {
            self.rest = self.lines.by_ref().map(bare).find(|line| !line.text.is_empty()).map(|l| (l, false));
        }
        self.rest.map(|(line, _)| line)
    }

    /// Whether the next word is in the line of the last one.
    pub fn same_line(&self) -> bool {
        self.rest.is_some_and(|(_, begun)| begun)
    }

    /// The next word with its line.
    pub fn word(&mut self) -> Option<(Line<'a>, (usize, &'a [u8]))> {
        let line = self.peek()?;
        let (at, word) = line.words().next()?;
        let end = at + word.len() - line.start;
        self.put_back(bare(Line { start: line.start + end, text: &line.text[end..], ..line }));
        Some((line, (at, word)))
    }

    /// The next word as a whole number.
    pub fn count(&mut self, what: &str) -> Result<(Line<'a>, usize), FormatError> {
        let (line, (_, word)) = self.word().ok_or_else(|| FormatError::truncated(what, "nothing"))?;
        Ok((line, count(&line, word, what)?))
    }
}

/// A word as a whole number.
pub(super) fn count(line: &Line<'_>, word: &[u8], what: &str) -> Result<usize, FormatError> {
    let count = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
    count.ok_or_else(|| line.error(format!("{what} is expected, found {}", quote(word))))
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        self.peek()?;
        self.rest.take().map(|(line, _)| line)
    }
}
