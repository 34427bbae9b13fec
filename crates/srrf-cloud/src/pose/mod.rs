//! Poses in files: a 4 x 4 or 3 x 4 matrix, 16 or 12 numbers in a row (KITTI), a translation and a quaternion (TUM, ROS),
//! a table with a title, JSON, `.npy` and `.npz`.
//!
//! [`PoseFile::parse`] tells the layouts apart by their shape and names what it found; [`PoseFormat`] writes them. Every
//! pose maps source coordinates into the target frame, `target ~ R source + t`, and a matrix stands row by row.

mod archive;
mod error;
mod json;
mod matrix;
mod text;
mod titled;
mod write;

use std::fmt;

pub use error::PoseFileError;
pub use write::{PoseFormat, PoseNote};

use crate::Rigid;
use crate::io::{Array, as_utf8};

/// The order of the four numbers of a quaternion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QuaternionOrder {
    /// `qx qy qz qw`, as in ROS, TUM files, SciPy and Eigen's storage.
    Xyzw,
    /// `qw qx qy qz`, as in EuRoC files, Blender and Eigen's constructor.
    Wxyz,
}

impl QuaternionOrder {
    /// Its name, as users give it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Xyzw => "xyzw",
            Self::Wxyz => "wxyz",
        }
    }
}

impl std::str::FromStr for QuaternionOrder {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "xyzw" => Ok(Self::Xyzw),
            "wxyz" => Ok(Self::Wxyz),
            _ => Err("expected xyzw (TUM, ROS) or wxyz (EuRoC)".into()),
        }
    }
}

/// How a file held its pose. [`fmt::Display`] names it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PoseLayout {
    /// 4 rows of 4.
    Matrix4,
    /// 16 numbers in a row, row by row.
    Row16,
    /// 3 rows of 4.
    Matrix3x4,
    /// 12 numbers in a row, as in KITTI's files of poses.
    Row12,
    /// `tx ty tz` and a quaternion, with or without a time before them.
    Quaternion {
        /// The order of its four numbers.
        order: QuaternionOrder,
        /// Whether a title of the file says that order; otherwise it is TUM's, or the one that was asked for.
        titled: bool,
    },
    /// A translation and a rotation whose parts have names, as ROS has them.
    Named,
    /// A matrix whose numbers have names, in the title of a table.
    NamedMatrix,
    /// The key of a JSON object.
    Key(&'static str),
    /// Arrays of an archive, by their names.
    Arrays(Vec<String>),
}

impl fmt::Display for PoseLayout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Matrix4 => f.write_str("a 4 x 4 matrix"),
            Self::Row16 => f.write_str("a 4 x 4 matrix in a row"),
            Self::Matrix3x4 => f.write_str("a 3 x 4 matrix"),
            Self::Row12 => f.write_str("a 3 x 4 matrix in a row (KITTI)"),
            Self::Quaternion { order: QuaternionOrder::Xyzw, .. } => f.write_str("tx ty tz qx qy qz qw"),
            Self::Quaternion { order: QuaternionOrder::Wxyz, .. } => f.write_str("tx ty tz qw qx qy qz"),
            Self::Named => f.write_str("a translation and a quaternion by the names x, y, z, w"),
            Self::NamedMatrix => f.write_str("a matrix by the names of its columns"),
            Self::Arrays(names) => write!(f, "the array {} of an archive", names.join(" and the array ")),
            Self::Key(key) => write!(f, "`{key}` of JSON"),
        }
    }
}

/// A pose from a file, and how the file held it.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseFile {
    /// The pose.
    pub target_from_source: Rigid,
    /// How the file held it.
    pub layout: PoseLayout,
    /// Whether the file says that the one who found the pose abstained from it.
    pub abstained: bool,
}

impl PoseFile {
    /// Reads the pose in the bytes of a file. `order` is that of a quaternion whose file does not say it; TUM's without one.
    ///
    /// # Errors
    /// [`PoseFileError`], with the line, the figure and the way out.
    pub fn parse(bytes: &[u8], order: Option<QuaternionOrder>) -> Result<Self, PoseFileError> {
        if bytes.starts_with(b"\x93NUMPY") {
            return of_array(&Array::parse(bytes)?, order);
        }
        if bytes.starts_with(b"PK\x03\x04") {
            return archive::parse(bytes, order);
        }
        let decoded = as_utf8(bytes)?;
        let bytes = &*decoded;
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let text = std::str::from_utf8(bytes).map_err(|_| PoseFileError::NotText)?;
        let begin = text.trim_start();
        if begin.starts_with('{') {
            return json::parse(begin);
        }
        text::parse(text, order)
    }
}

/// The pose that an array is, by its shape.
fn of_array(array: &Array, order: Option<QuaternionOrder>) -> Result<PoseFile, PoseFileError> {
    let shape: Vec<usize> = array.shape.iter().copied().filter(|&axis| axis != 1).collect();
    let columns = match shape[..] {
        [columns] => columns,
        [_, columns] => columns,
        _ => return Err(PoseFileError::Array { shape: array.shape.clone() }),
    };
    let rows: Vec<text::Row> = array
        .values
        .chunks(columns.max(1))
        .map(|values| text::Row { line: None, values: values.to_vec() })
        .collect();
    text::pose_of_rows(&rows, text::Titled { order: None, asked: order })
}

#[cfg(test)]
mod tests;
