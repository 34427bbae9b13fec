//! PTS: for each scan a line with the number of its points, then a line a point. No poses.

use std::io::{self, Write};
use std::ops::Range;

use super::scalar::Scalar;
use super::scan::{ByteLines, number};
use super::scans::{attribute_values, no_such_scan};
use super::text::Text;
use super::{Attribute, CloudFormat, Contents, FormatError, Outgoing, ReadOptions, ReadSwitch, ScanEntry};
use crate::Rigid;

/// PTS files; the lines are read as text is. A file of several scans has no poses for them, so that
/// the scan must be named. Written as one scan. A moved copy keeps all other columns and scans.
pub(super) struct Pts;

/// A scan: its place in the file, the lines before it, and the points that it announces.
#[derive(Debug, Clone, PartialEq)]
struct PtsScan {
    place: Range<usize>,
    lines: usize,
    points: u64,
}

/// The number on a line of its own.
fn count(text: &[u8]) -> Option<u64> {
    let text = text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(text).trim_ascii();
    std::str::from_utf8(text).ok()?.parse().ok()
}

/// The scans of a file; a file without counts is one. A number alone on a line is no point, so that it begins a scan even
/// where the one before has more or fewer points than it announces.
fn blocks(bytes: &[u8]) -> Vec<PtsScan> {
    let mut blocks: Vec<PtsScan> = Vec::new();
    for line in ByteLines::new(bytes) {
        let points = count(line.text);
        if let Some(points) = points.filter(|_| !blocks.is_empty() || line.number == 1) {
            if let Some(last) = blocks.last_mut() {
                last.place.end = line.start;
            }
            blocks.push(PtsScan { place: line.start..bytes.len(), lines: line.number - 1, points });
        }
    }
    if blocks.is_empty() { vec![PtsScan { place: 0..bytes.len(), lines: 0, points: 0 }] } else { blocks }
}

/// The scan that is asked for, or the only one.
fn choose(bytes: &[u8], options: &ReadOptions) -> Result<PtsScan, FormatError> {
    let blocks = blocks(bytes);
    let count = blocks.len();
    match options.scan {
        None if count > 1 => Err(FormatError::Unclear {
            problem: format!(
                "{count} scans, and PTS does not say where they stood, so that they are no one cloud; the first is 1"
            ),
            switch: "--scan",
        }),
        number => {
            let number = number.unwrap_or(1);
            let block = blocks.into_iter().nth(number.wrapping_sub(1));
            block.ok_or_else(|| no_such_scan(number, count))
        }
    }
}

/// An error with the line of the file, not of the scan.
fn shifted(error: FormatError, lines: usize) -> FormatError {
    match error {
        FormatError::Line { line, problem } => FormatError::Line { line: line + lines, problem },
        other => other,
    }
}

impl CloudFormat for Pts {
    fn name(&self) -> &'static str {
        "pts"
    }

    fn extensions(&self) -> &[&'static str] {
        &["pts"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        let mut lines = ByteLines::new(&bytes[..bytes.len().min(1024)]);
        let counts = lines.next().and_then(|line| count(line.text)).is_some();
        let numbers = |text: &[u8]| {
            let mut words = super::scan::words(text);
            (0..3).all(|_| words.next().is_some_and(|(_, word)| number(word).is_ok()))
        };
        counts && lines.next().is_some_and(|line| numbers(line.text))
    }

    fn takes(&self) -> &'static [ReadSwitch] {
        &[ReadSwitch::Columns]
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let block = choose(bytes, options)?;
        Text.read(&bytes[block.place], options).map_err(|error| shifted(error, block.lines))
    }

    fn holds_scans(&self) -> bool {
        true
    }

    fn scans(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<ScanEntry>, FormatError> {
        let blocks = blocks(bytes);
        if let [_] = &blocks[..] {
            let points = Text.read(bytes, options)?.points.len() as u64;
            return Ok(vec![ScanEntry { name: String::new(), points, pose: None }]);
        }
        let entry = |block: PtsScan| ScanEntry { name: String::new(), points: block.points, pose: None };
        Ok(blocks.into_iter().map(entry).collect())
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        let block = choose(bytes, options)?;
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let mut rows = 0usize;
        for line in ByteLines::new(&bytes[block.place]).filter(|line| line.words().count() > 1) {
            let values: Vec<f64> =
                line.words().skip(3).map_while(|(_, word)| number(word).ok()).take(4).collect();
            if rows == 0 {
                columns = vec![Vec::new(); values.len()];
            }
            columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
            rows += 1;
        }
        let names: &[&str] = match columns.len() {
            1 => &["intensity"],
            3 => &["red", "green", "blue"],
            4 => &["intensity", "red", "green", "blue"],
            _ => &[],
        };
        let whole = names.iter().zip(columns).filter(|(_, column)| column.len() == rows);
        Ok(whole
            .map(|(name, column)| {
                let kind = if *name == "intensity" { Scalar::F32 } else { Scalar::U8 };
                Attribute { name: (*name).into(), values: attribute_values(kind, column.into_iter()) }
            })
            .collect())
    }

    fn keeps(&self, attribute: &Attribute, cloud: &Outgoing<'_>) -> bool {
        Text.keeps(attribute, &Outgoing { extension: "pts", ..*cloud })
    }

    fn has_both_precisions(&self) -> bool {
        Text.has_both_precisions()
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        Text.write_cloud(&Outgoing { extension: "pts", ..*cloud }, out)
    }

    fn conforms(&self, bytes: &[u8], _extension: &str) -> bool {
        blocks(bytes).len() > 1 || Text.conforms(bytes, "pts")
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        let block = choose(bytes, options)?;
        out.write_all(&bytes[..block.place.start])?;
        Text.rewrite(&bytes[block.place.clone()], options, motion, out)?;
        out.write_all(&bytes[block.place.end..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::AttributeValues;
    use crate::io::testing::points_of;

    const TWO: &str =
        "2\n1 2 3 -100 255 0 0\n4 5 6 -90 0 255 0\n\n3\n7 8 9 1 2 3 4\n1 1 1 0 0 0 0\n2 2 2 0 0 0 0\n";

    #[test]
    fn scans_are_named() {
        let error = Pts.read(TWO.as_bytes(), &ReadOptions::default()).unwrap_err();
        assert!(matches!(error, FormatError::Unclear { switch: "--scan", .. }), "{error}");
        assert!(error.to_string().contains("2 scans"), "{error}");
        let scan = |number| Pts.read(TWO.as_bytes(), &ReadOptions::default().of_scan(number));
        assert_eq!(scan(1).unwrap().points, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        assert_eq!(scan(2).unwrap().points, [[7.0, 8.0, 9.0], [1.0; 3], [2.0; 3]]);
        assert!(scan(3).unwrap_err().to_string().contains("2 scans, numbered from 1"));
        let counts = |text: &str| -> Vec<u64> {
            let scans = Pts.scans(text.as_bytes(), &ReadOptions::default()).unwrap();
            scans.iter().map(|scan| scan.points).collect()
        };
        assert_eq!(counts(TWO), [2, 3]);
        assert_eq!(counts("1\n1 2 3\n"), [1]);
        assert_eq!(counts("1 2 3\n4 5 6\n"), [2], "without a count");
        let wrong = TWO.replace("1 1 1", "1 1 one");
        let error = Pts.read(wrong.as_bytes(), &ReadOptions::default().of_scan(2)).unwrap_err();
        assert_eq!(error, FormatError::line(7, "\"one\" is not a number"));
        let short = TWO.replace("2 2 2 0 0 0 0\n", "");
        let error = Pts.read(short.as_bytes(), &ReadOptions::default().of_scan(2)).unwrap_err().to_string();
        assert!(error.contains("3 points announced, 2 found"), "{error}");
    }

    #[test]
    fn a_count_that_is_one_off() {
        let error = |text: &str, scan| {
            let read = Pts.read(text.as_bytes(), &ReadOptions { scan, ..ReadOptions::default() });
            read.unwrap_err().to_string()
        };
        assert!(error("3\n1 2 3\n4 5 6\n", None).contains("cut short: 3 points announced, 2 found"));
        let more = error("1\n1 2 3\n4 5 6\n", None);
        assert!(more.contains("announces 1 points, and 2 follow; put their number there"), "{more}");
        // The scan behind it begins all the same.
        for (count, words) in
            [("3", "3 points announced, 2 found"), ("1", "announces 1 points, and 2 follow")]
        {
            let text = TWO.replacen('2', count, 1);
            let first = error(&text, Some(1));
            assert!(first.contains(words), "{first}");
            let second = Pts.read(text.as_bytes(), &ReadOptions::default().of_scan(2)).unwrap().points;
            assert_eq!(second, [[7.0, 8.0, 9.0], [1.0; 3], [2.0; 3]]);
        }
    }

    #[test]
    fn intensities_and_colours() {
        let of = |number| Pts.attributes(TWO.as_bytes(), &ReadOptions::default().of_scan(number)).unwrap();
        let first = of(1);
        let names: Vec<&str> = first.iter().map(|attribute| attribute.name.as_str()).collect();
        assert_eq!(names, ["intensity", "red", "green", "blue"]);
        assert_eq!(first[0].values, AttributeValues::F32(vec![-100.0, -90.0]));
        assert_eq!(first[2].values, AttributeValues::U8(vec![0, 255]));
        assert_eq!(of(2)[3].values, AttributeValues::U8(vec![4, 0, 0]));
        assert_eq!(Pts.attributes(b"1\n1 2 3\n", &ReadOptions::default()), Ok(vec![]));
    }

    #[test]
    fn written_with_its_count_and_moved_alone() {
        let mut out = Vec::new();
        Pts.write_cloud(&Outgoing::of_points(&[[1.0, 0.5, -2.0], [3.0, 4.0, 5.0]]), &mut out).unwrap();
        assert_eq!(out, b"2\n1 0.5 -2\n3 4 5\n");
        assert!(Pts.recognises(&out) && !Pts.recognises(b"1 2 3\n4 5 6\n") && !Pts.recognises(b"1\n"));
        assert_eq!(points_of(&Pts, &out).unwrap()[0], [1.0, 0.5, -2.0]);
        let motion = Rigid { translation: [10.0, 0.0, 0.0].into(), ..Rigid::identity() };
        let mut copy = Vec::new();
        Pts.rewrite(TWO.as_bytes(), &ReadOptions::default().of_scan(2), &motion, &mut copy).unwrap();
        let expected = TWO.replace("7 8 9", "17 8 9").replace("1 1 1", "11 1 1").replace("2 2 2", "12 2 2");
        assert_eq!(String::from_utf8(copy).unwrap(), expected);
    }
}
