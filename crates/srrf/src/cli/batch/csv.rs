//! CSV: the fields of records, and fields in text.

use csv_core::ReadFieldResult;
use srrf_args::words::visible;

/// The fields of each record, trimmed, with the line that it begins on. What separates them is a comma, or the semicolon or
/// tab of a first line without commas, as spreadsheets of many countries have it.
///
/// # Errors
/// The line that is not UTF-8.
pub fn records(mut bytes: &[u8]) -> Result<Vec<(u64, Vec<String>)>, String> {
    let mut reader = csv_core::ReaderBuilder::new().delimiter(delimiter(bytes)).build();
    let (mut found, mut fields, mut field) = (Vec::new(), Vec::new(), Vec::new());
    let mut buffer = [0; 1024];
    let mut line = reader.line();
    loop {
        let (result, read, written) = reader.read_field(bytes, &mut buffer);
        bytes = &bytes[read..];
        field.extend_from_slice(&buffer[..written]);
        match result {
            // At the end of the bytes, an empty slice tells the reader so.
            ReadFieldResult::InputEmpty | ReadFieldResult::OutputFull => {}
            ReadFieldResult::Field { record_end } => {
                let text = std::str::from_utf8(&field)
                    .map_err(|_| format!("line {line}: not UTF-8; save the list as CSV in UTF-8"))?;
                fields.push(text.trim().to_owned());
                field.clear();
                if record_end {
                    found.push((line, std::mem::take(&mut fields)));
                    line = reader.line();
                }
            }
            ReadFieldResult::End => return Ok(found),
        }
    }
}

fn delimiter(bytes: &[u8]) -> u8 {
    let first = bytes.split(|b| matches!(b, b'\n' | b'\r')).next().unwrap_or_default();
    [b',', b';', b'\t'].into_iter().find(|mark| first.contains(mark)).unwrap_or(b',')
}

/// Words of others as neither a spreadsheet nor a terminal obeys them: behind `'` what would be a formula, control
/// characters written out. The column `answer` has them as they are.
pub fn harmless(text: &str) -> String {
    let formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.parse::<f64>().is_err();
    format!("{}{}", if formula { "'" } else { "" }, visible(text))
}

/// A line of fields, in quotes where they need them.
pub fn line<'a>(fields: impl IntoIterator<Item = &'a str>) -> String {
    let quoted = |field: &str| {
        if field.contains([',', '"', '\n', '\r']) || field != field.trim() {
            format!("\"{}\"", field.replace('"', "\"\""))
        } else {
            field.to_owned()
        }
    };
    let mut text = fields.into_iter().map(quoted).collect::<Vec<_>>().join(",");
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_others_command_nothing() {
        for (text, harmless) in [
            ("=1+1", "'=1+1"),
            ("@a", "'@a"),
            ("-x", "'-x"),
            ("-1.5e3", "-1.5e3"),
            ("a=b", "a=b"),
            ("\u{1b}[31mred", "\\u{1b}[31mred"),
        ] {
            assert_eq!(super::harmless(text), harmless);
        }
    }

    #[test]
    fn fields_come_back() {
        let fields = ["a b", "x, \"y\"", "", "two\nlines", "ü"];
        let text = line(fields);
        assert_eq!(text, "a b,\"x, \"\"y\"\"\",,\"two\nlines\",ü\n");
        assert_eq!(records(text.as_bytes()).unwrap(), [(1, fields.map(str::to_owned).to_vec())]);
        for text in ["source;target\na, b.ply;c.ply\n", "source\ttarget\r\na, b.ply\tc.ply\r\n"] {
            let read = records(text.as_bytes()).unwrap();
            assert_eq!((&*read[0].1[1], &*read[1].1[0], &*read[1].1[1]), ("target", "a, b.ply", "c.ply"));
        }
        assert!(records(b"a,\xff\n").unwrap_err().starts_with("line 1: not UTF-8"));
    }
}
