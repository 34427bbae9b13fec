//! [`Output`]: where lines for people go.

use std::io::{self, Write};
use std::sync::{Mutex, PoisonError};

use crate::words::visible;

/// Why standard output could not take a line, if it could not.
static LOST: Mutex<Option<io::Error>> = Mutex::new(None);

/// Where lines for people go: standard output, or standard error where standard output carries a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// Standard output.
    Standard,
    /// Standard error, because standard output carries a result.
    Aside,
    /// Nowhere.
    Quiet,
}

impl Output {
    /// Of a run that may be quiet, and whose standard output may carry a result.
    pub fn new(quiet: bool, output_is_taken: bool) -> Self {
        match (quiet, output_is_taken) {
            (true, _) => Self::Quiet,
            (false, true) => Self::Aside,
            (false, false) => Self::Standard,
        }
    }

    /// Says a line, with control characters made visible, for names in it may be what others wrote. A reader that has gone
    /// away, as `head` does, is no failure; a full disk is one of the program, which goes on and ends with 1.
    pub fn say(self, line: &str) {
        match self {
            Self::Standard => note(writeln!(io::stdout(), "{}", visible(line))),
            // There is nowhere to say that this failed.
            Self::Aside => drop(writeln!(io::stderr(), "{}", visible(line))),
            Self::Quiet => {}
        }
    }
}

/// Remembers why a line was lost.
pub(crate) fn note(said: io::Result<()>) {
    if let Err(error) = said
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        LOST.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }
}

/// Why a line of this process was lost, if one was.
pub(crate) fn lost() -> Option<io::Error> {
    LOST.lock().unwrap_or_else(PoisonError::into_inner).take()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quiet_run_says_nothing_wherever() {
        assert_eq!(Output::new(true, true), Output::Quiet);
        assert_eq!(Output::new(true, false), Output::Quiet);
        assert_eq!(Output::new(false, true), Output::Aside);
    }
}
