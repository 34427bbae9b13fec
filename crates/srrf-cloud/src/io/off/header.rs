//! The header of an OFF file: what a vertex is, and the counts.

use super::super::FormatError;
use super::super::scan::{Line, quote, words};
use super::lines::Lines;

/// What the first lines say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OffHeader {
    pub vertices: usize,
    pub faces: usize,
    /// The vertices have a fourth coordinate, by which the others are divided (`4OFF`).
    pub homogeneous: bool,
    /// A normal follows the place (`NOFF`).
    pub normals: bool,
    /// A colour follows (`COFF`).
    pub colours: bool,
    /// Two coordinates of a texture follow (`STOFF`).
    pub texture: bool,
}

/// What the word before `OFF` says, and what stands behind it.
struct Magic<'a> {
    header: OffHeader,
    /// Whether a line with the number of dimensions follows (`nOFF`); `None` where the letter can mean a normal too.
    dimensions: Option<bool>,
    rest: &'a [u8],
}

/// Whether a line begins as an OFF file does: with the word, and nothing or a count behind it.
pub(super) fn is_magic(text: &[u8]) -> bool {
    magic(text).is_some_and(|magic| {
        let ends = magic.rest.first().is_none_or(|byte| byte.is_ascii_whitespace() || byte.is_ascii_digit());
        let rest = magic.rest.trim_ascii_start();
        let binary = rest.get(..6).is_some_and(|word| word.eq_ignore_ascii_case(b"BINARY"));
        ends && (binary || rest.first().is_none_or(u8::is_ascii_digit))
    })
}

/// The letters may be `ST`, `C`, `N`, `4`, `n` in any order, all in capitals or all small but for `n`.
fn magic(text: &[u8]) -> Option<Magic<'_>> {
    let longest = &text[..text.len().min(b"STCN4nOFF".len())];
    let end = longest.windows(3).position(|three| three.eq_ignore_ascii_case(b"off"))?;
    let (mut prefix, rest) = (&text[..end], &text[end + 3..]);
    let small = text[end..].starts_with(b"off");
    let mut header = OffHeader {
        vertices: 0,
        faces: 0,
        homogeneous: false,
        normals: false,
        colours: false,
        texture: false,
    };
    let mut dimensions = Some(false);
    while let Some((&letter, more)) = prefix.split_first() {
        let place = match letter {
            b'S' | b's' if matches!(more.first(), Some(b'T' | b't')) => {
                prefix = &more[1..];
                if std::mem::replace(&mut header.texture, true) {
                    return None;
                }
                continue;
            }
            b'C' | b'c' => &mut header.colours,
            b'N' => &mut header.normals,
            b'4' => &mut header.homogeneous,
            b'n' if dimensions == Some(false) => {
                dimensions = if small { None } else { Some(true) };
                prefix = more;
                continue;
            }
            _ => return None,
        };
        if std::mem::replace(place, true) {
            return None;
        }
        prefix = more;
    }
    Some(Magic { header, dimensions, rest })
}

impl OffHeader {
    /// Reads the header and leaves `lines` at the first vertex. The counts may follow `OFF` on its own line with or
    /// without a space, as in some ModelNet files; the word may be missing; and all that follows may too stand in the
    /// line of the counts.
    pub fn parse(lines: &mut Lines<'_>) -> Result<Self, FormatError> {
        let first = lines.next().ok_or_else(|| FormatError::truncated("a header", "nothing"))?;
        let no_magic = || FormatError::Content("the file does not begin with OFF".into());
        let Some(Magic { mut header, dimensions, rest }) = magic(first.text) else {
            // Geomview takes the word as said where the file begins with the three counts.
            let counts = numbers(first.text, 4);
            if counts.len() != 3 {
                return Err(no_magic());
            }
            let plain = magic(b"OFF").map(|magic| magic.header).ok_or_else(no_magic)?;
            return Ok(Self { vertices: counts[0], faces: counts[1], ..plain });
        };
        let skipped = rest.len() - rest.trim_ascii_start().len();
        let start = first.start + (first.text.len() - rest.len()) + skipped;
        let rest = rest.trim_ascii();
        if rest.get(..6).is_some_and(|word| word.eq_ignore_ascii_case(b"BINARY")) {
            return Err(FormatError::Content("binary OFF is not supported; save it as text".into()));
        }
        if rest.first().is_some_and(|byte| !byte.is_ascii_digit()) {
            return Err(first.error(format!("{} follows OFF, where the counts are expected", quote(rest))));
        }
        lines.put_back(Line { start, text: rest, ..first });
        let one_alone = lines.peek().is_some_and(|line| words(line.text).nth(1).is_none());
        if dimensions == Some(true) || (dimensions.is_none() && one_alone) {
            let (line, dimensions) = lines.count("the number of dimensions")?;
            if dimensions != 3 {
                return Err(line.error(format!(
                    "nOFF with points of {dimensions} dimensions; a cloud has points of three"
                )));
            }
        } else if dimensions.is_none() {
            header.normals = true;
        }
        let (one, vertices) = lines.count("the number of vertices")?;
        let (two, faces) = lines.count("the number of faces")?;
        // The number of edges may be missing at the end of a line.
        if lines.same_line() || one.number != two.number {
            lines.count("the number of edges")?;
        }
        Ok(Self { vertices, faces, ..header })
    }

    /// More numbers than any vertex has.
    pub const WIDEST: usize = 16;

    /// Numbers before the normal of a vertex.
    pub fn place(self) -> usize {
        3 + usize::from(self.homogeneous)
    }

    /// Numbers of a vertex with colours of so many parts.
    pub fn width(self, colour: usize) -> usize {
        let part = |there: bool, numbers: usize| if there { numbers } else { 0 };
        self.place() + part(self.normals, 3) + part(self.colours, colour) + part(self.texture, 2)
    }
}

/// The whole numbers with which a line begins, up to `most` of them; none where it has anything else.
fn numbers(text: &[u8], most: usize) -> Vec<usize> {
    let number = |(_, word): (usize, &[u8])| std::str::from_utf8(word).ok()?.parse().ok();
    words(text).take(most).map(number).collect::<Option<_>>().unwrap_or_default()
}
