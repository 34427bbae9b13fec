//! The scans of the KITTI odometry set: `x y z intensity` in single precision, without a header.

use std::io::{self, Write};

use super::outgoing::INTENSITY;
use super::scalar::Scalar;
use super::scan::{Splice, moved};
use super::single::check_single;
use super::{Attribute, CloudFormat, Contents, FormatError, Outgoing, ReadOptions};
use crate::Rigid;

/// Bytes of a point.
const RECORD: usize = 16;

/// KITTI's `.bin`: records of four `f32`, little endian. A moved copy keeps the intensities;
/// a cloud is written with intensity 0. Written only where single precision is enough.
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

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        if !bytes.len().is_multiple_of(RECORD) {
            let five = if bytes.len().is_multiple_of(20) {
                " (records of 20 bytes would fit: nuScenes?)"
            } else {
                ""
            };
            return Err(FormatError::Content(format!(
                "{} bytes are no whole number of records of {RECORD} bytes (x, y, z, intensity as 32-bit floats)\
                 {five}; the file is cut short or of another kind",
                bytes.len()
            )));
        }
        options.check_points(bytes.len(), bytes.len() / RECORD)?;
        let points = bytes.as_chunks::<RECORD>().0.iter().map(point).collect();
        Ok(Contents { points, single: true, ..Contents::default() })
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        let count = self.read(bytes, options)?.points.len();
        let places = (0..count).map(|point| point * RECORD + 12);
        Ok(vec![Attribute { name: INTENSITY.into(), values: Scalar::F32.column(bytes, false, places) }])
    }

    fn write(&self, points: &[[f64; 3]], out: &mut dyn Write) -> io::Result<()> {
        self.write_cloud(&Outgoing::of_points(points), out)
    }

    fn keeps(&self, attribute: &Attribute, _: &Outgoing<'_>) -> bool {
        attribute.name == INTENSITY
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        check_single(cloud.points, "KITTI .bin")?;
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
        let old = self.read(bytes, options)?.points;
        let new: Vec<[f64; 3]> = old.iter().map(|&point| moved(motion, point)).collect();
        check_single(&new, "KITTI .bin")?;
        let mut splice = Splice::new(bytes, out);
        for (index, (old, new)) in old.iter().zip(&new).enumerate() {
            for axis in (0..3).filter(|&axis| old[axis] != new[axis] && !old[axis].is_nan()) {
                let at = index * RECORD + axis * 4;
                splice.replace(at..at + 4, &(new[axis] as f32).to_le_bytes())?;
            }
        }
        splice.finish()
    }
}

fn point(record: &[u8; RECORD]) -> [f64; 3] {
    let words = record.as_chunks::<4>().0;
    std::array::from_fn(|axis| f32::from_le_bytes(words[axis]).into())
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
        let points = points_of(&Kitti, &bytes).unwrap();
        assert_eq!(points[0], [1.5, -2.0, f64::from(0.1f32)]);
        assert!(points[1][1].is_nan());
        let mut copy = Vec::new();
        moved_copy(&Kitti, &bytes, &Rigid::identity(), &mut copy).unwrap();
        assert_eq!(copy, bytes, "intensity and NaN stay");
        for length in (1..32).filter(|n| n % 16 != 0) {
            let message = points_of(&Kitti, &bytes[..length]).unwrap_err().to_string();
            assert!(message.contains("records of 16 bytes"), "{message}");
        }
        assert!(points_of(&Kitti, &[0; 20]).unwrap_err().to_string().contains("nuScenes"));
    }

    #[test]
    fn large_coordinates_are_refused() {
        let utm = [[431_234.567_8, 4_812_345.678_9, 12.0], [431_254.567_8, 4_812_345.678_9, 12.0]];
        let error = Kitti.write(&utm, &mut Vec::new()).unwrap_err().to_string();
        assert!(error.contains("single precision") && error.contains(".ply"), "{error}");
    }
}
