//! Plain text: one point a line, at least three numbers.

mod attributes;
mod row;

use std::io::{self, Write};

pub(super) use self::attributes::fits_single;
use self::attributes::{ColumnCollector, OtherColumns};
use self::row::{Style, TextRow};
use super::scan::{ByteLines, Line, Splice, moved};
use super::{Attribute, CloudFormat, Contents, FormatError, Outgoing, ReadOptions};
use crate::Rigid;

/// Numbers separated by spaces, tabs, commas or semicolons, a line for each point. x, y and z are
/// the columns that the title names so, otherwise the first three. Empty lines and those that begin
/// with `#` or `//` are passed over, and so is a first line that is a title or (as in PTS files) the
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
        parse(begin, |_, _| {
            rows += 1;
            Ok::<_, FormatError>(())
        })
        .is_ok()
            && rows > 0
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let mut points = Vec::new();
        let announced = parse(bytes, |_, row| {
            options.grow("the points", bytes.len(), &mut points)?;
            points.push(row.point);
            Ok::<_, FormatError>(())
        })?;
        match announced {
            Some(count) if points.len() != count => {
                Err(FormatError::truncated(format!("{count} points"), points.len().to_string()))
            }
            _ => Ok(Contents::of_points(points)),
        }
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        Ok(other_columns(bytes, options)?.attributes())
    }

    fn left_out(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<String>, FormatError> {
        Ok(other_columns(bytes, options)?.words())
    }

    fn write(&self, points: &[[f64; 3]], out: &mut dyn Write) -> io::Result<()> {
        self.write_cloud(&Outgoing::of_points(points), out)
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
        let announced = parse(bytes, |line, row| {
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
            "pts" => style == Style::Space && matches!(announced, Ok(Some(_))),
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
        parse(bytes, |line, row| {
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
        parse(bytes, |line, row| collector.take(line.start, line.text, &row, bytes.len(), options))?;
    Ok(collector.finish(bytes, announced.is_some()))
}

/// Goes through the points; the number of them that the first line announces.
fn parse<E: From<FormatError>>(
    bytes: &[u8],
    mut each: impl FnMut(&Line, TextRow) -> Result<(), E>,
) -> Result<Option<usize>, E> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(FormatError::Content("the text is UTF-16; save it as UTF-8 or ASCII".into()).into());
    }
    let mut announced = None;
    let mut columns = [0, 1, 2];
    let mut title: Option<Line> = None;
    let mut rows = 0usize;
    let mut whole = None;
    for mut line in ByteLines::new(bytes) {
        if line.number == 1 && line.text.starts_with("\u{feff}".as_bytes()) {
            line = Line { start: 3, text: &line.text[3..], ..line };
        }
        let trimmed = line.text.trim_ascii();
        if trimmed.is_empty() {
            continue;
        }
        if trimmed.starts_with(b"#") || trimmed.starts_with(b"//") {
            title = if rows == 0 { Some(line) } else { title };
            continue;
        }
        if rows == 0 && announced.is_none() {
            if let Some(count) = std::str::from_utf8(trimmed).ok().and_then(|word| word.parse().ok()) {
                announced = Some(count);
                continue;
            }
            if is_title(line.text) {
                if title.is_some_and(|title| is_title(title.text) && !is_comment(title.text)) {
                    return Err(line.error("a second title; a point is expected").into());
                }
                title = Some(line);
                continue;
            }
        }
        if rows == 0 {
            columns = title.and_then(|title| named_columns(title.text, line.text)).unwrap_or(columns);
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
    Ok(announced)
}

fn is_comment(text: &[u8]) -> bool {
    let text = text.trim_ascii();
    text.starts_with(b"#") || text.starts_with(b"//")
}

/// A line whose first three fields are words, such as `x,y,z`.
fn is_title(text: &[u8]) -> bool {
    let mut fields = Style::of(text).fields(text).take(3);
    let word = |field: &[u8]| {
        field.first().is_some_and(|b| b.is_ascii_alphabetic() || !b.is_ascii() || b"\"_#/".contains(b))
    };
    fields.by_ref().all(|(_, field)| word(field) && super::scan::number(field).is_err())
}

/// Which columns a title names `x`, `y` and `z`, if it names as many as the first line of numbers
/// has.
fn named_columns(title: &[u8], first: &[u8]) -> Option<[usize; 3]> {
    let bare = title.trim_ascii();
    let bare = bare.strip_prefix(b"//").unwrap_or(bare);
    let bare = bare.strip_prefix(b"#").unwrap_or(bare);
    let names: Vec<&[u8]> = Style::of(bare).fields(bare).map(|(_, name)| name).collect();
    let style = Style::of(first);
    if names.len() != style.fields(first).count() {
        return None;
    }
    let find = |axis: &[u8]| names.iter().position(|name| name.eq_ignore_ascii_case(axis));
    Some([find(b"x")?, find(b"y")?, find(b"z")?])
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
