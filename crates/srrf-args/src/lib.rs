//! The dialect of the programs `srrf`, `srrf-eval`, `srrf-train` and `srrf-corrupt`: the same flag for the same
//! thing, one policy of exit codes, one way to read and write, the same words.
//!
//! A program hands its arguments and what it does with them to [`run_program`]; what goes wrong is a [`Failure`],
//! which knows its exit code and keeps its source. Flags that several programs have are in [`flags`]; numbers
//! are checked while they are parsed ([`numbers`]), so that a message names the flag.

mod exit;
mod failure;
pub mod files;
pub mod flags;
pub mod interrupt;
mod lock;
pub mod numbers;
mod output;
mod places;
mod program;
mod progress;
pub mod reading;
mod scripts;
pub mod surface;
pub mod words;

pub use exit::{ABSTAINED, EXIT_CODES, FAILED, INTERRUPTED, USAGE};
pub use failure::Failure;
pub use lock::OutputLock;
pub use output::Output;
pub use places::{OutputKind, Places};
pub use program::{run_program, run_program_with};
pub use progress::{Progress, ProgressArgs, ProgressKind};
pub use scripts::Scripts;
