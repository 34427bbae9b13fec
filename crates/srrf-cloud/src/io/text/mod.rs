//! Plain text: one point a line, at least three numbers.

mod attributes;
mod row;
mod title;

use std::io::{self, Write};

pub(super) use self::attributes::fits_single;
use self::attributes::{ColumnCollector, OtherColumns};
use self::row::{Style, TextRow};
use self::title::{TitleNames, is_comment, is_title};
use super::poses::poses_not_points;
use super::scan::{ByteLines, Line, Splice, moved, number};
use super::{Attribute, CloudFormat, Contents, FormatError, Note, Outgoing, ReadOptions};
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
        if points.len() <= 3 && parsed.width > MOST_COLUMNS && options.columns.is_none() {
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
            Some(count) if points.len() != count => {
                Err(FormatError::truncated(format!("{count} points"), points.len().to_string()))
            }
            _ => {
                let notes = if parsed.numbered { vec![Note::NumberedTitle] } else { Vec::new() };
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
                    && ByteLines::new(head).any(|line| is_title(line.text))
            }
            "pts" => style == Style::Space && announced.is_ok_and(|parsed| parsed.announced.is_some()),
            "xyz" => {
                let passed_over = |text: &[u8]| text.trim_ascii().is_empty() || is_comment(text);
                style == Style::Space && ByteLines::new(head).all(|line| passed_over(line.text))
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
                Style::Space | Style::Comma => false,
                Style::SpaceDecimalComma => true,
                Style::Semicolon => line.text.contains(&b','),
            };
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
    let mut columns = [0, 1, 2];
    let mut heads = TitleNames::default();
    let mut rows = 0usize;
    let mut whole = None;
    let mut lines = ByteLines::new(bytes);
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
            if parsed.announced.is_none()
                && let Some(count) = std::str::from_utf8(trimmed).ok().and_then(|word| word.parse().ok())
            {
                parsed.announced = Some(count);
                continue;
            }
            let next = lines.clone().next().map_or(&b""[..], |line| line.text);
            let numbered = heads.title.is_none() && title::is_numbered(line.text, next);
            if numbered || is_title(line.text) {
                if heads.title.is_some() {
                    return Err(line.error("a second title; a point is expected").into());
                }
                heads.title = Some(line.text);
                parsed.numbered = numbered;
                continue;
            }
            parsed.width = title::width(line.text);
            columns = match parsed.numbered {
                true => {
                    let index = usize::from(
                        heads.title.is_some_and(|title| title.trim_ascii_start().starts_with(b",")),
                    );
                    [index, index + 1, index + 2]
                }
                false => title::columns_of(&heads, &line, next, options)?,
            };
        }
        let row = TextRow::parse(line.text, columns).map_err(|problem| line.error(problem))?;
        if let Some(count) = row.whole_numbers(line.text)
            && *whole.get_or_insert(count) != count
        {
            let problem = "the number of fields changes: if the commas are decimal ones, write points instead \
                           or separate the fields by semicolons";
            return Err(line.error(problem).into());
        }
        rows += 1;
        each(&line, row)?;
    }
    Ok(parsed)
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
        let usual = row.as_ref().is_some_and(|row| matches!(row.len(), 4 | 7 | 8 | 12 | 16));
        rows.push(row);
        // Poses look like poses from the first few rows on.
        let short = rows.len() <= 4;
        let looks = || poses_not_points(rows.iter().cloned(), rows.len()).is_err();
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
    TextRow::parse(line.as_bytes(), [0, 1, 2]).map(|row| row.point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::testing::{moved_copy, points_of};

    fn read(text: &str) -> Result<Vec<[f64; 3]>, FormatError> {
        points_of(&Text, text.as_bytes())
    }

    #[test]
    fn separators_titles_and_comments() {
        let expected = vec![[1.0, -2.5, 3e-3], [4.0, 5.0, 6.0]];
        for text in [
            "1 -2.5 3e-3\n4 5 6",
            "# made by hand\r\n1,-2.5,0.003,0,0,1\r\n\r\n4,5,6,1,0,0\r\n",
            "x,y,z\n1;-2.5;.003\n4\t5   6 255 0 0\n",
            "2\n1 -2.5 0.003\n4 5 6\n",
            "\u{feff}//X Y Z\n1 -2.5 0.003\n4 5 6\n",
            "1 -2.5 0.003\r4 5 6\r",
            "1,0 -2,5 0,003\n4 5 6\n",
            "x;y;z\r\n1,0;-2,5;0,003\r\n4;5;6\r\n",
            // columns by name
            "id,Z,Y,X\n7,0.003,-2.5,1\n8,6,5,4\n",
            "# id x y z\n7 1 -2.5 0.003\n8 4 5 6\n",
            "# where x y z are metres\n1 -2.5 0.003\n4 5 6\n",
        ] {
            assert_eq!(read(text).unwrap(), expected, "{text:?}");
        }
        assert!(read("nan 0 0").unwrap()[0][0].is_nan());
    }

    #[test]
    fn bad_lines_are_numbered() {
        assert_eq!(read("1 2 3\n4 5"), Err(FormatError::line(2, "2 numbers where x, y and z are expected")));
        assert_eq!(read("#\n1 2 3\n4 five 6"), Err(FormatError::line(3, "\"five\" is not a number")));
        assert!(read("1 2 x3").is_err());
        assert!(matches!(read("3\n1 2 3\n4 5 6"), Err(FormatError::Truncated { .. })));
        assert!(read("1\n1 2 3\n4 5 6").is_err());
        assert!(read("a b c\n1 2 3").unwrap_err().to_string().contains("columns are a, b, c"));
        assert!(read("a b c\nd e f\n1 2 3").unwrap_err().to_string().contains("line 2"));
        assert!(read("1,5,2,5,3,5\n1,2,5,3,5\n").unwrap_err().to_string().contains("line 2"));
        assert!(points_of(&Text, &[0xff, 0xfe, 0x31, 0x00]).unwrap_err().to_string().contains("UTF-16"));
        assert!(points_of(&Text, &[0x31, 0x20, 0xff, 0x20, 0x32]).is_err());
        assert_eq!(read(""), Ok(vec![]));
    }

    #[test]
    fn a_moved_copy_keeps_the_rest() {
        let motion = Rigid { translation: [1.0, 0.5, -2.0].into(), ..Rigid::identity() };
        let copy = |text: &str| {
            let mut out = Vec::new();
            moved_copy(&Text, text.as_bytes(), &motion, &mut out).unwrap();
            String::from_utf8(out).unwrap()
        };
        assert_eq!(copy("#  a\r\n1.0, 2, 3, 255 ,0\r\n\r\n"), "#  a\r\n2, 2.5, 1, 255 ,0\r\n\r\n");
        assert_eq!(copy("1,5 2 3 0,10"), "2,5 2,5 1 0,10");
        assert_eq!(copy("2\nnan 0 0 red\n0 0 0 blue"), "2\nnan 0 0 red\n1 0.5 -2 blue");
    }

    #[test]
    fn text_is_recognised() {
        for text in ["1 2 3\n", "x,y,z\n1,2,3", "5\n1 2 3\n", "# a\n\n1;2;3"] {
            assert!(Text.recognises(text.as_bytes()), "{text}");
        }
        for text in ["", "# a\n", "hello", "v 1 2 3\n", "1 2\n", "12\n"] {
            assert!(!Text.recognises(text.as_bytes()), "{text}");
        }
        assert!(Text.recognises("1 2 3\n".repeat(2000).as_bytes()));
    }
}
