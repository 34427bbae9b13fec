//! Ctrl-C: the program ends at once with exit code 130, but not in the middle of a write.

use std::fs::remove_file;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::failure::Failure;

/// Held while a file is written.
static WRITING: Mutex<()> = Mutex::new(());
/// What to say when interrupted.
static ADVICE: Mutex<&str> = Mutex::new("");

/// Files that must not stay when the process is interrupted.
static LEFT: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// An interruption removes this file.
pub(crate) fn removes(path: PathBuf) {
    LEFT.lock().unwrap_or_else(PoisonError::into_inner).push(path);
}

/// An interruption does not remove this file any more.
pub(crate) fn keeps(path: &Path) {
    LEFT.lock().unwrap_or_else(PoisonError::into_inner).retain(|left| left != path);
}

/// While the guard lives, an interruption waits.
pub fn hold() -> MutexGuard<'static, ()> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What the user is told on an interruption, after "interrupted".
pub fn advise(advice: &'static str) {
    *ADVICE.lock().unwrap_or_else(PoisonError::into_inner) = advice;
}

/// Listens for Ctrl-C and for termination.
///
/// # Errors
/// [`Failure`] where the system refuses.
pub fn install() -> Result<(), Failure> {
    ctrlc::set_handler(|| {
        let _guard = hold();
        let advice = *ADVICE.lock().unwrap_or_else(PoisonError::into_inner);
        let _ = writeln!(std::io::stderr(), "\ninterrupted{advice}");
        LEFT.lock()
            .unwrap_or_else(PoisonError::into_inner)
            .drain(..)
            .for_each(|path| drop(remove_file(path)));
        std::process::exit(i32::from(crate::INTERRUPTED));
    })
    .map_err(|e| Failure::failed(format!("cannot listen for Ctrl-C: {e}")).because(e))
}
