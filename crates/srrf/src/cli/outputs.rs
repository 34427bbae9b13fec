//! [`Outputs`]: what became of the files that a verb was asked for.

use std::path::{Path, PathBuf};

use srrf_args::{Failure, files};

/// What became of the outputs. One that fails does not keep the others from being written.
#[derive(Debug, Default)]
pub struct Outputs {
    /// What was written, for people.
    pub lines: Vec<String>,
    /// What could not be.
    pub failed: Vec<Failure>,
    /// Whether the answer itself is in one of them.
    pub holds_answer: bool,
}

impl Outputs {
    /// Writes one, where it was asked for; `write` says what it wrote, `is_answer` whether that holds the answer itself.
    pub fn put(
        &mut self,
        path: Option<&PathBuf>,
        is_answer: bool,
        write: impl FnOnce(&Path) -> Result<String, Failure>,
    ) {
        let Some(path) = path else { return };
        match write(path) {
            Ok(what) => {
                self.holds_answer |= is_answer;
                self.lines.push(wrote(path, &what));
            }
            Err(failure) => self.failed.push(failure),
        }
    }
}

fn wrote(path: &Path, what: &str) -> String {
    let name = if files::is_stream(path) { "standard output".to_owned() } else { path.display().to_string() };
    format!("wrote {name}: {what}")
}
