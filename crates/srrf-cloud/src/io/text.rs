//! Plain text: one point a line, at least three numbers.

use super::{CloudFormat, FormatError};

/// Numbers separated by spaces, tabs, commas or semicolons; the first three are x, y and z. Empty
/// lines and those that begin with `#` or `//` are passed over, and so is a first line that is a
/// title or (as in PTS files) the number of points.
pub(super) struct Text;

impl CloudFormat for Text {
    fn extensions(&self) -> &[&'static str] {
        &["xyz", "txt", "csv", "pts"]
    }

    fn read(&self, bytes: &[u8]) -> Result<Vec<[f64; 3]>, FormatError> {
        let text = std::str::from_utf8(bytes)
            .map_err(|e| FormatError::Content(format!("not text: byte {} is not UTF-8", e.valid_up_to())))?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut points = Vec::new();
        let mut announced = None;
        let lines = text.lines().enumerate().filter(|(_, line)| {
            let line = line.trim();
            !(line.is_empty() || line.starts_with('#') || line.starts_with("//"))
        });
        for (row, (number, line)) in lines.enumerate() {
            match parse_point(line) {
                Ok(point) => points.push(point),
                Err(_) if row == 0 && line.trim().parse::<usize>().is_ok() => {
                    announced = line.trim().parse::<usize>().ok();
                }
                Err(_) if row == 0 && is_title(line) => {}
                Err(problem) => return Err(FormatError::line(number + 1, problem)),
            }
        }
        match announced {
            Some(count) if points.len() < count => {
                Err(FormatError::truncated(format!("{count} points"), points.len().to_string()))
            }
            _ => Ok(points),
        }
    }

    fn write(&self, points: &[[f64; 3]], out: &mut dyn std::io::Write) -> std::io::Result<()> {
        points.iter().try_for_each(|[x, y, z]| writeln!(out, "{x} {y} {z}"))
    }
}

/// A line whose first three fields are words, such as `x,y,z`.
fn is_title(line: &str) -> bool {
    let mut words = fields(line).take(3);
    words.by_ref().all(|field| field.parse::<f64>().is_err() && field.starts_with(|c: char| !c.is_numeric()))
}

fn fields(line: &str) -> impl Iterator<Item = &str> {
    line.split([' ', '\t', ',', ';', '\r']).filter(|field| !field.is_empty())
}

/// The first three numbers of a line.
pub(crate) fn parse_point(line: &str) -> Result<[f64; 3], String> {
    let mut point = [0.0; 3];
    let mut found = fields(line);
    for (have, value) in point.iter_mut().enumerate() {
        let Some(field) = found.next() else {
            return Err(format!("{have} numbers where x, y and z are expected"));
        };
        *value = field.parse().map_err(|_| format!("{field:?} is not a number"))?;
    }
    Ok(point)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<[f64; 3]>, FormatError> {
        Text.read(text.as_bytes())
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
        assert!(Text.read(&[0xff, 0xfe, 0x00]).is_err());
        assert_eq!(read(""), Ok(vec![]));
    }
}
