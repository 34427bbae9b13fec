//! The exit codes of all programs.

/// A failure: no result, or an output that could not be written.
pub const FAILED: u8 = 1;
/// Bad usage or input: the user can put it right.
pub const USAGE: u8 = 2;
/// A pose was found and written, but is probably wrong.
pub const ABSTAINED: u8 = 3;
/// Interrupted.
pub const INTERRUPTED: u8 = 130;

/// The policy, for help texts.
pub const EXIT_CODES: &str = "Exit codes:
  0    done
  1    failure, such as an output that could not be written
  2    bad usage or input
  130  interrupted; no half-written file remains";
