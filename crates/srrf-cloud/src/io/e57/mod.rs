//! E57, the exchange format of terrestrial laser scanners, read and written by the `e57` crate.

mod attributes;
mod pages;
mod poses;
mod write;

use std::io::{self, Cursor, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};

use e57::{E57Reader, PointCloud, Record, RecordDataType, RecordName, RecordValue};
use nalgebra::{Quaternion, UnitQuaternion};

use super::{Attribute, CloudFormat, Contents, FormatError, Note, Outgoing, ReadOptions, ScanEntry};
use crate::Rigid;

/// E57 files. The points of all scans are read, or of one of them, each scan moved by its pose into the
/// coordinates of the file; points that the scanner marks as invalid are NaN. Written as one scan. A moved copy changes only the poses of scans and images, in double precision; all
/// else stays byte for byte.
pub(super) struct E57;

impl CloudFormat for E57 {
    fn name(&self) -> &'static str {
        "e57"
    }

    fn extensions(&self) -> &[&'static str] {
        &["e57"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        bytes.starts_with(b"ASTM-E57")
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        pages::check(bytes)?;
        guarded(|| read(bytes, options))
    }

    fn holds_scans(&self) -> bool {
        true
    }

    fn scans(&self, bytes: &[u8], _options: &ReadOptions) -> Result<Vec<ScanEntry>, FormatError> {
        pages::check(bytes)?;
        let scans = guarded(|| Ok(E57Reader::new(Cursor::new(bytes))?.pointclouds()))?;
        let entry = |scan: &PointCloud| ScanEntry {
            name: scan.name.clone().unwrap_or_default(),
            points: scan.records,
            pose: pose(scan),
        };
        Ok(scans.iter().map(entry).collect())
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        pages::check(bytes)?;
        guarded(|| attributes::read(bytes, options))
    }

    fn left_out(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<String>, FormatError> {
        pages::check(bytes)?;
        guarded(|| attributes::left_out(bytes, options))
    }

    fn keeps(&self, attribute: &Attribute, cloud: &Outgoing<'_>) -> bool {
        write::keeps(attribute, cloud)
    }

    fn has_both_precisions(&self) -> bool {
        true
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(&guarded(|| write::file(cloud))?)
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        // Read once, so that a damaged file is not copied.
        self.read(bytes, options)?;
        if *motion == Rigid::identity() {
            return out.write_all(bytes);
        }
        let xml = guarded(|| Ok(E57Reader::new(Cursor::new(bytes))?.xml().to_owned()))?;
        out.write_all(&pages::with_xml(bytes, &poses::moved(&xml, motion, options.scan)?)?)
    }
}

/// What the columns of the extension for normals begin with.
const NORMALS_NAMESPACE: &str = "nor";

/// What goes wrong inside.
enum E57Problem {
    Library(e57::Error),
    Format(FormatError),
}

impl From<e57::Error> for E57Problem {
    fn from(error: e57::Error) -> Self {
        Self::Library(error)
    }
}

/// Runs `work` of the `e57` crate; a panic on a damaged file becomes an error.
fn guarded<T>(work: impl FnOnce() -> Result<T, E57Problem>) -> Result<T, FormatError> {
    let damaged =
        |problem: String| FormatError::Content(format!("the E57 file is damaged or cut short: {problem}"));
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(E57Problem::Library(error))) => Err(damaged(error.to_string())),
        Ok(Err(E57Problem::Format(error))) => Err(error),
        Err(_) => Err(damaged("it follows no rules".to_owned())),
    }
}

fn read(bytes: &[u8], options: &ReadOptions) -> Result<Contents, E57Problem> {
    let mut reader = E57Reader::new(Cursor::new(bytes))?;
    let mut points = Vec::new();
    let count = reader.pointclouds().len();
    let (mut viewpoint, mut single) = (None, true);
    for scan in wanted(bytes, &reader.pointclouds(), options)? {
        let more = usize::try_from(scan.records).unwrap_or(usize::MAX);
        options.check_points(bytes.len(), points.len().saturating_add(more)).map_err(E57Problem::Format)?;
        let columns = XyzColumns::of(&scan.prototype).map_err(E57Problem::Format)?;
        let pose = pose(&scan);
        viewpoint = pose.as_ref().map(|pose| pose.translation.into());
        single &= pose.is_none() && columns.single(&scan.prototype);
        for values in reader.pointcloud_raw(&scan)? {
            let point = columns.point(&values?, &scan.prototype);
            points.push(pose.as_ref().map_or(point, |pose| pose.apply(&point)));
        }
    }
    let merged = options.scan.is_none() && count > 1;
    Ok(Contents {
        single: single && !points.is_empty(),
        points,
        viewpoint: viewpoint.filter(|_| !merged),
        notes: if merged { vec![Note::Merged { scans: count }] } else { Vec::new() },
        ..Contents::default()
    })
}

/// The scans that are read, each checked against the bytes that are there.
fn wanted(bytes: &[u8], scans: &[PointCloud], options: &ReadOptions) -> Result<Vec<PointCloud>, E57Problem> {
    let count = scans.len();
    if let Some(number) = options.scan.filter(|&number| number == 0 || number > count) {
        return Err(E57Problem::Format(super::scans::no_such_scan(number, count)));
    }
    let is_wanted = |index: usize| options.scan.is_none_or(|number| number == index + 1);
    let mut found = Vec::new();
    for (_, scan) in scans.iter().enumerate().filter(|(index, _)| is_wanted(*index)) {
        let bits = scan.prototype.iter().map(|record| u128::from(bits(&record.data_type))).sum::<u128>();
        if scan.records > 0 && (bits == 0 || bits * u128::from(scan.records) > 8 * bytes.len() as u128) {
            let announced = format!("{} points of {bits} bits", scan.records);
            return Err(E57Problem::Format(FormatError::truncated(
                announced,
                format!("{} bytes", bytes.len()),
            )));
        }
        found.push(scan.clone());
    }
    Ok(found)
}

/// The number in a column of a point; NaN where there is none.
fn value(values: &[RecordValue], prototype: &[Record], column: usize) -> f64 {
    match (values.get(column), prototype.get(column).map(|r| &r.data_type)) {
        (Some(RecordValue::Single(value)), _) => f64::from(*value),
        (Some(RecordValue::Double(value)), _) => *value,
        (Some(RecordValue::ScaledInteger(n)), Some(RecordDataType::ScaledInteger { scale, offset, .. })) => {
            *n as f64 * scale + offset
        }
        (Some(RecordValue::Integer(n) | RecordValue::ScaledInteger(n)), _) => *n as f64,
        (None, _) => f64::NAN,
    }
}

/// Where a scan stood, if the file says so.
fn pose(scan: &PointCloud) -> Option<Rigid> {
    let pose = scan.transform.as_ref()?;
    let (q, t) = (&pose.rotation, &pose.translation);
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(q.w, q.x, q.y, q.z));
    Some(Rigid { rotation: rotation.to_rotation_matrix().into_inner(), translation: [t.x, t.y, t.z].into() })
}

/// Bits of a number in the file.
fn bits(kind: &RecordDataType) -> u32 {
    match kind {
        RecordDataType::Single { .. } => 32,
        RecordDataType::Double { .. } => 64,
        RecordDataType::Integer { min, max } | RecordDataType::ScaledInteger { min, max, .. } => {
            128 - (i128::from(*max) - i128::from(*min)).max(0).leading_zeros()
        }
    }
}

/// Where the coordinates of a scan are.
struct XyzColumns {
    axes: [usize; 3],
    spherical: bool,
    invalid: Option<usize>,
}

impl XyzColumns {
    fn of(prototype: &[Record]) -> Result<Self, FormatError> {
        let find = |name: RecordName| prototype.iter().position(|record| record.name == name);
        let triple = |names: [RecordName; 3]| {
            let [a, b, c] = names.map(find);
            Some([a?, b?, c?])
        };
        let cartesian = triple([RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ]);
        if let Some(axes) = cartesian {
            return Ok(Self { axes, spherical: false, invalid: find(RecordName::CartesianInvalidState) });
        }
        let names =
            [RecordName::SphericalRange, RecordName::SphericalAzimuth, RecordName::SphericalElevation];
        let axes = triple(names).ok_or_else(|| {
            FormatError::Content("a scan has neither Cartesian nor spherical coordinates".into())
        })?;
        Ok(Self { axes, spherical: true, invalid: find(RecordName::SphericalInvalidState) })
    }

    /// Whether the file holds them in single precision, as they are.
    fn single(&self, prototype: &[Record]) -> bool {
        let kinds = self.axes.map(|axis| prototype.get(axis).map(|record| &record.data_type));
        !self.spherical && kinds.iter().all(|kind| matches!(kind, Some(RecordDataType::Single { .. })))
    }

    fn point(&self, values: &[RecordValue], prototype: &[Record]) -> [f64; 3] {
        let value = |column: usize| value(values, prototype, column);
        if self.invalid.is_some_and(|column| value(column) != 0.0) {
            return [f64::NAN; 3];
        }
        let [a, b, c] = self.axes.map(value);
        if !self.spherical {
            return [a, b, c];
        }
        [a * c.cos() * b.cos(), a * c.cos() * b.sin(), a * c.sin()]
    }
}

#[cfg(test)]
mod tests;
