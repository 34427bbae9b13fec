//! Plain text: one point a line, at least three numbers.

mod attributes;
mod fields;
mod row;
mod title;

use std::io::{self, Write};

use self::attributes::{ColumnCollector, OtherColumns};
pub(super) use self::attributes::{fits_single, smallest};
use self::fields::Records;
use self::row::{QuotedComma, Style, Table, TextRow, of_thousands};
use self::title::{TitleNames, is_comment, is_title};
use super::poses::poses_not_points;
use super::scan::{Line, Splice, moved, number};
use super::width::{check_first_column, is_wide};
use super::{Attribute, CloudFormat, Contents, FormatError, Note, Outgoing, ReadOptions, ReadSwitch};
use crate::Rigid;

/// Numbers separated by spaces, tabs, commas or semicolons, a line for each point. x, y and z are
/// the columns that [`ReadOptions::columns`] or the title name, otherwise the first three. Empty lines and those that
/// begin with `#`, `//` or `%` are passed over, and so is a first line that is a title or (as in PTS files) the
/// number of points. Decimal commas are read where semicolons, tabs or spaces separate the fields;
/// where commas separate, they are refused as far as they can be told from separators. A moved copy
/// keeps all other columns as they are, normals too.
pub(super) struct Text;

impl CloudFormat for Text {
    fn name(&self) -> &'static str {
        "xyz"
    }

    fn extensions(&self) -> &[&'static str] {
        &["xyz", "txt", "csv"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        let mut begin = &bytes[..bytes.len().min(4096)];
        if begin.len() < bytes.len() {
            let whole_lines = begin.iter().rposition(|b| matches!(b, b'\n' | b'\r'));
            begin = &begin[..whole_lines.unwrap_or(begin.len())];
        }
        let mut rows = 0;
        let parsed = parse(begin, &ReadOptions::default(), |_, _| {
            rows += 1;
            Ok::<_, FormatError>(())
        });
        // A title that does not say the columns is a title all the same.
        matches!(parsed, Err(FormatError::Unclear { .. })) || (parsed.is_ok() && rows > 0)
    }

    fn takes(&self) -> &'static [ReadSwitch] {
        &[ReadSwitch::Columns]
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let mut points = Vec::new();
        let mut poses = PoseRows::new(options);
        let parsed = parse(bytes, options, |line, row| {
            options.grow("the points", bytes.len(), &mut points)?;
            points.push(row.point);
            poses.add(line.text);
            Ok::<_, FormatError>(())
        })?;
        poses.check()?;
        if parsed.guessed && parsed.width > 3 {
            check_first_column(&points)?;
        }
        if parsed.guessed && is_wide(points.len() as u64, parsed.width as u64) {
            return Err(FormatError::unclear(
                format!(
                    "{} rows of {} numbers look transposed; save the transpose, a point a line, or if a row is a point",
                    points.len(),
                    parsed.width
                ),
                "--columns",
            ));
        }
        match parsed.announced {
            Some(count) if points.len() > count => Err(FormatError::Content(format!(
                "the first line announces {count} points, and {} follow; put their number there, or take the line away",
                points.len()
            ))),
            Some(count) if points.len() < count => {
                Err(FormatError::truncated(format!("{count} points"), points.len().to_string()))
            }
            _ => {
                let mut notes = if parsed.numbered { vec![Note::NumberedTitle] } else { Vec::new() };
                if parsed.missing > 0 {
                    notes.push(Note::EmptyCells { rows: parsed.missing });
                }
                Ok(Contents { notes, ..Contents::of_points(points) })
            }
        }
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        Ok(other_columns(bytes, options)?.attributes())
    }

    fn left_out(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<String>, FormatError> {
        Ok(other_columns(bytes, options)?.words())
    }

    fn keeps(&self, attribute: &Attribute, cloud: &Outgoing<'_>) -> bool {
        attributes::keeps(attribute, cloud)
    }

    fn has_both_precisions(&self) -> bool {
        true
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        attributes::write(cloud, out)
    }

    /// A `.csv` has a title and commas, a `.pts` its count, an `.xyz` spaces; any text will do elsewhere.
    fn conforms(&self, bytes: &[u8], extension: &str) -> bool {
        let mut first = None;
        let announced = parse(bytes, &ReadOptions::default(), |line, row| {
            first.get_or_insert((line.start, row.style));
            Ok::<_, FormatError>(())
        });
        let Some((start, style)) = first else { return true };
        let head = &bytes[..start];
        match extension {
            "csv" => {
                matches!(style, Style::Comma | Style::Semicolon)
                    && Records::new(head).any(|line| is_title(line.text, false))
            }
            "pts" => style == Style::Space && announced.is_ok_and(|parsed| parsed.announced.is_some()),
            "xyz" => {
                let passed_over = |text: &[u8]| text.trim_ascii().is_empty() || is_comment(text);
                style == Style::Space && Records::new(head).all(|line| passed_over(line.text))
            }
            _ => true,
        }
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        self.read(bytes, options)?;
        let mut splice = Splice::new(bytes, out);
        parse(bytes, options, |line, row| {
            splice.decimal_comma = match row.style {
                Style::SpaceDecimalComma => true,
                Style::Semicolon | Style::Tab => line.text.contains(&b','),
                Style::Space | Style::Comma => {
                    row.places.iter().any(|place| line.text[place.clone()].contains(&b','))
                }
            };
            splice.quote_commas = row.style == Style::Comma;
            let places = row.places.map(|place| line.start + place.start..line.start + place.end);
            splice.numbers(&places, row.point, moved(motion, row.point))
        })?;
        splice.finish()
    }
}

/// The columns that are not the place of the points.
fn other_columns(bytes: &[u8], options: &ReadOptions) -> Result<OtherColumns, FormatError> {
    let mut collector = ColumnCollector::default();
    let announced =
        parse(bytes, options, |line, row| collector.take(line.start, line.text, &row, bytes.len(), options))?;
    Ok(collector.finish(bytes, announced.announced.is_some()))
}

/// More columns than points have.
const MOST_COLUMNS: usize = 64;

/// What a text says besides its points.
#[derive(Default)]
struct Parsed {
    /// The number of points that the first line announces.
    announced: Option<usize>,
    /// Whether the title was 0, 1, 2 and so on.
    numbered: bool,
    /// Fields of the first row.
    width: usize,
    /// Whether nothing says that the first three are x, y and z.
    guessed: bool,
    /// Rows that lack a coordinate.
    missing: usize,
}

/// Goes through the points.
fn parse<E: From<FormatError>>(
    bytes: &[u8],
    options: &ReadOptions,
    mut each: impl FnMut(&Line, TextRow) -> Result<(), E>,
) -> Result<Parsed, E> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(FormatError::Content("the text is UTF-16; save it as UTF-8 or ASCII".into()).into());
    }
    let mut parsed = Parsed::default();
    let mut table = Table::of_points();
    let mut heads = TitleNames::default();
    let mut rows = 0usize;
    let mut whole = None;
    let (mut doubted, mut decimal) = (None, false);
    let mut lines = Records::new(bytes);
    while let Some(mut line) = lines.next() {
        if line.number == 1 && line.text.starts_with("\u{feff}".as_bytes()) {
            line = Line { start: 3, text: &line.text[3..], ..line };
        }
        let trimmed = line.text.trim_ascii();
        if trimmed.is_empty() {
            continue;
        }
        if is_comment(trimmed) {
            if rows == 0 {
                heads.comments.push(line.text);
                if heads.comments.len() > MOST_COLUMNS {
                    heads.comments.remove(0);
                }
            }
            continue;
        }
        if rows == 0 {
            // Spreadsheets leave rows without anything above the title, and may say first what separates.
            if (heads.title.is_none() && title::is_blank(trimmed))
                || (line.number == 1 && title::says_separator(trimmed))
            {
                continue;
            }
            if parsed.announced.is_none()
                && let Some(count) = std::str::from_utf8(trimmed).ok().and_then(|word| word.parse().ok())
            {
                parsed.announced = Some(count);
                continue;
            }
            let next = lines.clone().next().map_or(&b""[..], |line| line.text);
            let numbered = heads.title.is_none() && title::is_numbered(line.text, next);
            if numbered || is_title(line.text, heads.title.is_some()) {
                if heads.title.is_some() {
                    return Err(line.error("a second title; a point is expected").into());
                }
                heads.title = Some(line.text);
                parsed.numbered = numbered;
                continue;
            }
            let title = heads.title.or(heads.comments.last().copied());
            table.look_at_tabs(title, std::iter::once(line.text).chain(lines.clone().map(|line| line.text)));
            parsed.width = title::width(table.style(line.text), line.text);
            (table.columns, table.width, parsed.guessed) = match parsed.numbered {
                true => {
                    let index = usize::from(
                        heads.title.is_some_and(|title| title.trim_ascii_start().starts_with(b",")),
                    );
                    ([index, index + 1, index + 2], 0, false)
                }
                false => title::columns_of(&heads, &line, next, &table, options)?,
            };
            table.width = table.width.max(parsed.width);
        }
        let row = TextRow::parse(line.text, &table).map_err(|problem| line.error(problem))?;
        if let Some(count) = row.whole_numbers(line.text)
            && *whole.get_or_insert(count) != count
        {
            let problem = "the number of fields changes: if the commas are decimal ones, write points instead \
                           or separate the fields by semicolons";
            return Err(line.error(problem).into());
        }
        decimal |= row.comma == Some(QuotedComma::Decimal);
        if row.comma == Some(QuotedComma::Either) && doubted.is_none() {
            doubted = Some(line.error(of_thousands(line.text, &row.places)));
        }
        parsed.missing += usize::from(row.missing);
        rows += 1;
        each(&line, row)?;
    }
    match doubted {
        Some(error) if !decimal => Err(error.into()),
        _ => Ok(parsed),
    }
}

/// Rows that may be poses instead of points.
struct PoseRows {
    rows: Option<Vec<Option<Vec<f64>>>>,
}

impl PoseRows {
    fn new(options: &ReadOptions) -> Self {
        Self { rows: options.columns.is_none().then(Vec::new) }
    }

    fn add(&mut self, line: &[u8]) {
        let Some(rows) = &mut self.rows else { return };
        let fields = Style::of(line).fields(line).map(|(_, field)| number(field).ok());
        let row: Option<Vec<f64>> = fields.take(17).collect();
        let numbered = rows.len().is_multiple_of(5);
        let usual = |row: &Vec<f64>| matches!(row.len(), 4 | 7 | 8 | 12 | 16) || (row.len() == 3 && numbered);
        let usual = row.as_ref().is_some_and(usual);
        rows.push(row);
        // Poses look like poses from the first few rows on.
        let short = rows.len() <= 4;
        let whole = |height: usize| rows.len() - rows.len() % height;
        let looks = || {
            [1, 3, 4, 5].iter().any(|&height| {
                poses_not_points(rows.iter().take(whole(height)).cloned(), whole(height)).is_err()
            })
        };
        if !usual || (!short && rows.len().is_power_of_two() && !looks()) {
            self.rows = None;
        }
    }

    fn check(self) -> Result<(), FormatError> {
        self.rows.map_or(Ok(()), |rows| {
            let count = rows.len();
            poses_not_points(rows.into_iter(), count)
        })
    }
}

/// The first three numbers of a line.
pub fn parse_point(line: &str) -> Result<[f64; 3], String> {
    TextRow::parse(line.as_bytes(), &Table::of_points()).map(|row| row.point)
}

#[cfg(test)]
mod tests;
