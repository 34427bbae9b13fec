//! Reads clouds and writes them in other formats:
//! `cargo run -p srrf-cloud --example convert -- scan.e57#2 scan.ply [MORE_IN MORE_OUT]...`
//!
//! A pair that fails is said, and the others are done all the same. `scripts/check-peers.sh` uses it.

#![allow(clippy::print_stderr, reason = "a program")]

use std::path::Path;
use std::process::ExitCode;

use srrf_cloud::PointCloud;
use srrf_cloud::io::{CloudFile, IoError, write_cloud};

fn convert(input: &Path, output: &Path) -> Result<(), IoError> {
    let points = CloudFile::open(input)?.points()?;
    let cloud =
        PointCloud::new(points).map_err(|source| IoError::Cloud { path: input.to_owned(), source })?;
    write_cloud(output, &cloud)
}

fn main() -> ExitCode {
    let files: Vec<String> = std::env::args().skip(1).collect();
    if files.is_empty() || !files.len().is_multiple_of(2) {
        eprintln!("usage: convert IN OUT [IN OUT]...");
        return ExitCode::from(2);
    }
    let mut failed = false;
    for pair in files.as_chunks::<2>().0 {
        let [input, output] = pair;
        if let Err(error) = convert(Path::new(input), Path::new(output)) {
            eprintln!("error: {error}");
            failed = true;
        }
    }
    if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}
