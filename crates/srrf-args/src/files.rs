//! Clouds and results in files and streams; `-` is standard input or output.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

use srrf_cloud::io::{
    CloudFile, Contents, IoError, Kept, Note, Outgoing, ReadOptions, as_utf8, check_format,
    check_moved_points, read_file, write_atomically, write_outgoing, write_outgoing_to,
};
use srrf_cloud::{CloudError, PointCloud, Rigid, Solid};

use crate::failure::Failure;
use crate::interrupt;

/// A cloud with the file that it came from.
#[derive(Debug)]
pub struct Input {
    /// The path, or `-`.
    pub name: String,
    /// The file.
    pub file: CloudFile,
    /// Its points that are finite.
    pub cloud: PointCloud,
    /// Points left out because a coordinate is NaN or infinite.
    pub dropped: usize,
    /// Triangles of a mesh, as indices of the points of `cloud`; empty for clouds.
    pub faces: Vec<[u32; 3]>,
    /// Whether the file holds its coordinates in single precision.
    pub single: bool,
    /// Where the scanner stood, where the file says it.
    pub viewpoint: Option<[f64; 3]>,
    /// Width and height of an organised file, the points counted that were left out.
    pub grid: Option<[usize; 2]>,
    /// What a user should know of the reading.
    pub notes: Vec<Note>,
    /// Faces of the file that were left out, because a corner is NaN or infinite.
    pub lost_faces: usize,
    /// Which points of the file are in `cloud`, in their order; all of them where there is none.
    pub kept: Option<Vec<bool>>,
}

/// Whether a path stands for standard input or output.
pub fn is_stream(path: &Path) -> bool {
    path == Path::new("-")
}

/// Reads a cloud. `format` is for streams; `options` are for files that do not say how they are read.
///
/// # Errors
/// [`Failure::usage`], which names the file.
pub fn read(path: &Path, format: Option<&str>, options: ReadOptions) -> Result<Input, Failure> {
    let file = match (is_stream(path), format) {
        (true, format) => CloudFile::from_reader_with(&mut io::stdin().lock(), format, options)?,
        (false, None) => CloudFile::open_with(path, options)?,
        (false, Some(format)) => {
            return Err(Failure::usage(format!(
                "{path:?} is a file, whose name or content says its format; `{format}` can be asked for streams only"
            )));
        }
    };
    let name = path.display().to_string();
    let mut contents = file.contents()?;
    let grid = contents.grid;
    let (points, faces) = (contents.points.len(), contents.faces.len());
    let zero = if file.options().keep_zeros { None } else { contents.no_returns() };
    let kept: Vec<bool> = (0..points)
        .map(|i| {
            contents.points[i].iter().all(|c| c.is_finite()) && !zero.as_ref().is_some_and(|zero| zero[i])
        })
        .collect();
    let zeros = if zero.is_some() { contents.drop_no_returns() } else { 0 };
    let dropped = contents.drop_not_finite();
    let lost_faces = faces - contents.faces.len();
    let kept = (zeros + dropped > 0).then_some(kept);
    let Contents { points, faces, single, viewpoint, notes, .. } = contents;
    let cloud = PointCloud::new(points).map_err(|error| match error {
        CloudError::Empty if dropped == 0 => Failure::usage(format!(
            "{name:?}: each of its {zeros} points lies at exactly 0, 0, 0, which stands for \"no return\"; write the file \
             again with numbers, or keep them with --keep-zeros"
        )),
        CloudError::Empty if zeros > 0 => Failure::usage(format!(
            "{name:?}: each of its {} points is NaN, infinite, or at exactly 0, 0, 0, which stand for \"no return\"; write the \
             file again with numbers",
            zeros + dropped
        )),
        CloudError::Empty => Failure::usage(format!(
            "{name:?}: each of its {dropped} points has a coordinate that is NaN or infinite; write the file again with \
             numbers"
        )),
        other => Failure::cloud(&name, &other),
    })?;
    Ok(Input { name, file, cloud, dropped, faces, single, viewpoint, grid, notes, lost_faces, kept })
}

/// As [`read`], of a cloud that determines a rotation.
///
/// # Errors
/// As [`read`]; also for fewer than three points and for points on one line.
pub fn read_solid(path: &Path, format: Option<&str>, options: ReadOptions) -> Result<Input, Failure> {
    let input = read(path, format, options)?;
    Solid::new(&input.cloud).map_err(|e| Failure::cloud(&input.name, &e))?;
    Ok(input)
}

/// All bytes of a file of another kind, as far as `options` let it take memory. `should` says what it is there for, such as
/// `it should be results of a batch`.
///
/// # Errors
/// [`Failure::usage`], which names the file.
pub fn read_bytes(path: &Path, options: &ReadOptions, should: &str) -> Result<Vec<u8>, Failure> {
    read_file(path, options).map_err(|error| match error {
        IoError::Read { source, .. } => {
            Failure::usage(format!("cannot read {path:?}: {source}; {should}")).because(source)
        }
        other => other.into(),
    })
}

/// As [`read_bytes`], of text, which may be in UTF-16 or UTF-32.
///
/// # Errors
/// As [`read_bytes`]; also where it is not UTF-8.
pub fn read_text(path: &Path, options: &ReadOptions, should: &str) -> Result<String, Failure> {
    let bytes = read_bytes(path, options, should)?;
    let text = as_utf8(&bytes)
        .map_err(|e| Failure::usage(format!("cannot read {path:?}: {e}; {should}")).because(e))?;
    String::from_utf8(text.into_owned())
        .map_err(|_| Failure::usage(format!("cannot read {path:?}: it is no text in UTF-8; {should}")))
}

/// Checks, before any work is done, that there is a place for `path`.
///
/// # Errors
/// [`Failure::usage`] for a folder, or a file in a folder that does not exist or takes no files.
pub fn check_output(path: &Path) -> Result<(), Failure> {
    if is_stream(path) {
        return Ok(());
    }
    if path.is_dir() {
        return Err(Failure::usage(format!("cannot write {path:?}: it is a folder; name a file in it")));
    }
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(Failure::usage(format!(
            "cannot write {path:?}: the folder {folder:?} does not exist; create it first"
        )));
    }
    if is_special(path) {
        return Ok(());
    }
    tempfile::tempfile_in(folder).map(|_| ()).map_err(|e| {
        Failure::usage(format!(
            "cannot write {path:?}: no file can be made in {folder:?} ({e}); choose another place"
        ))
    })
}

/// Whether there is something at `path` that must not be replaced by a file, such as `/dev/null`.
pub fn is_special(path: &Path) -> bool {
    path.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// Writes a result, whole or not at all.
///
/// # Errors
/// [`Failure::failed`], which names the file.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let _guard = interrupt::hold();
    let written = if is_stream(path) {
        let mut out = io::stdout().lock();
        gone_is_fine(out.write_all(bytes).and_then(|()| out.flush()))
    } else if is_special(path) {
        File::create(path).and_then(|mut file| file.write_all(bytes))
    } else {
        write_atomically(path, |out| out.write_all(bytes))
    };
    written.map_err(|e| {
        Failure::failed(format!("cannot write {path:?}: {e}; choose another place for the output"))
    })
}

/// Writes a cloud; to a stream as PLY. Coordinates are in single precision where `original` holds them so and that is
/// enough.
///
/// # Errors
/// [`Failure`], which names the file.
pub fn write_points(path: &Path, cloud: &PointCloud, original: &Input) -> Result<Kept, Failure> {
    let _guard = interrupt::hold();
    let (single, before) = (original.single, original.cloud.points());
    let cloud = Outgoing { single, before, ..Outgoing::of_points(cloud.points()) };
    Ok(match () {
        () if is_stream(path) => write_outgoing_to(&mut io::stdout().lock(), "ply", &cloud),
        () if is_special(path) => {
            write_outgoing_to(&mut open(path)?, "ply", &cloud).map_err(|error| at_path(error, path))
        }
        () => write_outgoing(path, &cloud),
    }?)
}

/// Writes the points of a file that are read as a cloud, or the vertices of a mesh, multiplied by `factor` and then moved;
/// to a stream as PLY.
///
/// # Errors
/// [`Failure`], which names the file.
pub fn write_scaled(path: &Path, input: &Input, factor: f64, pose: &Rigid) -> Result<Kept, Failure> {
    let all = input.file.points()?;
    let is_kept = |index: usize| input.kept.as_ref().is_none_or(|kept| kept.get(index) == Some(&true));
    let kept =
        all.into_iter().enumerate().filter(|(index, _)| is_kept(*index)).map(|(_, point)| point).collect();
    let moved = PointCloud::new(kept)
        .and_then(|cloud| cloud.scaled(factor))
        .map_err(|error| Failure::cloud(&input.name, &error))?
        .transformed(pose);
    write_points(path, &moved, input)
}

/// Writes a moved copy of a file; to a stream in its own format.
///
/// # Errors
/// [`Failure`], which names the file.
pub fn write_moved(path: &Path, file: &CloudFile, pose: &Rigid) -> Result<Kept, Failure> {
    let _guard = interrupt::hold();
    Ok(match () {
        () if is_stream(path) => file.write_transformed_to(&mut io::stdout().lock(), None, pose),
        () if is_special(path) => {
            file.write_transformed_to(&mut open(path)?, None, pose).map_err(|error| at_path(error, path))
        }
        () => file.write_transformed(path, pose),
    }?)
}

/// Checks, before any work is done, that [`write_moved`] can write a copy of `file` that lies on the points of `target`
/// (which may be none).
///
/// # Errors
/// [`Failure::usage`], which names the file and what can be written instead.
pub fn check_moved(path: &Path, file: &CloudFile, target: &[[f64; 3]]) -> Result<(), Failure> {
    let own = is_stream(path) || is_special(path);
    let checked =
        if own { file.check_transformed_to(None, target) } else { file.check_transformed(path, target) };
    checked.map_err(Failure::input)
}

/// As [`check_moved`], of [`write_points`]: points that will lie on those of `target`, or points of which nothing is known
/// yet.
///
/// # Errors
/// As [`check_moved`].
pub fn check_points(path: &Path, points: Option<&[[f64; 3]]>, target: &[[f64; 3]]) -> Result<(), Failure> {
    if is_stream(path) || is_special(path) {
        return Ok(());
    }
    let checked = match points {
        Some(points) => check_moved_points(path, points, target),
        None => check_format(path),
    };
    checked.map_err(Failure::input)
}

/// An error of a stream, of the device that it is.
fn at_path(error: IoError, path: &Path) -> IoError {
    match error {
        IoError::Write { source, .. } => IoError::Write { path: path.to_owned(), source },
        other => other,
    }
}

fn open(path: &Path) -> Result<File, IoError> {
    File::create(path).map_err(|source| IoError::Write { path: path.to_owned(), source })
}

/// A reader that has gone away, as `head` does, is no failure.
fn gone_is_fine(written: io::Result<()>) -> io::Result<()> {
    match written {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_checked_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        assert!(check_output(&folder.path().join("a.txt")).is_ok());
        assert!(check_output(Path::new("-")).is_ok());
        let error = check_output(folder.path()).unwrap_err().to_string();
        assert!(error.contains("it is a folder"), "{error}");
        let error = check_output(&folder.path().join("none/a.txt")).unwrap_err().to_string();
        assert!(error.contains("does not exist; create it first"), "{error}");
    }

    #[test]
    fn other_files_are_read_as_far_as_they_may_take_memory() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("a.jsonl");
        std::fs::write(&place, [b'1', b'\n', 0xff]).unwrap();
        let limited = |bytes| ReadOptions { max_memory: Some(bytes), ..ReadOptions::default() };
        assert_eq!(read_bytes(&place, &limited(3), "it should be lines").unwrap(), [b'1', b'\n', 0xff]);
        let error = read_bytes(&place, &limited(2), "it should be lines").unwrap_err().to_string();
        assert!(error.contains("a.jsonl") && error.contains("--max-memory"), "{error}");
        let error = read_text(&place, &limited(3), "it should be lines").unwrap_err().to_string();
        assert!(error.contains("no text in UTF-8; it should be lines"), "{error}");
        let words: Vec<u8> = "\u{feff}two words".encode_utf16().flat_map(u16::to_le_bytes).collect();
        std::fs::write(&place, words).unwrap();
        assert_eq!(read_text(&place, &ReadOptions::default(), "it should be lines").unwrap(), "two words");
        let error = read_text(&folder.path().join("none"), &limited(3), "it should be lines");
        assert!(error.unwrap_err().to_string().ends_with("; it should be lines"));
    }

    #[cfg(unix)]
    #[test]
    fn devices_are_written_to_and_not_replaced() {
        let null = Path::new("/dev/null");
        write(null, b"x").unwrap();
        assert!(is_special(null));
        let folder = tempfile::tempdir().unwrap();
        let cloud = folder.path().join("a.xyz");
        std::fs::write(&cloud, "1 1 1\n").unwrap();
        let input = read(&cloud, None, ReadOptions::default()).unwrap();
        check_output(null).unwrap();
        write_points(null, &input.cloud, &input).unwrap();
        assert!(is_special(null));
    }
}
