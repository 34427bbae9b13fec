//! One line of a text file: fields, and the three of them that are x, y and z.

use std::ops::Range;

use super::super::scan::{number, quote, words};

/// What separates the fields of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Style {
    /// White space.
    Space,
    /// White space, and the decimals have commas: `1,5 2,5 3,5`.
    SpaceDecimalComma,
    /// Commas: `1.5, 2.5, 3.5`.
    Comma,
    /// Semicolons; the decimals may have commas.
    Semicolon,
}

impl Style {
    pub fn of(text: &[u8]) -> Self {
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

    /// The fields of `text` with their offsets. Where commas or semicolons separate, a field is the
    /// first word between two of them, and may be empty.
    pub fn fields(self, text: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
        let separator = match self {
            Self::Space | Self::SpaceDecimalComma => None,
            Self::Comma => Some(b','),
            Self::Semicolon => Some(b';'),
        };
        let mut at = Some(0);
        let separated = separator.map(|separator| {
            std::iter::from_fn(move || {
                let begin = at?;
                let chunk = &text[begin..];
                let length = chunk.iter().position(|&b| b == separator);
                at = length.map(|length| begin + length + 1);
                let chunk = &chunk[..length.unwrap_or(chunk.len())];
                Some(words(chunk).next().map_or((begin, &chunk[..0]), |(skip, word)| (begin + skip, word)))
            })
        });
        let spaced = if separator.is_none() { Some(words(text)) } else { None };
        separated.into_iter().flatten().chain(spaced.into_iter().flatten()).map(unquoted)
    }

    fn number(self, word: &[u8]) -> Result<f64, String> {
        if self == Self::Space || self == Self::Comma || !word.contains(&b',') {
            return number(word);
        }
        let point: Vec<u8> = word.iter().map(|&b| if b == b',' { b'.' } else { b }).collect();
        number(&point).map_err(|_| {
            format!("{} is not a number: a comma where {}", quote(word), "a decimal comma makes no sense")
        })
    }
}

/// Without a pair of double quotes.
fn unquoted((at, word): (usize, &[u8])) -> (usize, &[u8]) {
    match word {
        [b'"', inner @ .., b'"'] => (at + 1, inner),
        _ => (at, word),
    }
}

/// The point of a line.
pub(super) struct TextRow {
    pub style: Style,
    /// Where its numbers are in the line.
    pub places: [Range<usize>; 3],
    pub point: [f64; 3],
}

impl TextRow {
    /// Reads x, y and z from the fields number `columns`, counted from 0.
    ///
    /// # Errors
    /// A sentence without place.
    pub fn parse(text: &[u8], columns: [usize; 3]) -> Result<Self, String> {
        let style = Style::of(text);
        let mut row = Self { style, places: [0..0, 0..0, 0..0], point: [0.0; 3] };
        let mut found = 0;
        let last = columns.into_iter().max().unwrap_or(0);
        for (index, (at, word)) in style.fields(text).enumerate().take(last + 1) {
            let Some(axis) = columns.iter().position(|&column| column == index) else { continue };
            if word.is_empty() {
                // A comma at the end of the line closes it.
                let more = style.fields(text).skip(index).any(|(_, word)| !word.is_empty());
                if more {
                    return Err(format!("field {} is empty", index + 1));
                }
                break;
            }
            row.point[axis] = style.number(word)?;
            row.places[axis] = at..at + word.len();
            found += 1;
        }
        if found < 3 {
            return Err(format!("{found} numbers where x, y and z are expected"));
        }
        if style == Style::Comma && style.fields(text).take(6).any(|(_, word)| has_leading_zero(word)) {
            let problem = "fields with leading zeros look like decimals after a comma, and commas separate \
                           fields here: write decimals with a point, or separate the fields by semicolons";
            return Err(problem.to_owned());
        }
        Ok(row)
    }

    /// The number of fields, where they are whole numbers separated by commas: if it changes from
    /// line to line, the commas are likely decimal ones.
    pub fn whole_numbers(&self, text: &[u8]) -> Option<usize> {
        (self.style == Style::Comma && !text.contains(&b'.')).then(|| self.style.fields(text).count())
    }
}

/// Such as `05`.
fn has_leading_zero(word: &[u8]) -> bool {
    matches!(word, [b'0', b'0'..=b'9', ..]) && word.iter().all(u8::is_ascii_digit)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(text: &str) -> Result<[f64; 3], String> {
        TextRow::parse(text.as_bytes(), [0, 1, 2]).map(|row| row.point)
    }

    #[test]
    fn separators() {
        let expected = Ok([1.5, -2.0, 3e5]);
        for text in [
            "1.5 -2 3e5",
            "1.5,-2,3e5,255,0,0",
            " 1.5 , -2 , 3e5 ",
            "1.5, -2, 3e5",
            "1.5,-2.0,3e5 255 0 0",
            "1.5;-2;3e5;",
            "1.5,-2,3e5,",
            "\"1.5\",\"-2\",\"3e5\"",
            // decimal commas
            "1,5 -2,0 3e5",
            "1,5\t-2\t3e5 0,5",
            "1,5;-2;3e5",
        ] {
            assert_eq!(point(text), expected, "{text}");
        }
        let row = TextRow::parse(b"7 ; 1,5;\"-2\"; 3", [1, 2, 3]).unwrap();
        assert_eq!((row.point, row.places), ([1.5, -2.0, 3.0], [4..7, 9..11, 14..15]));
    }

    #[test]
    fn what_cannot_be_told_is_refused() {
        for (text, fact) in [
            ("1,234.5 2,345.6 3,456.7", "\"1,234.5\" is not a number"),
            ("1,,3,4", "field 2 is empty"),
            ("1,2", "2 numbers"),
            ("1,2,", "2 numbers"),
            ("1;2,5", "2 numbers"),
            ("1,500,2,050,3,125", "leading zeros"),
            ("1 2 3x", "\"3x\" is not a number"),
        ] {
            let problem = point(text).unwrap_err();
            assert!(problem.contains(fact), "{text}: {problem}");
        }
    }
}
