//! Clouds in files and streams: PLY, PCD, text (XYZ, TXT, CSV, PTS), NPY, NPZ, OBJ, OFF, STL, `.bin`
//! (KITTI, nuScenes), and with the cargo features of these names LAS/LAZ (`las`) and E57 (`e57`).
//!
//! Each format is one module here and one line in [`FORMATS`]. The format of a file is chosen by its
//! extension, and by its content where that says nothing ([`CloudFile`]). Coordinates are `f64`:
//! what a file holds in single precision is read exactly, and what is written reads back as the same
//! bits, but for the formats that hold less (KITTI, binary STL, LAS), which refuse to lose what
//! matters or say in their documentation what they keep.
//!
//! The parsers trust no count of a file with memory: they take at most a small multiple of its
//! size, and give an error, never a panic, for broken files. Fuzzers are in `fuzz/`.

use std::io::Write;
use std::path::Path;

use crate::{PointCloud, Rigid};

mod arrays;
mod atomic;
mod axes;
mod bin;
mod bytes;
mod choice;
mod columns;
mod contents;
#[cfg(feature = "e57")]
mod e57;
mod encoding;
mod error;
mod file;
mod foreign;
#[cfg(feature = "gltf")]
mod gltf;
#[cfg(feature = "las")]
mod las;
#[cfg(feature = "mcap")]
mod mcap;
mod memory;
mod npy;
mod npz;
mod npz_writer;
mod obj;
pub mod off;
mod options;
mod outgoing;
#[cfg(feature = "parquet")]
mod parquet;
mod pcd;
mod ply;
mod poses;
mod pts;
mod ptx;
mod room;
mod scalar;
mod scan;
mod scans;
mod single;
mod stl;
mod taken;
mod text;
mod vtk;
mod width;

pub use arrays::{ArrayError, NpzArrays, parse_npz, read_npy, read_npz};
pub use atomic::{place_of, remove_left_overs, write_atomically};
pub use bytes::read_file;
pub use contents::{Attribute, AttributeValues, Contents, Note, ScanEntry};
pub use encoding::{TextEncoding, as_utf8};
pub use error::{FormatError, IoError};
pub use file::{CloudFile, format_names};
pub use npy::Array;
pub use npz_writer::NpzWriter;
pub use options::{ColumnName, OptionError, PointColumns, PointLayout, ReadOptions, ReadSwitch};
pub use outgoing::{Kept, Outgoing, WhyDouble};
#[cfg(feature = "parquet")]
pub use parquet::check_parquet;
pub use room::{Room, check_format, check_moved_points};
pub use taken::Taken;
pub use text::parse_point;

/// A file format for clouds.
pub trait CloudFormat: Sync {
    /// Its name, in lower case.
    fn name(&self) -> &'static str;

    /// Extensions of its files, in lower case and without the dot.
    fn extensions(&self) -> &[&'static str];

    /// Whether `bytes` begin as a file of this format does. The formats are asked in the order of
    /// [`FORMATS`].
    fn recognises(&self, bytes: &[u8]) -> bool;

    /// What the bytes of a file hold. Without [`ReadOptions::scan`] the points of all its scans, in one frame.
    ///
    /// # Errors
    /// [`FormatError`] where the bytes are not of this format, end too early, can be read in several ways of which
    /// `options` name none, or take more memory than they allow.
    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError>;

    /// Whether a file may hold several scans. The formats for which it may obey [`ReadOptions::scan`].
    fn holds_scans(&self) -> bool {
        false
    }

    /// The options that say something to this format, beside the number of a [scan](Self::holds_scans). Others are refused.
    fn takes(&self) -> &'static [ReadSwitch] {
        &[]
    }

    /// The scans of a file, in its order; one where the format knows no more.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    fn scans(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<ScanEntry>, FormatError> {
        let points = self.read(bytes, options)?.points.len() as u64;
        Ok(vec![ScanEntry { name: String::new(), points, pose: None }])
    }

    /// What the points of [`read`](Self::read) have besides their place, in the order of the file.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        let _ = (bytes, options);
        Ok(Vec::new())
    }

    /// Names of what the points have besides, and what is no [attribute](Self::attributes), such as words and lists.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    fn left_out(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<String>, FormatError> {
        let _ = (bytes, options);
        Ok(Vec::new())
    }

    /// As [`rewrite`](Self::rewrite), of a file of another format whose records this one holds as they are; `None` for
    /// any other.
    fn rewrite_from(
        &self,
        format: &str,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
    ) -> Option<std::io::Result<Vec<u8>>> {
        let _ = (format, bytes, options, motion);
        None
    }

    /// What a moved copy of a file lacks although it is of the same format, or of a [twin](Self::rewrite_from) of it.
    fn lost_in_copies(&self, bytes: &[u8]) -> Vec<String> {
        let _ = bytes;
        Vec::new()
    }

    /// Whether a file of this content is what the readers of files with this extension expect; one that is not is
    /// written anew and not copied.
    fn conforms(&self, bytes: &[u8], extension: &str) -> bool {
        let _ = (bytes, extension);
        true
    }

    /// Whether [`write_cloud`](Self::write_cloud) keeps an attribute of this cloud.
    fn keeps(&self, attribute: &Attribute, cloud: &Outgoing<'_>) -> bool {
        let _ = (attribute, cloud);
        false
    }

    /// Whether coordinates may be in single or in double precision.
    fn has_both_precisions(&self) -> bool {
        false
    }

    /// What clouds [`write_cloud`](Self::write_cloud) can write.
    fn room(&self) -> Room {
        Room::Anything
    }

    /// Checks points of a format that has [room for some](Room::SomePoints).
    ///
    /// # Errors
    /// [`FormatError::Unwritable`].
    fn check_points(&self, points: &[[f64; 3]]) -> Result<(), FormatError> {
        let _ = points;
        Ok(())
    }

    /// What moved points a copy of a file of the format `from` can hold, by [`rewrite`](Self::rewrite) or
    /// [`rewrite_from`](Self::rewrite_from); `None` for the formats of which only the cloud is written anew.
    ///
    /// # Errors
    /// [`FormatError::Unwritable`] for a file that cannot be copied with a motion.
    fn check_rewrite(
        &self,
        from: &str,
        bytes: &[u8],
        options: &ReadOptions,
    ) -> Option<Result<Room, FormatError>> {
        let _ = (bytes, options);
        (from == self.name()).then_some(Ok(Room::Anything))
    }

    /// Writes a cloud in the precision that it asks for, with the attributes that the format [keeps](Self::keeps).
    ///
    /// # Errors
    /// Those of `out`; [`FormatError::Unwritable`] inside where the format cannot hold the points.
    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> std::io::Result<()>;

    /// Writes the file in `bytes` anew with its points moved by `motion` and its normals turned,
    /// and all else as it is; `options` say which numbers are the points, as for [`read`](Self::read). Points with NaN
    /// or infinite coordinates stay where they are.
    ///
    /// # Errors
    /// Those of `out`; inside them a [`FormatError`], of `bytes` or as for [`write_cloud`](Self::write_cloud).
    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> std::io::Result<()>;
}

/// All formats, the one that recognises almost anything last.
pub static FORMATS: &[&dyn CloudFormat] = &[
    &ply::Ply,
    &pcd::Pcd,
    &npy::Npy,
    &npz::Npz,
    &off::Off,
    &obj::Obj,
    &stl::Stl,
    &bin::Kitti,
    #[cfg(feature = "las")]
    &las::LAS,
    #[cfg(feature = "las")]
    &las::LAZ,
    #[cfg(feature = "e57")]
    &e57::E57,
    #[cfg(feature = "gltf")]
    &gltf::GLB,
    #[cfg(feature = "gltf")]
    &gltf::GLTF,
    #[cfg(feature = "mcap")]
    &mcap::Mcap,
    #[cfg(feature = "parquet")]
    &parquet::Parquet,
    &vtk::Vtk,
    &vtk::VTP,
    &vtk::VTU,
    &vtk::VTS,
    &ptx::Ptx,
    &pts::Pts,
    &text::Text,
];

/// Reads the cloud in a file, of the format that its extension or its content says. Only the points
/// are read, in double precision; normals, colours and faces are passed over.
///
/// # Errors
/// [`IoError`], which names the file; among others [`IoError::NotFinite`] where there are NaN or
/// infinite coordinates ([`read_cloud_dropping_nan`] leaves those points out).
pub fn read_cloud(path: &Path) -> Result<PointCloud, IoError> {
    CloudFile::open(path)?.cloud()
}

/// As [`read_cloud`], but leaves out the points with NaN or infinite coordinates and says how many
/// they were.
///
/// # Errors
/// [`IoError`]; also where no point is left.
pub fn read_cloud_dropping_nan(path: &Path) -> Result<(PointCloud, usize), IoError> {
    CloudFile::open(path)?.cloud_dropping_nan()
}

/// Writes a cloud in the format that the extension of `path` says, in double precision. The file
/// appears whole or not at all.
///
/// # Errors
/// [`IoError::UnknownFormat`], [`IoError::LeftOut`], [`IoError::Write`].
pub fn write_cloud(path: &Path, cloud: &PointCloud) -> Result<(), IoError> {
    write_outgoing(path, &Outgoing::of_points(cloud.points())).map(drop)
}

/// Writes a cloud with its attributes in the format that the extension of `path` says, and says what of it that format
/// has no room for. Where single precision is asked for and would move points by more than a millionth of the cloud's
/// size, it is double, and said. The file appears whole or not at all.
///
/// # Errors
/// As [`write_cloud`].
pub fn write_outgoing(path: &Path, cloud: &Outgoing<'_>) -> Result<Kept, IoError> {
    let format = choice::format_of(path)?;
    let extension = choice::extension_of(path);
    let (cloud, kept) = outgoing::fitted(format, &Outgoing { extension: &extension, ..*cloud });
    write_atomically(path, |out| format.write_cloud(&cloud, out))
        .map_err(|source| IoError::Write { path: path.to_owned(), source })?;
    Ok(kept)
}

/// Writes a cloud to a stream in the format of this name or extension (such as `ply`).
///
/// # Errors
/// As [`write_cloud`]; the stream is called `-`.
pub fn write_cloud_to(out: &mut dyn Write, format: &str, cloud: &PointCloud) -> Result<(), IoError> {
    write_outgoing_to(out, format, &Outgoing::of_points(cloud.points())).map(drop)
}

/// As [`write_outgoing`], to a stream in the format of this name or extension.
///
/// # Errors
/// As [`write_cloud`]; the stream is called `-`.
pub fn write_outgoing_to(out: &mut dyn Write, format: &str, cloud: &Outgoing<'_>) -> Result<Kept, IoError> {
    let extension = format.to_ascii_lowercase();
    let format = choice::named(format)?;
    let (cloud, kept) = outgoing::fitted(format, &Outgoing { extension: &extension, ..*cloud });
    let written = format.write_cloud(&cloud, out).and_then(|()| out.flush());
    written.map(|()| kept).map_err(|source| IoError::Write { path: "-".into(), source })
}

/// Reads the file `input`, moves its points by `motion`, turns its normals and writes `output`: with
/// all else unchanged if both are of one format ([`CloudFormat::rewrite`]), otherwise with the attributes
/// that the other format has room for. The file appears whole or not at all; it may replace `input`.
///
/// # Errors
/// [`IoError`], which names the file.
pub fn write_transformed(input: &Path, output: &Path, motion: &Rigid) -> Result<Kept, IoError> {
    CloudFile::open(input)?.write_transformed(output, motion)
}

/// Whether the extension of `path` is that of a known format.
pub fn is_cloud_file(path: &Path) -> bool {
    choice::format_of(path).is_ok()
}

#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
