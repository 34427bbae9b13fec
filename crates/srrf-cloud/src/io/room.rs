//! [`Room`]: what clouds a format can hold, asked before any work is done.

use std::path::Path;

use super::choice::{extension_of, format_of, named};
use super::{CloudFile, CloudFormat, FormatError, IoError};

/// What clouds a format can hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Room {
    /// None, and why; the text names formats that can.
    Nothing(&'static str),
    /// Any points.
    Anything,
    /// Points that pass [`CloudFormat::check_points`].
    SomePoints,
}

impl Room {
    /// The error of writing what there is no room for.
    pub(super) fn refusal(why: &str) -> FormatError {
        FormatError::Unwritable(why.to_owned())
    }

    fn check(
        self,
        format: &dyn CloudFormat,
        points: impl FnOnce() -> Result<Vec<[f64; 3]>, FormatError>,
    ) -> Result<(), FormatError> {
        match self {
            Self::Nothing(why) => Err(Self::refusal(why)),
            Self::Anything => Ok(()),
            Self::SomePoints => format.check_points(&points()?),
        }
    }
}

/// Checks what can be known of writing a cloud to `path` before its points are known.
///
/// # Errors
/// [`IoError::UnknownFormat`], [`IoError::LeftOut`], [`IoError::Write`].
pub fn check_format(path: &Path) -> Result<(), IoError> {
    match format_of(path)?.room() {
        Room::Nothing(why) => Err(unwritable(path, Room::refusal(why))),
        Room::Anything | Room::SomePoints => Ok(()),
    }
}

/// As [`check_format`], for `points` that will be laid on those of `target`.
///
/// # Errors
/// As [`check_format`].
pub fn check_moved_points(path: &Path, points: &[[f64; 3]], target: &[[f64; 3]]) -> Result<(), IoError> {
    let format = format_of(path)?;
    let checked = format.room().check(format, || Ok(laid_near(points.to_vec(), target)));
    checked.map_err(|error| unwritable(path, error))
}

fn unwritable(path: &Path, error: FormatError) -> IoError {
    IoError::Write { path: path.to_owned(), source: error.into() }
}

impl CloudFile {
    /// Checks what can be known of [`write_transformed`](Self::write_transformed) before the motion is known, which
    /// lays the points on those of `target`; `target` may be empty.
    ///
    /// # Errors
    /// As [`write_transformed`](Self::write_transformed).
    pub fn check_transformed(&self, output: &Path, target: &[[f64; 3]]) -> Result<(), IoError> {
        let format = format_of(output)?;
        let checked = self.check_copy(format, &extension_of(output), target);
        checked.map_err(|error| self.write_error(output, error.into()))
    }

    /// As [`check_transformed`](Self::check_transformed), of [`write_transformed_to`](Self::write_transformed_to).
    ///
    /// # Errors
    /// As [`write_transformed_to`](Self::write_transformed_to).
    pub fn check_transformed_to(&self, format: Option<&str>, target: &[[f64; 3]]) -> Result<(), IoError> {
        let extension = format.unwrap_or_default().to_ascii_lowercase();
        let format = format.map_or(Ok(self.known_format()), named)?;
        let checked = self.check_copy(format, &extension, target);
        checked.map_err(|error| self.write_error(Path::new("-"), error.into()))
    }

    fn check_copy(
        &self,
        format: &'static dyn CloudFormat,
        extension: &str,
        target: &[[f64; 3]],
    ) -> Result<(), FormatError> {
        let room = match format.check_rewrite(self.format(), self.bytes(), self.options()) {
            Some(room) if format.name() != self.format() || format.conforms(self.bytes(), extension) => room?,
            _ => format.room(),
        };
        room.check(format, || Ok(laid_near(self.read()?.points, target)))
    }
}

/// The points where the target lies, or rather only half as far from the origin as the nearest place of its box:
/// single precision that is not enough there is not enough on the target. Points that are as far out already stay.
fn laid_near(points: Vec<[f64; 3]>, target: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let boxed = |points: &[[f64; 3]], axis: usize| {
        let values = || points.iter().map(|point| point[axis]).filter(|value| value.is_finite());
        [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
    };
    let [own, place] = [&points[..], target].map(|points| [0, 1, 2].map(|axis| boxed(points, axis)));
    let nearest = place.map(|[low, high]| 0.5 * if low > 0.0 { low } else { high.min(0.0) });
    let reach = own.iter().flatten().fold(0.0, |most: f64, value| most.max(value.abs()));
    let far = nearest.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    if points.is_empty() || target.is_empty() || reach >= far {
        return points;
    }
    let shift: [f64; 3] = std::array::from_fn(|axis| nearest[axis] - 0.5 * (own[axis][0] + own[axis][1]));
    points.into_iter().map(|point| std::array::from_fn(|axis| point[axis] + shift[axis])).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{FORMATS, Outgoing, write_cloud_to};
    use super::*;
    use crate::{PointCloud, Rigid};

    const NEAR: [[f64; 3]; 4] = [[0.1, 0.2, 0.3], [1.1, 0.2, 0.4], [0.3, 2.2, 0.3], [0.7, 0.1, 3.3]];

    fn file(format: &str) -> Option<CloudFile> {
        let mut bytes = Vec::new();
        write_cloud_to(&mut bytes, format, &PointCloud::new(NEAR.to_vec()).unwrap()).ok()?;
        CloudFile::from_reader(&mut &bytes[..], Some(format)).ok()
    }

    /// What is refused before is refused after, and what is not is written.
    #[test]
    fn what_a_format_says_holds() {
        let mut without_room = Vec::new();
        for format in FORMATS {
            let mut out = Vec::new();
            let written = format
                .write_cloud(&Outgoing { extension: format.name(), ..Outgoing::of_points(&NEAR) }, &mut out);
            match format.room() {
                Room::Nothing(why) => {
                    assert_eq!(written.unwrap_err().to_string(), why, "{}", format.name());
                    assert!(why.contains("write ."), "{why}");
                    without_room.push(format.name());
                }
                Room::Anything => written.unwrap(),
                Room::SomePoints => {
                    assert_eq!(format.check_points(&NEAR), Ok(()), "{}", format.name());
                    written.unwrap();
                }
            }
        }
        without_room.sort_unstable();
        let expected: Vec<&str> =
            ["mcap", "ptx", "stl", "vts"].into_iter().filter(|n| named(n).is_ok()).collect();
        assert_eq!(without_room, expected);
    }

    #[test]
    fn copies_are_refused_before_and_after_alike() {
        let motion = Rigid { translation: [1.0, 0.0, 0.0].into(), ..Rigid::identity() };
        for from in FORMATS.iter().filter_map(|format| file(format.name())) {
            for to in FORMATS {
                let before = from.check_transformed_to(Some(to.name()), &NEAR).map_err(|e| e.to_string());
                let after = from.write_transformed_to(&mut Vec::new(), Some(to.name()), &motion);
                let after = after.map(drop).map_err(|e| e.to_string());
                assert_eq!(before, after, "{} to {}", from.format(), to.name());
            }
        }
    }

    #[test]
    fn a_target_far_out_needs_double_precision() {
        let far = NEAR.map(|[x, y, z]| [x + 431_234.567, y + 4_812_345.678, z]);
        let xyz = file("xyz").unwrap();
        let check =
            |target: &[[f64; 3]]| xyz.check_transformed_to(Some("kitti"), target).map_err(|e| e.to_string());
        assert_eq!(check(&NEAR), Ok(()));
        assert_eq!(check(&[]), Ok(()));
        assert!(check(&far).unwrap_err().contains("single precision"));
        assert_eq!(xyz.check_transformed_to(Some("ply"), &far).map_err(|e| e.to_string()), Ok(()));
        let around = [[-4e6, -4e6, 0.0], [4e6, 4e6, 0.0]];
        assert_eq!(check(&around), Ok(()), "it may lie at the origin");
        // A file of single precision that lies there already may stay.
        assert_eq!(laid_near(far.to_vec(), &far), far);
        let there = file("kitti").unwrap();
        assert!(there.check_transformed_to(None, &far).unwrap_err().to_string().contains("single precision"));
        let folder = tempfile::tempdir().unwrap();
        let check = |name: &str| {
            check_moved_points(&folder.path().join(name), &NEAR, &far).map_err(|e| e.to_string())
        };
        assert!(check("a.bin").unwrap_err().contains("a.bin") && check("a.ply").is_ok());
        assert!(check("a.stl").unwrap_err().contains("STL holds triangles"));
        assert!(check_format(Path::new("a.ptx")).is_err() && check_format(Path::new("a.csv")).is_ok());
    }
}
