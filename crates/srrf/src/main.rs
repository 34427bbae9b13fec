//! `srrf`: registers two point clouds, says whether it worked, and shows it.

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;

mod cli;

fn main() -> ExitCode {
    srrf_model::keep_freed_memory();
    match cli::run(cli::Cli::parse()) {
        Ok(code) => code,
        Err(failure) => {
            let _ = writeln!(std::io::stderr(), "error: {failure}");
            failure.exit_code()
        }
    }
}
