//! `srrf completions`: scripts for shells.

use std::path::Path;
use std::process::ExitCode;

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::Cli;
use super::failure::Failure;
use super::files;

/// Write the completions for a shell to standard output.
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

/// Writes them.
///
/// # Errors
/// [`Failure::Other`] where standard output cannot be written.
pub fn run(args: &CompletionsArgs) -> Result<ExitCode, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "srrf", &mut script);
    files::write(Path::new("-"), &script)?;
    Ok(ExitCode::SUCCESS)
}
