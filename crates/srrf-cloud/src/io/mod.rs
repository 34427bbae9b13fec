//! Clouds in files: PLY, XYZ/TXT/CSV/PTS text, NPY and OFF, chosen by extension.
//!
//! Each format is one file here and one line in [`FORMATS`].

use std::fs;
use std::path::Path;

use crate::{CloudError, PointCloud};

mod atomic;
mod error;
mod npy;
pub(crate) mod off;
mod ply;
mod text;

pub use atomic::write_atomically;
pub use error::{FormatError, IoError};
pub(crate) use text::parse_point;

/// A file format for clouds.
pub trait CloudFormat: Sync {
    /// Extensions of its files, in lower case and without the dot.
    fn extensions(&self) -> &[&'static str];

    /// The points in the bytes of a file, in the order of the file; shape `[n, 3]`, any numbers.
    ///
    /// # Errors
    /// [`FormatError`] where the bytes are not of this format, or end too early.
    fn read(&self, bytes: &[u8]) -> Result<Vec<[f64; 3]>, FormatError>;

    /// Writes the points, without loss.
    ///
    /// # Errors
    /// Those of `out`.
    fn write(&self, points: &[[f64; 3]], out: &mut dyn std::io::Write) -> std::io::Result<()>;
}

/// All formats.
pub static FORMATS: &[&dyn CloudFormat] = &[&ply::Ply, &text::Text, &npy::Npy, &off::Off];

/// Reads the cloud in a file, of the format that its extension says. Only the points are read, in
/// double precision; normals, colours and faces are passed over.
///
/// # Errors
/// [`IoError`], which names the file; among others [`IoError::NotFinite`] where there are NaN or
/// infinite coordinates ([`read_cloud_dropping_nan`] leaves those points out).
pub fn read_cloud(path: &Path) -> Result<PointCloud, IoError> {
    let points = read_points(path)?;
    let bad = |p: &[f64; 3]| !p.iter().all(|c| c.is_finite());
    if let Some(first) = points.iter().position(bad) {
        let count = points.iter().filter(|p| bad(p)).count();
        return Err(IoError::NotFinite { path: path.to_owned(), count, total: points.len(), first });
    }
    PointCloud::new(points).map_err(|source| IoError::Cloud { path: path.to_owned(), source })
}

/// As [`read_cloud`], but leaves out the points with NaN or infinite coordinates and says how many
/// they were.
///
/// # Errors
/// [`IoError`]; also where no point is left.
pub fn read_cloud_dropping_nan(path: &Path) -> Result<(PointCloud, usize), IoError> {
    let mut points = read_points(path)?;
    let before = points.len();
    points.retain(|p| p.iter().all(|c| c.is_finite()));
    let dropped = before - points.len();
    let cloud = PointCloud::new(points).map_err(|source| IoError::Cloud { path: path.to_owned(), source })?;
    Ok((cloud, dropped))
}

/// Writes a cloud in the format that the extension of `path` says, in double precision. The file
/// appears whole or not at all.
///
/// # Errors
/// [`IoError::UnknownFormat`], [`IoError::Write`].
pub fn write_cloud(path: &Path, cloud: &PointCloud) -> Result<(), IoError> {
    let format = format_of(path)?;
    write_atomically(path, |out| format.write(cloud.points(), out))
        .map_err(|source| IoError::Write { path: path.to_owned(), source })
}

/// Whether the extension of `path` is that of a known format.
pub fn is_cloud_file(path: &Path) -> bool {
    format_of(path).is_ok()
}

fn read_points(path: &Path) -> Result<Vec<[f64; 3]>, IoError> {
    let format = format_of(path)?;
    let bytes = fs::read(path).map_err(|source| IoError::Read { path: path.to_owned(), source })?;
    let points = format.read(&bytes).map_err(|source| IoError::Format { path: path.to_owned(), source })?;
    if points.is_empty() {
        return Err(IoError::Cloud { path: path.to_owned(), source: CloudError::Empty });
    }
    Ok(points)
}

fn format_of(path: &Path) -> Result<&'static dyn CloudFormat, IoError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    FORMATS.iter().copied().find(|f| f.extensions().contains(&extension.as_str())).ok_or_else(|| {
        let known: Vec<&str> = FORMATS.iter().flat_map(|f| f.extensions()).copied().collect();
        IoError::UnknownFormat { path: path.to_owned(), known: known.join(", ") }
    })
}

#[cfg(test)]
mod tests;
