//! One line of a text file: the three of its fields that are x, y and z.

use std::ops::Range;

use super::super::scan::{number, quote, words};
pub(super) use super::fields::Style;
use super::fields::{is_missing, without_quoted};

/// What is the same in all rows of a file.
#[derive(Debug, Clone, Default)]
pub(super) struct Table {
    /// The fields that are x, y and z, counted from 0.
    pub columns: [usize; 3],
    /// Number of fields, where it is known: a last one may be empty.
    pub width: usize,
    /// Number of fields between tabs, where each tab separates.
    pub tabs: Option<usize>,
}

impl Table {
    /// Points in the first three fields.
    pub fn of_points() -> Self {
        Self { columns: [0, 1, 2], ..Self::default() }
    }

    /// What separates the fields of a row.
    #[inline]
    pub fn style(&self, text: &[u8]) -> Style {
        match self.tabs {
            Some(fields) if tabs(text) + 1 == fields => Style::Tab,
            _ => Style::of(text),
        }
    }

    /// Finds out whether each tab separates: where a `title` has as many as the row that comes first in `rows`, or
    /// where all rows have as many, and one of them has all its fields.
    pub fn look_at_tabs<'a>(&mut self, title: Option<&[u8]>, mut rows: impl Iterator<Item = &'a [u8]>) {
        let Some(count) = rows.next().map(tabs).filter(|&count| count >= 2) else { return };
        let of_title = title.is_some_and(|title| tabs(title) == count);
        let mut full = false;
        let even = || {
            rows.filter(|row| !row.trim_ascii().is_empty()).take(LOOKED_AT).all(|row| {
                let fields = words(row).count();
                full |= fields == count + 1;
                tabs(row) == count && fields <= count + 1
            })
        };
        self.tabs = (of_title || even() && full).then_some(count + 1);
    }
}

/// Rows that are looked at to find out how they are separated.
const LOOKED_AT: usize = 1000;

fn tabs(text: &[u8]) -> usize {
    without_quoted(text).iter().filter(|&&b| b == b'\t').count()
}

/// What a comma in a quoted number of a file is whose fields commas separate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum QuotedComma {
    /// `1,5`
    Decimal,
    /// `1,234`: that, or one between thousands.
    Either,
}

/// The point of a line.
pub(super) struct TextRow {
    pub style: Style,
    /// Where its numbers are in the line.
    pub places: [Range<usize>; 3],
    /// NaN where there is nothing.
    pub point: [f64; 3],
    /// Number of fields that the title or the first row has.
    pub width: usize,
    /// Whether a number is missing.
    pub missing: bool,
    /// Commas in quoted numbers, where commas separate.
    pub comma: Option<QuotedComma>,
}

impl TextRow {
    /// Reads x, y and z of a row.
    ///
    /// # Errors
    /// A sentence without place.
    pub fn parse(text: &[u8], table: &Table) -> Result<Self, String> {
        let style = table.style(text);
        let columns = table.columns;
        let mut row = Self {
            style,
            places: [0..0, 0..0, 0..0],
            point: [0.0; 3],
            width: table.width,
            missing: false,
            comma: None,
        };
        let mut found = 0;
        let last = columns.into_iter().max().unwrap_or(0);
        for (index, (at, word)) in style.fields(text).enumerate().take(last + 1) {
            let Some(axis) = columns.iter().position(|&column| column == index) else { continue };
            row.places[axis] = at..at + word.len();
            if word.is_empty() {
                // A separator at the end of a line closes it, where the file does not say that a field follows.
                if index >= table.width && style.fields(text).skip(index).all(|(_, word)| word.is_empty()) {
                    break;
                }
                (row.point[axis], row.missing) = (f64::NAN, true);
            } else {
                row.point[axis] = row.number(text, at, word)?;
            }
            found += 1;
        }
        if found < 3 {
            return Err(format!("{found} numbers where x, y and z are expected"));
        }
        if row.comma == Some(QuotedComma::Either)
            && row.places.iter().any(|place| text[place.clone()].contains(&b'.'))
        {
            return Err(of_thousands(text, &row.places));
        }
        if style == Style::Comma && style.fields(text).take(6).any(|(_, word)| has_leading_zero(word)) {
            let problem = "fields with leading zeros look like decimals after a comma, and commas separate \
                           fields here: write decimals with a point, or separate the fields by semicolons";
            return Err(problem.to_owned());
        }
        Ok(row)
    }

    #[inline]
    fn number(&mut self, text: &[u8], at: usize, word: &[u8]) -> Result<f64, String> {
        let quoted = at > 0 && text[at - 1] == b'"';
        let commas = matches!(self.style, Style::SpaceDecimalComma | Style::Semicolon | Style::Tab) || quoted;
        if !commas || !word.contains(&b',') {
            return number(word).or_else(|problem| self.no_number(word, problem));
        }
        let point: Vec<u8> = word.iter().map(|&b| if b == b',' { b'.' } else { b }).collect();
        let value = number(&point).map_err(|_| {
            format!("{} is not a number: a comma where {}", quote(word), "a decimal comma makes no sense")
        })?;
        if self.style == Style::Comma {
            let decimal = self.comma == Some(QuotedComma::Decimal) || !like_thousands(word);
            self.comma = Some(if decimal { QuotedComma::Decimal } else { QuotedComma::Either });
        }
        Ok(value)
    }

    /// NaN for the words that stand for nothing.
    fn no_number(&mut self, word: &[u8], problem: String) -> Result<f64, String> {
        if !is_missing(word) {
            return Err(problem);
        }
        self.missing = true;
        Ok(f64::NAN)
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

/// Such as `1,234`: one to three digits, a comma and three digits.
fn like_thousands(word: &[u8]) -> bool {
    let digits = word.strip_prefix(b"-").or(word.strip_prefix(b"+")).unwrap_or(word);
    let Some(at) = digits.iter().position(|&b| b == b',') else { return false };
    let (before, after) = (&digits[..at], &digits[at + 1..]);
    (1..=3).contains(&before.len())
        && before[0] != b'0'
        && after.len() == 3
        && before.iter().chain(after).all(u8::is_ascii_digit)
}

/// What to say where commas may be those of thousands.
pub(super) fn of_thousands(text: &[u8], places: &[Range<usize>; 3]) -> String {
    let word = places.iter().map(|place| &text[place.clone()]).find(|word| word.contains(&b','));
    format!(
        "the comma in {} may separate thousands or decimals; write numbers without thousands separators",
        quote(word.unwrap_or_default())
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(text: &str) -> Result<[f64; 3], String> {
        TextRow::parse(text.as_bytes(), &Table::of_points()).map(|row| row.point)
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
            "\"1,5\",\"-2\",\"3e5\"",
            "\"1,5\",-2,3e5,\"a, b\"",
            "\"1,5\" \"-2,0\" \"3e5\" \"a b\"",
        ] {
            assert_eq!(point(text), expected, "{text}");
        }
        let row =
            TextRow::parse(b"7 ; 1,5;\"-2\"; 3", &Table { columns: [1, 2, 3], ..Table::default() }).unwrap();
        assert_eq!((row.point, row.places), ([1.5, -2.0, 3.0], [4..7, 9..11, 14..15]));
    }

    #[test]
    fn what_cannot_be_told_is_refused() {
        for (text, fact) in [
            ("1,234.5 2,345.6 3,456.7", "\"1,234.5\" is not a number"),
            ("1,2", "2 numbers"),
            ("1,2,", "2 numbers"),
            ("1;2,5", "2 numbers"),
            ("1,500,2,050,3,125", "leading zeros"),
            ("\"1,234\",2.5,3.5", "thousands or decimals"),
            ("1.234,5;2;3", "decimal comma makes no sense"),
            ("1,2,#", "not a number"),
            ("1 2 3x", "\"3x\" is not a number"),
        ] {
            let problem = point(text).unwrap_err();
            assert!(problem.contains(fact), "{text}: {problem}");
        }
    }

    #[test]
    fn nothing_is_not_a_number() {
        for (text, nan) in [
            ("1,,3,4", 1),
            (",2,3", 0),
            ("1;;3", 1),
            ("1,2,NA", 2),
            ("#N/A,2,3", 0),
            ("1;\"\";3", 1),
            ("1 \"\" 3", 1),
            ("1 <NA> 3", 1),
            ("1,#DIV/0!,3", 1),
        ] {
            let row = TextRow::parse(text.as_bytes(), &Table::of_points()).unwrap();
            assert!(row.missing && row.point[nan].is_nan(), "{text}");
            assert_eq!(row.point.iter().filter(|c| c.is_nan()).count(), 1, "{text}");
        }
        let table = Table { width: 3, ..Table::of_points() };
        assert!(
            TextRow::parse(b"1,2,", &table).unwrap().point[2].is_nan(),
            "the title says that there is a third"
        );
        assert!(!TextRow::parse(b"1,nan,2", &table).unwrap().missing, "a number as any other");
    }
}
