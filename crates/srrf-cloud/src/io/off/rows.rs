//! The vertices and faces of an OFF file: a line each, or word by word where lines say nothing.

use super::super::FormatError;
use super::super::scan::Line;
use super::header::OffHeader;
use super::lines::{Lines, count};

/// How the rows are apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Rows {
    /// A line each, whatever follows in it.
    Lines,
    /// Word by word: so many numbers a vertex, and no more words than the corners of a face.
    Words { vertex: usize },
}

impl Rows {
    /// The ways in which a file may be written, the most likely one first.
    pub fn candidates(header: OffHeader) -> Vec<Self> {
        let words = |colour| Self::Words { vertex: header.width(colour) };
        if header.colours { vec![Self::Lines, words(4), words(3)] } else { vec![Self::Lines, words(0)] }
    }

    /// The words of the next vertex, as far as any vertex has them, and the line that it begins in; `None` at the end
    /// of the file.
    pub fn vertex<'a>(self, lines: &mut Lines<'a>, row: &mut Vec<(usize, &'a [u8])>) -> Option<Line<'a>> {
        row.clear();
        match self {
            Self::Lines => {
                let line = lines.next()?;
                row.extend(line.words().take(OffHeader::WIDEST));
                Some(line)
            }
            Self::Words { vertex } => {
                let mut first = None;
                for _ in 0..vertex {
                    let (line, word) = lines.word()?;
                    first.get_or_insert(line);
                    row.push(word);
                }
                first
            }
        }
    }

    /// Goes through the corners of the next face; false at the end of the file.
    pub fn face(
        self,
        lines: &mut Lines<'_>,
        mut each: impl FnMut(&Line<'_>, &[u8]) -> Result<(), FormatError>,
    ) -> Result<bool, FormatError> {
        let what = "the number of corners of a face";
        let few = |line: &Line<'_>| line.error("the face has fewer corners than it says");
        match self {
            Self::Lines => {
                let Some(line) = lines.next() else { return Ok(false) };
                let mut words = line.words();
                let (_, word) = words.next().ok_or_else(|| few(&line))?;
                for _ in 0..count(&line, word, what)? {
                    each(&line, words.next().ok_or_else(|| few(&line))?.1)?;
                }
            }
            Self::Words { .. } => {
                if lines.peek().is_none() {
                    return Ok(false);
                }
                let (line, corners) = lines.count(what)?;
                for _ in 0..corners {
                    let (line, (_, word)) = lines.word().ok_or_else(|| few(&line))?;
                    each(&line, word)?;
                }
            }
        }
        Ok(true)
    }
}
