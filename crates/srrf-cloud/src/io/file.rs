//! [`CloudFile`]: the bytes of a file or stream, and their format.

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use super::bytes::{in_utf8, read_file, read_within};
use super::choice::{detect, extension_of, format_of, named, scan_of};
use super::outgoing::{NORMALS, fitted};
use super::{
    Attribute, CloudFormat, Contents, FORMATS, FormatError, IoError, Note, PointLayout, ReadOptions,
    ReadSwitch, ScanEntry, Taken, TextEncoding, foreign,
};
use super::{Kept, Outgoing, write_atomically};
use crate::{CloudError, PointCloud, Rigid};

/// The names of all formats of this build, for help texts.
pub fn format_names() -> Vec<&'static str> {
    FORMATS.iter().map(|format| format.name()).collect()
}

/// A file or stream of a cloud: its bytes in memory, and their format.
pub struct CloudFile {
    path: PathBuf,
    bytes: Vec<u8>,
    format: &'static dyn CloudFormat,
    options: ReadOptions,
    /// What the text was in before it was made UTF-8.
    encoding: Option<TextEncoding>,
}

impl CloudFile {
    /// Reads the file at `path`. Its extension says the format, or where that is unknown or missing
    /// the content.
    ///
    /// # Errors
    /// [`IoError::Read`], [`IoError::UnknownFormat`], [`IoError::LeftOut`].
    pub fn open(path: &Path) -> Result<Self, IoError> {
        Self::open_with(path, ReadOptions::default())
    }

    /// As [`open`](Self::open), to be read with `options`. `file.ext#2` is scan 2 of `file.ext`, unless a file has
    /// that very name.
    ///
    /// # Errors
    /// As [`open`](Self::open); [`IoError::Format`] where the file is larger than the memory that it may take.
    pub fn open_with(path: &Path, mut options: ReadOptions) -> Result<Self, IoError> {
        let mut path = path;
        let parts = scan_of(path);
        if let Some((file, number)) = &parts {
            path = file;
            options.scan = Some(*number);
            options.shared.retain(|switch| *switch != ReadSwitch::Scan);
        }
        options.folder = path.parent().map(Path::to_owned);
        let known = format_of(path);
        if let Err(left_out @ IoError::LeftOut { .. }) = known {
            return Err(left_out);
        }
        let (bytes, encoding) = in_utf8(read_file(path, &options)?, path, &options)?;
        let format = match known {
            Ok(format) => format,
            Err(_) => detect(path, &bytes)?,
        };
        Taken::of(format).pass_over(&mut options);
        // nuScenes names its sweeps so, and their points are always five numbers.
        let sweep = path.to_string_lossy().to_ascii_lowercase().ends_with(".pcd.bin");
        if sweep && options.layout.is_none() && bytes.len().is_multiple_of(PointLayout::NUSCENES.bytes()) {
            options.layout = Some(PointLayout::NUSCENES);
        }
        Ok(Self { path: path.to_owned(), bytes, format, options, encoding })
    }

    /// Reads a stream to its end. `format` is the name or an extension of its format; without it the
    /// content says it. Errors call the stream `-`.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn from_reader(reader: &mut dyn Read, format: Option<&str>) -> Result<Self, IoError> {
        Self::from_reader_with(reader, format, ReadOptions::default())
    }

    /// As [`from_reader`](Self::from_reader), to be read with `options`.
    ///
    /// # Errors
    /// As [`open_with`](Self::open_with).
    pub fn from_reader_with(
        reader: &mut dyn Read,
        format: Option<&str>,
        mut options: ReadOptions,
    ) -> Result<Self, IoError> {
        if format == Some("kitti") {
            options.layout = options.layout.or(Some(PointLayout::KITTI));
        }
        let format = format.map(named).transpose()?;
        let path = PathBuf::from("-");
        let (bytes, encoding) = in_utf8(read_within(reader, 0, &path, &options)?, &path, &options)?;
        let format = match format {
            Some(format) => format,
            None => detect(&path, &bytes)?,
        };
        Taken::of(format).pass_over(&mut options);
        Ok(Self { path, bytes, format, options, encoding })
    }

    /// The name of the format.
    pub fn format(&self) -> &'static str {
        self.format.name()
    }

    pub(super) fn known_format(&self) -> &'static dyn CloudFormat {
        self.format
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The path, or `-` for a stream.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the file is read with.
    pub fn options(&self) -> &ReadOptions {
        &self.options
    }

    /// All that the file holds; one point at least.
    ///
    /// # Errors
    /// [`IoError::Format`], [`IoError::OtherFormat`], and [`IoError::Cloud`] where there are no points.
    pub fn contents(&self) -> Result<Contents, IoError> {
        let empty = || IoError::Cloud { path: self.path.clone(), source: CloudError::Empty };
        if self.bytes.is_empty() {
            return Err(empty());
        }
        let mut contents = self.read().map_err(|source| self.error(source))?;
        contents.notes.extend(self.encoding.map(|encoding| Note::Decoded { encoding }));
        if contents.points.is_empty() { Err(empty()) } else { Ok(contents) }
    }

    /// All points, in the order of the file; shape `[n, 3]`, n > 0, any numbers.
    ///
    /// # Errors
    /// As [`contents`](Self::contents).
    pub fn points(&self) -> Result<Vec<[f64; 3]>, IoError> {
        Ok(self.contents()?.points)
    }

    /// Whether files of this format may hold several scans.
    pub fn holds_scans(&self) -> bool {
        self.format.holds_scans()
    }

    /// The scans of the file, one or more; whichever of them the options name.
    ///
    /// # Errors
    /// As [`contents`](Self::contents).
    pub fn scans(&self) -> Result<Vec<ScanEntry>, IoError> {
        let scans = self.check_options().and_then(|()| self.format.scans(&self.bytes, &self.options));
        scans.map_err(|source| self.error(source))
    }

    /// What the points have besides their place.
    ///
    /// # Errors
    /// As [`contents`](Self::contents).
    pub fn attributes(&self) -> Result<Vec<Attribute>, IoError> {
        self.format.attributes(&self.bytes, &self.options).map_err(|source| self.error(source))
    }

    pub(super) fn read(&self) -> Result<Contents, FormatError> {
        self.check_options()?;
        self.format.read(&self.bytes, &self.options)
    }

    /// The options that say something to the format.
    pub fn taken(&self) -> Taken {
        Taken::of(self.format)
    }

    fn check_options(&self) -> Result<(), FormatError> {
        self.taken().check(&self.options)
    }

    /// The cloud.
    ///
    /// # Errors
    /// As [`points`](Self::points); [`IoError::NotFinite`] where there are NaN or infinite
    /// coordinates.
    pub fn cloud(&self) -> Result<PointCloud, IoError> {
        let points = self.points()?;
        let bad = |p: &[f64; 3]| !p.iter().all(|c| c.is_finite());
        if let Some(first) = points.iter().position(bad) {
            let count = points.iter().filter(|p| bad(p)).count();
            return Err(IoError::NotFinite { path: self.path.clone(), count, total: points.len(), first });
        }
        self.checked(points)
    }

    /// The cloud without the points that have NaN or infinite coordinates, and how many they were.
    ///
    /// # Errors
    /// As [`points`](Self::points); [`IoError::Cloud`] also where no point is left.
    pub fn cloud_dropping_nan(&self) -> Result<(PointCloud, usize), IoError> {
        let mut points = self.points()?;
        let before = points.len();
        points.retain(|p| p.iter().all(|c| c.is_finite()));
        let dropped = before - points.len();
        Ok((self.checked(points)?, dropped))
    }

    /// Writes `output` with the points moved by `motion` and the normals turned: with all else
    /// unchanged if its extension says the same format, otherwise with the attributes that the other
    /// format has room for. The file appears whole or not at all.
    ///
    /// # Errors
    /// [`IoError`], which names the file.
    pub fn write_transformed(&self, output: &Path, motion: &Rigid) -> Result<Kept, IoError> {
        let format = format_of(output)?;
        let mut kept = Kept::default();
        let written = write_atomically(output, |out| {
            kept = self.put_transformed(format, &extension_of(output), motion, out)?;
            Ok(())
        });
        written.map(|()| kept).map_err(|source| self.write_error(output, source))
    }

    /// As [`write_transformed`](Self::write_transformed), to a stream. `format` is the name or an
    /// extension of its format; without it the copy has the same one.
    ///
    /// # Errors
    /// [`IoError`]; errors call the stream `-`.
    pub fn write_transformed_to(
        &self,
        out: &mut dyn Write,
        format: Option<&str>,
        motion: &Rigid,
    ) -> Result<Kept, IoError> {
        let extension = format.unwrap_or_default().to_ascii_lowercase();
        let format = format.map_or(Ok(self.format), named)?;
        let written =
            self.put_transformed(format, &extension, motion, out).and_then(|kept| out.flush().map(|()| kept));
        written.map_err(|source| self.write_error(Path::new("-"), source))
    }

    fn put_transformed(
        &self,
        format: &'static dyn CloudFormat,
        extension: &str,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<Kept> {
        self.check_options()?;
        if format.name() == self.format.name() && format.conforms(&self.bytes, extension) {
            return self.rewrite(extension, motion, out);
        }
        if let Some(copy) = format.rewrite_from(self.format.name(), &self.bytes, &self.options, motion) {
            out.write_all(&copy?)?;
            return Ok(Kept { lost: format.lost_in_copies(&self.bytes), ..Kept::default() });
        }
        let contents = self.read()?;
        let mut attributes = self.format.attributes(&self.bytes, &self.options)?;
        turn_normals(&mut attributes, motion);
        name_apart(&mut attributes);
        let points: Vec<[f64; 3]> =
            contents.points.iter().map(|&point| super::scan::moved(motion, point)).collect();
        // A text has no type; single precision is enough for it where that has the same decimals.
        let of_text = |points: &[[f64; 3]]| points.iter().flatten().all(|&c| super::text::fits_single(c));
        let single = contents.single
            || (self.format.name() == "xyz" && format.has_both_precisions() && of_text(&contents.points));
        let before = &contents.points;
        let cloud = Outgoing { points: &points, single, before, attributes: &attributes, extension };
        let (cloud, mut kept) = fitted(format, &cloud);
        format.write_cloud(&cloud, out)?;
        kept.lost.extend(self.format.left_out(&self.bytes, &self.options)?);
        if !contents.faces.is_empty() {
            kept.lost.push("faces".into());
        }
        Ok(kept)
    }

    /// A copy in the format of the file.
    fn rewrite(&self, extension: &str, motion: &Rigid, out: &mut dyn Write) -> io::Result<Kept> {
        self.format.rewrite(&self.bytes, &self.options, motion, out)?;
        if *motion == Rigid::identity() {
            return Ok(Kept::default());
        }
        if !self.format.has_both_precisions() {
            return Ok(Kept { lost: self.format.lost_in_copies(&self.bytes), ..Kept::default() });
        }
        let contents = self.read()?;
        let points: Vec<[f64; 3]> =
            contents.points.iter().map(|&point| super::scan::moved(motion, point)).collect();
        let before = &contents.points;
        let cloud = Outgoing { single: contents.single, before, extension, ..Outgoing::of_points(&points) };
        Ok(fitted(self.format, &cloud).1)
    }

    fn checked(&self, points: Vec<[f64; 3]>) -> Result<PointCloud, IoError> {
        PointCloud::new(points).map_err(|source| IoError::Cloud { path: self.path.clone(), source })
    }

    /// What is wrong with the content, or that it is of another format altogether.
    fn error(&self, source: FormatError) -> IoError {
        let path = self.path.clone();
        if let Some(what) = foreign::name(&self.bytes).filter(|_| !self.format.recognises(&self.bytes)) {
            return IoError::Foreign { path, what };
        }
        let found = FORMATS.iter().find(|format| format.recognises(&self.bytes)).map(|format| format.name());
        match found {
            _ if matches!(source, FormatError::Memory { .. } | FormatError::Unclear { .. }) => {
                IoError::Format { path, source }
            }
            Some(found) if found != self.format.name() => {
                IoError::OtherFormat { path, asked: self.format.name(), found, source }
            }
            _ => IoError::Format { path, source },
        }
    }

    /// Tells errors of the content from those of writing.
    pub(super) fn write_error(&self, output: &Path, source: io::Error) -> IoError {
        match source.downcast::<FormatError>() {
            Ok(source @ FormatError::Unwritable(_)) => {
                IoError::Write { path: output.to_owned(), source: source.into() }
            }
            Ok(source) => self.error(source),
            Err(source) => IoError::Write { path: output.to_owned(), source },
        }
    }
}

impl std::fmt::Debug for CloudFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let bytes = self.bytes.len();
        f.debug_struct("CloudFile")
            .field("path", &self.path)
            .field("format", &self.format())
            .field("bytes", &bytes)
            .finish()
    }
}

/// Turns the attributes that are normals.
fn turn_normals(attributes: &mut [Attribute], motion: &Rigid) {
    let place = |name: &str| attributes.iter().position(|attribute| attribute.name == name);
    let [Some(x), Some(y), Some(z)] = NORMALS.map(place) else { return };
    let count = attributes[x].values.len();
    let mut turned: [Vec<f64>; 3] = std::array::from_fn(|_| Vec::with_capacity(count));
    for point in 0..count {
        let normal = [x, y, z].map(|axis| attributes[axis].values.get(point).unwrap_or(f64::NAN));
        let new = super::scan::turned(motion, normal);
        turned.iter_mut().zip(new).for_each(|(list, value)| list.push(value));
    }
    for (axis, values) in [x, y, z].into_iter().zip(turned) {
        let kind = attributes[axis].values.scalar().for_turned();
        attributes[axis].values = kind.of_numbers(&values);
    }
}

/// Gives attributes that have the name of a coordinate or of another one a name of their own: formats of named columns
/// have each name once.
fn name_apart(attributes: &mut [Attribute]) {
    let mut taken: Vec<String> = ["x", "y", "z"].map(str::to_owned).to_vec();
    for attribute in attributes {
        let name = attribute.name.clone();
        let mut number = 2;
        while taken.contains(&attribute.name.to_ascii_lowercase()) {
            attribute.name = format!("{name}_{number}");
            number += 1;
        }
        taken.push(attribute.name.to_ascii_lowercase());
    }
}
