//! [`Output`]: where lines for people go.

use std::io::{self, Write};

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

    /// Says a line. A reader that has gone away, as `head` does, is no failure.
    pub fn say(self, line: &str) {
        let _ = match self {
            Self::Standard => writeln!(io::stdout(), "{line}"),
            Self::Aside => writeln!(io::stderr(), "{line}"),
            Self::Quiet => Ok(()),
        };
    }
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
