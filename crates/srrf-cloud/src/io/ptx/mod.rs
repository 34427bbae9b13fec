//! PTX, Leica's text format of terrestrial scans: several scans in one file, each with its pose.

mod parse;

use std::fmt::Write as _;
use std::io::{self, Write};

use self::parse::{PtxHeader, PtxRow, parse};
use super::scan::{Splice, put_number};
use super::{
    Attribute, AttributeValues, CloudFormat, Contents, FormatError, Note, Outgoing, ReadOptions, Room,
    ScanEntry,
};
use crate::Rigid;

/// PTX files. The points of all scans are read, each scan moved by its pose into the coordinates of
/// the file, or those of one scan, in the same coordinates; beams that did not come back (zeros) are
/// NaN. A moved copy changes only the matrices in the headers of the scans. Not written.
pub(super) struct Ptx;

const NO_GRID: &str = "PTX holds the grid of a scanner, which other clouds do not have; write .ply or .e57";

/// What is read of a file.
#[derive(Default)]
struct PtxScans {
    points: Vec<[f64; 3]>,
    headers: Vec<PtxHeader>,
    /// Intensity, red, green, blue, as far as all points have them.
    values: [Vec<f64>; 4],
    columns: Option<usize>,
}

impl CloudFormat for Ptx {
    fn name(&self) -> &'static str {
        "ptx"
    }

    fn extensions(&self) -> &[&'static str] {
        &["ptx"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        recognises(bytes)
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let scans = read(bytes, options, false)?;
        let chosen = match options.scan {
            Some(number) => scans.headers.get(number - 1),
            None => scans.headers.first().filter(|_| scans.headers.len() == 1),
        };
        let merged = scans.headers.len();
        let notes = if options.scan.is_none() && merged > 1 {
            vec![Note::Merged { scans: merged }]
        } else {
            Vec::new()
        };
        Ok(Contents {
            points: scans.points,
            viewpoint: chosen.map(|header| header.file_from_scan.translation.into()),
            // A column is a scan line, and its points follow one another.
            grid: chosen.filter(|h| h.columns > 1 && h.rows > 1).map(|header| [header.rows, header.columns]),
            notes,
            ..Contents::default()
        })
    }

    fn holds_scans(&self) -> bool {
        true
    }

    fn scans(&self, bytes: &[u8], _options: &ReadOptions) -> Result<Vec<ScanEntry>, FormatError> {
        let mut entries: Vec<ScanEntry> = Vec::new();
        let headers = |_: usize, header: &PtxHeader| {
            let points = (header.columns as u64).saturating_mul(header.rows as u64);
            entries.push(ScanEntry { name: String::new(), points, pose: Some(header.file_from_scan) });
            Ok::<_, FormatError>(false)
        };
        parse(bytes, headers, |_| Ok(()))?;
        Ok(entries)
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        let scans = read(bytes, options, true)?;
        let [intensity, red, green, blue] = scans.values;
        let mut attributes = Vec::new();
        let single =
            |values: Vec<f64>| AttributeValues::F32(values.into_iter().map(|value| value as f32).collect());
        if intensity.len() == scans.points.len() {
            attributes.push(Attribute { name: "intensity".into(), values: single(intensity) });
        }
        for (name, values) in [("red", red), ("green", green), ("blue", blue)] {
            if values.len() == scans.points.len() {
                let bytes = values.into_iter().map(|value| value.clamp(0.0, 255.0) as u8).collect();
                attributes.push(Attribute { name: name.into(), values: AttributeValues::U8(bytes) });
            }
        }
        Ok(attributes)
    }

    fn room(&self) -> Room {
        Room::Nothing(NO_GRID)
    }

    fn write_cloud(&self, _cloud: &Outgoing<'_>, _out: &mut dyn Write) -> io::Result<()> {
        Err(Room::refusal(NO_GRID).into())
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        // Read once, so that a damaged file is not copied.
        let scans = read(bytes, options, false)?;
        let mut splice = Splice::new(bytes, out);
        for (index, header) in scans.headers.iter().enumerate() {
            let moves = options.scan.is_none_or(|number| number == index + 1);
            if moves && *motion != Rigid::identity() {
                let pose = motion.compose(&header.file_from_scan);
                splice.replace(header.place.clone(), matrix(&pose).as_bytes())?;
            }
        }
        splice.finish()
    }
}

/// The four lines of a pose.
fn matrix(pose: &Rigid) -> String {
    let mut text = String::new();
    for row in 0..4 {
        for column in 0..4 {
            let value = match (row, column) {
                (3, 3) => 1.0,
                (_, 3) => 0.0,
                (3, axis) => pose.translation[axis],
                // Points are rows here, so that the matrix stands on its side.
                (row, column) => pose.rotation[(column, row)],
            };
            let mut word = Vec::new();
            put_number(&mut word, value);
            let gap = if column > 0 { " " } else { "" };
            // A string takes all that is written.
            let _ = write!(text, "{gap}{}", String::from_utf8_lossy(&word));
        }
        text.push_str(if row < 3 { "\n" } else { "" });
    }
    text
}

fn read(bytes: &[u8], options: &ReadOptions, values: bool) -> Result<PtxScans, FormatError> {
    let wanted = options.scan;
    let scans = std::cell::RefCell::new(PtxScans::default());
    let header = |index: usize, header: &PtxHeader| {
        scans.borrow_mut().headers.push(header.clone());
        Ok::<_, FormatError>(wanted.is_none_or(|number| number == index + 1))
    };
    let row = |row: &PtxRow| {
        let mut scans = scans.borrow_mut();
        let PtxScans { points, headers, values: lists, columns } = &mut *scans;
        options.grow("the points", bytes.len(), points)?;
        let pose = headers.last().map(|header| &header.file_from_scan);
        let point = row.point().zip(pose).map_or([f64::NAN; 3], |(point, pose)| {
            if *pose == Rigid::identity() { point } else { pose.apply(&point) }
        });
        points.push(point);
        if values {
            let count = columns.map_or(row.count, |columns| columns.min(row.count));
            *columns = Some(count);
            for (list, value) in lists.iter_mut().zip(&row.values[3..count]) {
                list.push(*value);
            }
        }
        Ok(())
    };
    let count = parse(bytes, header, row)?;
    match wanted {
        Some(number) if number == 0 || number > count => Err(super::scans::no_such_scan(number, count)),
        _ => Ok(scans.into_inner()),
    }
}

/// Two lines of one number each, then five lines of three, four of four and a point.
fn recognises(bytes: &[u8]) -> bool {
    let begin = &bytes[..bytes.len().min(4096)];
    let begin = begin.strip_prefix("\u{feff}".as_bytes()).unwrap_or(begin);
    let counts = super::scan::ByteLines::new(begin)
        .filter(|line| !line.text.trim_ascii().is_empty())
        .take(10)
        .map(|line| line.words().count());
    counts.eq([1, 1, 3, 3, 3, 3, 4, 4, 4, 4])
}

#[cfg(test)]
mod tests;
