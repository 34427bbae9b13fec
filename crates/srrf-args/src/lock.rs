//! [`OutputLock`]: one process at a time writes an output that grows, such as the results of a batch.

use std::fs::{self, File, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::files::{is_special, is_stream};
use crate::interrupt;

/// How often a lock is looked for that another process has just removed.
const TRIES: usize = 16;

/// Held while a process writes an output: a locked file `.NAME.lock` beside it, which holds the number of the process. The
/// lock goes with the process, however that ends: a file that a killed one left is taken over.
#[derive(Debug)]
pub struct OutputLock {
    path: PathBuf,
    /// Locked as long as it is open.
    _file: File,
}

impl OutputLock {
    /// Takes the lock of `output`; none for streams and devices, which take any number of writers.
    ///
    /// # Errors
    /// [`Failure::usage`] where another process holds it; [`Failure::failed`] where there can be none.
    pub fn take(output: &Path) -> Result<Option<Self>, Failure> {
        if is_stream(output) || is_special(output) {
            return Ok(None);
        }
        let name = output.file_name().unwrap_or_default().to_string_lossy();
        let path = output.with_file_name(format!(".{name}.lock"));
        let failed = |e: std::io::Error| {
            Failure::failed(format!("cannot lock {output:?} with {path:?}: {e}; choose another place"))
                .because(e)
        };
        for _ in 0..TRIES {
            let mut options = File::options();
            let mut file =
                options.create(true).read(true).write(true).truncate(false).open(&path).map_err(failed)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Err(busy(output, &mut file)),
                // Where the file system has no locks, the place is as good as it was before there were any.
                Err(TryLockError::Error(e)) if e.kind() == std::io::ErrorKind::Unsupported => {}
                Err(TryLockError::Error(e)) => return Err(failed(e)),
            }
            // The one before may have removed the file between opening and locking.
            if !still_there(&path, &file) {
                continue;
            }
            let note = std::process::id().to_string();
            let noted = file.set_len(0).and_then(|()| file.seek(SeekFrom::Start(0)));
            noted.and_then(|_| file.write_all(note.as_bytes())).map_err(failed)?;
            interrupt::removes(path.clone());
            return Ok(Some(Self { path, _file: file }));
        }
        Err(failed(std::io::Error::other("it comes and goes")))
    }
}

impl Drop for OutputLock {
    fn drop(&mut self) {
        // Still locked: nobody else writes in it.
        let _ = fs::remove_file(&self.path);
        interrupt::keeps(&self.path);
    }
}

fn busy(output: &Path, file: &mut File) -> Failure {
    let mut process = String::new();
    let _ = file.take(32).read_to_string(&mut process);
    let process: String = process.chars().filter(char::is_ascii_digit).collect();
    let who = if process.is_empty() { "another process".into() } else { format!("process {process}") };
    Failure::usage(format!(
        "cannot write {output:?}: {who} is writing it; wait for that one, or choose another place"
    ))
}

#[cfg(unix)]
fn still_there(path: &Path, file: &File) -> bool {
    use std::os::unix::fs::MetadataExt;
    let number = |m: fs::Metadata| (m.dev(), m.ino());
    match (fs::metadata(path), file.metadata()) {
        (Ok(there), Ok(here)) => number(there) == number(here),
        _ => false,
    }
}

/// An open file cannot be removed.
#[cfg(not(unix))]
fn still_there(path: &Path, _: &File) -> bool {
    path.exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_at_a_time_and_a_stale_one_is_taken_over() {
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("r.jsonl");
        let lock = folder.path().join(".r.jsonl.lock");
        let first = OutputLock::take(&output).unwrap();
        let message = OutputLock::take(&output).unwrap_err().to_string();
        assert!(message.contains(&format!("process {} is writing it", std::process::id())), "{message}");
        assert!(OutputLock::take(&folder.path().join("other.jsonl")).unwrap().is_some());
        drop(first);
        assert!(!lock.exists(), "nothing stays behind");
        // As a killed process leaves it.
        fs::write(&lock, "4000000000").unwrap();
        let taken = OutputLock::take(&output).unwrap();
        assert_eq!(fs::read_to_string(&lock).unwrap(), std::process::id().to_string());
        drop(taken);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        assert!(OutputLock::take(Path::new("-")).unwrap().is_none());
    }
}
