//! The frame of a program.

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use clap::Parser;

use crate::failure::Failure;
use crate::output;
use crate::words::visible;

/// Parses the arguments of the process, does what they ask for, and turns a failure into a message on standard error
/// and an exit code. Help and version end with 0, arguments that cannot be parsed with 2.
pub fn run_program<A: Parser>(work: impl FnOnce(A) -> Result<ExitCode, Failure>) -> ExitCode {
    run_program_with(std::env::args_os(), work)
}

/// As [`run_program`], with these arguments; the first is the program's name.
pub fn run_program_with<A: Parser>(
    arguments: impl IntoIterator<Item = OsString>,
    work: impl FnOnce(A) -> Result<ExitCode, Failure>,
) -> ExitCode {
    run_on(arguments, work, &mut std::io::stderr())
}

fn run_on<A: Parser>(
    arguments: impl IntoIterator<Item = OsString>,
    work: impl FnOnce(A) -> Result<ExitCode, Failure>,
    errors: &mut dyn Write,
) -> ExitCode {
    let arguments = match A::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            let printed = error.print();
            if error.use_stderr() {
                return ExitCode::from(crate::USAGE);
            }
            output::note(printed);
            return said(errors).unwrap_or(ExitCode::SUCCESS);
        }
    };
    match work(arguments) {
        Ok(code) => said(errors).unwrap_or(code),
        Err(failure) => {
            let _ = writeln!(errors, "error: {}", visible(&failure.to_string()));
            failure.exit_code()
        }
    }
}

/// The exit code where a line on standard output was lost, for another reason than that nobody reads it.
fn said(errors: &mut dyn Write) -> Option<ExitCode> {
    let error = output::lost()?;
    let _ = writeln!(errors, "error: cannot write to standard output: {error}; choose another place for it");
    Some(ExitCode::from(crate::FAILED))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Parser)]
    struct Arguments {
        #[arg(long)]
        good: bool,
    }

    fn run(arguments: &[&str]) -> (ExitCode, String) {
        let mut errors = Vec::new();
        let work = |a: Arguments| {
            if a.good { Ok(ExitCode::SUCCESS) } else { Err(Failure::failed("it rains".into())) }
        };
        let code = run_on(arguments.iter().map(OsString::from), work, &mut errors);
        (code, String::from_utf8(errors).unwrap())
    }

    #[test]
    fn messages_and_codes() {
        assert_eq!(run(&["p", "--good"]), (ExitCode::SUCCESS, String::new()));
        assert_eq!(run(&["p"]), (ExitCode::from(1), "error: it rains\n".to_owned()));
        assert_eq!(run(&["p", "--bad"]).0, ExitCode::from(2));
        assert_eq!(run(&["p", "--help"]).0, ExitCode::SUCCESS);
        output::note(Err(std::io::ErrorKind::BrokenPipe.into()));
        assert_eq!(run(&["p", "--good"]), (ExitCode::SUCCESS, String::new()), "as `head` does");
        output::note(Err(std::io::ErrorKind::StorageFull.into()));
        let (code, said) = run(&["p", "--good"]);
        assert!(code == ExitCode::from(1) && said.contains("cannot write to standard output"), "{said}");
    }
}
