//! The program `srrf`, for `python -m srrf`.

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use pyo3::prelude::*;

/// Runs the program `srrf` with these arguments, and answers its exit code.
#[pyfunction]
pub fn program(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| {
        srrf_model::keep_freed_memory();
        let named = std::iter::once(OsString::from("srrf")).chain(arguments);
        let code = srrf_args::run_program_with(srrf::cli::arguments(named), srrf::cli::run);
        // Nothing else does it at the end of a Python process.
        let _ = std::io::stdout().flush();
        (0..=u8::MAX).find(|n| ExitCode::from(*n) == code).unwrap_or(srrf_args::FAILED)
    })
}
