//! [`NpzWriter`]: writes NumPy's `.npz` archives.

use std::cell::Cell;
use std::io::{self, BufWriter, Write};
use std::rc::Rc;

use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, StreamWriter};

use super::npy::Array;

/// Writes a `.npz` file array by array; the same arrays give the same bytes.
pub struct NpzWriter<W: Write> {
    zip: zip::ZipWriter<StreamWriter<Fallible<W>>>,
    error: Rc<Cell<Option<io::Error>>>,
}

impl<W: Write> NpzWriter<W> {
    /// Starts an archive.
    pub fn new(stream: W) -> Self {
        let error = Rc::new(Cell::new(None));
        let stream = Fallible { stream, error: error.clone(), failed: false };
        Self { zip: zip::ZipWriter::new_stream(stream), error }
    }

    /// Adds an array of `f64`, uncompressed as `numpy.savez` does.
    ///
    /// # Errors
    /// Those of the stream.
    pub fn array(&mut self, name: &str, shape: &[usize], values: &[f64]) -> io::Result<()> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(values.len() > (u32::MAX / 16) as usize);
        self.zip.start_file(format!("{name}.npy"), options)?;
        let mut buffered = BufWriter::new(&mut self.zip);
        Array::write(shape, values, &mut buffered)?;
        buffered.flush()?;
        drop(buffered);
        self.error.take().map_or(Ok(()), Err)
    }

    /// Ends the archive.
    ///
    /// # Errors
    /// Those of the stream, now or before.
    pub fn finish(self) -> io::Result<W> {
        let mut stream = self.zip.finish()?.into_inner();
        stream.flush()?;
        if stream.failed {
            let told_before = || io::Error::other("the archive is incomplete");
            return Err(self.error.take().unwrap_or_else(told_before));
        }
        Ok(stream.stream)
    }
}

/// A stream that keeps its first error aside and swallows what follows. The zip library prints
/// what goes wrong when it is dropped; so it must not see it.
struct Fallible<W> {
    stream: W,
    error: Rc<Cell<Option<io::Error>>>,
    failed: bool,
}

impl<W> Fallible<W> {
    fn fail(&mut self, error: io::Error) {
        self.failed = true;
        self.error.set(Some(error));
    }
}

impl<W: Write> Write for Fallible<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if !self.failed {
            match self.stream.write(bytes) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => return Err(error),
                Err(error) => self.fail(error),
                Ok(0) if !bytes.is_empty() => self.fail(io::ErrorKind::WriteZero.into()),
                Ok(written) => return Ok(written),
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if !self.failed
            && let Err(error) = self.stream.flush()
        {
            self.fail(error);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::{ReadOptions, read_npz};

    #[test]
    fn archives_have_stable_bytes() {
        let write = || {
            let mut npz = NpzWriter::new(Vec::new());
            npz.array("a_x", &[1, 2, 3], &[1.0; 6]).unwrap();
            npz.array("a_t", &[1, 3], &[2.0; 3]).unwrap();
            npz.finish().unwrap()
        };
        assert_eq!(write(), write());
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), write()).unwrap();
        let npz = read_npz(file.path(), &ReadOptions::default()).unwrap();
        assert_eq!(npz.names, ["a_x", "a_t"]);
        assert_eq!(npz.arrays["a_x"].shape, [1, 2, 3]);
        std::fs::write(file.path(), "text").unwrap();
        assert!(
            read_npz(file.path(), &ReadOptions::default())
                .unwrap_err()
                .to_string()
                .contains("not an .npz archive")
        );
    }

    #[test]
    fn a_full_stream_is_one_error() {
        let mut room = [0; 500];
        let mut npz = NpzWriter::new(&mut room[..]);
        npz.array("a", &[2], &[1.0; 2]).unwrap();
        let error = npz.array("b", &[1000], &[1.0; 1000]).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::WriteZero);
        assert!(npz.finish().is_err(), "a cut archive is never called finished");
    }
}
