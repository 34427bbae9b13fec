//! `srrf-corrupt`: corrupts a file, draws the contact sheet of all corruptions, and lists them.

use std::process::ExitCode;

fn main() -> ExitCode {
    srrf_args::run_program(srrf_corrupt::cli::run)
}
