//! `srrf`: registers two point clouds, says whether it worked, and shows it.

use std::process::ExitCode;

fn main() -> ExitCode {
    srrf_model::keep_freed_memory();
    srrf_args::run_program_with(srrf::cli::arguments(std::env::args_os()), srrf::cli::run)
}
