//! Bare numbers without a header: the scans of KITTI (`x y z intensity` in single precision), nuScenes and others.

mod plausible;

use std::io::{self, Write};

use super::outgoing::INTENSITY;
use super::scalar::Scalar;
use super::scan::{Splice, moved};
use super::single::check_single;
use super::{
    Attribute, CloudFormat, Contents, FormatError, Note, Outgoing, PointLayout, ReadOptions, ReadSwitch, Room,
};
use crate::Rigid;

/// `.bin` files of points without a header, little endian. What a point is, [`ReadOptions::layout`] says; otherwise
/// the numbers have to: the usual layouts are tried, and one is taken if no other fits. A moved copy keeps all but
/// the coordinates. Written as KITTI has it, with intensity 0, where single precision is enough.
pub(super) struct Kitti;

impl CloudFormat for Kitti {
    fn name(&self) -> &'static str {
        "kitti"
    }

    fn extensions(&self) -> &[&'static str] {
        &["bin"]
    }

    fn recognises(&self, _bytes: &[u8]) -> bool {
        false // any bytes could be numbers
    }

    fn takes(&self) -> &'static [ReadSwitch] {
        &[ReadSwitch::Layout]
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let layout = layout(bytes, options)?;
        options.check_points(bytes.len(), bytes.len() / layout.bytes())?;
        let known = options.layout.is_some() || layout == PointLayout::KITTI;
        let notes = if known { Vec::new() } else { vec![Note::LayoutFound { layout }] };
        Ok(Contents { points: points(bytes, layout), single: !layout.double, notes, ..Contents::default() })
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        let layout = layout(bytes, options)?;
        let names: &[&str] = match layout.numbers {
            4 => &[INTENSITY],
            5 => &[INTENSITY, "ring"],
            _ => &[],
        };
        let kind = if layout.double { Scalar::F64 } else { Scalar::F32 };
        let column = |(index, name): (usize, &&str)| {
            let places =
                (0..bytes.len() / layout.bytes()).map(|p| p * layout.bytes() + (3 + index) * kind.size());
            Attribute { name: (*name).to_owned(), values: kind.column(bytes, false, places) }
        };
        Ok(names.iter().enumerate().map(column).collect())
    }

    fn keeps(&self, attribute: &Attribute, _: &Outgoing<'_>) -> bool {
        attribute.name == INTENSITY
    }

    fn room(&self) -> Room {
        Room::SomePoints
    }

    fn check_points(&self, points: &[[f64; 3]]) -> Result<(), FormatError> {
        check_single(points, "KITTI .bin")
    }

    fn check_rewrite(
        &self,
        from: &str,
        bytes: &[u8],
        options: &ReadOptions,
    ) -> Option<Result<Room, FormatError>> {
        let room = |layout: PointLayout| if layout.double { Room::Anything } else { Room::SomePoints };
        (from == self.name()).then(|| layout(bytes, options).map(room))
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        self.check_points(cloud.points)?;
        let intensity = cloud.attribute(INTENSITY);
        cloud.points.iter().enumerate().try_for_each(|(index, point)| {
            point.iter().try_for_each(|&c| out.write_all(&(c as f32).to_le_bytes()))?;
            let intensity = intensity.and_then(|i| i.values.get(index)).unwrap_or(0.0);
            out.write_all(&(intensity as f32).to_le_bytes())
        })
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        let layout = layout(bytes, options)?;
        options.check_points(bytes.len(), 2 * (bytes.len() / layout.bytes()))?;
        let old = points(bytes, layout);
        let new: Vec<[f64; 3]> = old.iter().map(|&point| moved(motion, point)).collect();
        if !layout.double {
            self.check_points(&new)?;
        }
        let mut splice = Splice::new(bytes, out);
        let size = if layout.double { 8 } else { 4 };
        for (index, (old, new)) in old.iter().zip(&new).enumerate() {
            for axis in (0..3).filter(|&axis| old[axis] != new[axis] && !old[axis].is_nan()) {
                let at = index * layout.bytes() + axis * size;
                match layout.double {
                    true => splice.replace(at..at + 8, &new[axis].to_le_bytes())?,
                    false => splice.replace(at..at + 4, &(new[axis] as f32).to_le_bytes())?,
                }
            }
        }
        splice.finish()
    }
}

/// The layout of a file.
fn layout(bytes: &[u8], options: &ReadOptions) -> Result<PointLayout, FormatError> {
    let Some(layout) = options.layout else { return plausible::find(bytes) };
    if bytes.len().is_multiple_of(layout.bytes()) {
        return Ok(layout);
    }
    Err(FormatError::Content(format!(
        "{} bytes are no whole number of records of {} bytes ({layout}); the file is cut short or of another layout",
        bytes.len(),
        layout.bytes()
    )))
}

fn points(bytes: &[u8], layout: PointLayout) -> Vec<[f64; 3]> {
    if layout == PointLayout::KITTI {
        let point = |record: &[u8; 16]| {
            let words = record.as_chunks::<4>().0;
            std::array::from_fn(|axis| f32::from_le_bytes(words[axis]).into())
        };
        return bytes.as_chunks::<16>().0.iter().map(point).collect();
    }
    let records = bytes.chunks_exact(layout.bytes());
    if layout.double {
        let value = |record: &[u8], axis: usize| f64::from_le_bytes(record.as_chunks::<8>().0[axis]);
        return records.map(|record| std::array::from_fn(|axis| value(record, axis))).collect();
    }
    let value = |record: &[u8], axis: usize| f32::from_le_bytes(record.as_chunks::<4>().0[axis]).into();
    records.map(|record| std::array::from_fn(|axis| value(record, axis))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::testing::{moved_copy, points_of};

    #[test]
    fn records_of_four_floats() {
        let mut bytes = Vec::new();
        for value in [1.5f32, -2.0, 0.1, 0.75, 4.0, f32::NAN, 1e-40, 0.5] {
            bytes.extend(value.to_le_bytes());
        }
        let options = ReadOptions { layout: Some(PointLayout::KITTI), ..ReadOptions::default() };
        let points = Kitti.read(&bytes, &options).unwrap().points;
        assert_eq!(points[0], [1.5, -2.0, f64::from(0.1f32)]);
        assert!(points[1][1].is_nan());
        let mut copy = Vec::new();
        Kitti.rewrite(&bytes, &options, &Rigid::identity(), &mut copy).unwrap();
        assert_eq!(copy, bytes, "intensity and NaN stay");
        for length in (1..32).filter(|n| n % 16 != 0) {
            let message = Kitti.read(&bytes[..length], &options).unwrap_err().to_string();
            assert!(message.contains("records of 16 bytes"), "{message}");
        }
    }

    #[test]
    fn doubles_move_exactly() {
        let points: Vec<[f64; 3]> =
            (0..40).map(|i| [f64::from(i).sin(), 1e5 + f64::from(i) / 7.0, -f64::from(i).cos()]).collect();
        let bytes: Vec<u8> = points.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
        assert_eq!(points_of(&Kitti, &bytes).unwrap(), points);
        let motion = Rigid { translation: [0.0, -1e5, 0.5].into(), ..Rigid::identity() };
        let mut copy = Vec::new();
        moved_copy(&Kitti, &bytes, &motion, &mut copy).unwrap();
        let expected: Vec<[f64; 3]> = points.iter().map(|p| motion.apply(p)).collect();
        assert_eq!(points_of(&Kitti, &copy).unwrap(), expected);
    }

    #[test]
    fn large_coordinates_are_refused() {
        let utm = [[431_234.567_8, 4_812_345.678_9, 12.0], [431_254.567_8, 4_812_345.678_9, 12.0]];
        let error = Kitti.write_cloud(&Outgoing::of_points(&utm), &mut Vec::new()).unwrap_err().to_string();
        assert!(error.contains("single precision") && error.contains(".ply"), "{error}");
    }
}
