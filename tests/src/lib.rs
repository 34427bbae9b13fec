//! Helpers of the end-to-end tests in `tests/`: they run the programs as a user does, and look at
//! what comes out.

#![allow(clippy::expect_used, reason = "helpers of tests may fail loudly")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

/// The folder with the workspace's programs, built once for a test run.
///
/// # Panics
/// When they cannot be built.
pub fn programs() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        // The tests' own binary lies in TARGET/PROFILE/deps; `cargo test` built the same profile.
        let test = std::env::current_exe().expect("a test has a path");
        let folder = test.ancestors().nth(2).expect("TARGET/PROFILE").to_path_buf();
        let status = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
            .args(["build", "--workspace", "--bins", "--locked", "--quiet"])
            .current_dir(workspace())
            .stdin(Stdio::null())
            .status()
            .expect("cargo runs");
        assert!(status.success(), "the programs do not build");
        folder
    })
}

/// The root of the workspace.
///
/// Asked for when the test runs: one target folder may serve several checkouts, and would remember the path of
/// another one.
///
/// # Panics
/// When cargo does not run the test.
pub fn workspace() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let here = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo runs the test"));
        here.parent().expect("this crate lies one level below it").to_path_buf()
    })
}

/// A program, run in the workspace's root and without a data set.
pub fn program(name: &str) -> Command {
    let mut command = Command::new(programs().join(name));
    command.current_dir(workspace()).env_remove("SRRF_DATA").stdin(Stdio::null());
    command
}

/// Runs a program; its exit code and what it said on both streams.
///
/// # Panics
/// When it cannot be started or was killed.
pub fn run(name: &str, arguments: &[&str]) -> (i32, String) {
    let Output { status, stdout, stderr } = program(name).args(arguments).output().expect("it starts");
    let said = [stdout, stderr].concat();
    (status.code().expect("it was not killed"), String::from_utf8_lossy(&said).into_owned())
}

/// Asserts that a program refuses its input: exit code 2, no panic, and each of `words` said.
///
/// # Panics
/// When it does not.
pub fn refuses(name: &str, arguments: &[&str], words: &[&str]) {
    let (code, said) = run(name, arguments);
    assert_eq!(code, 2, "{name} {arguments:?} said: {said}");
    assert!(!said.contains("panicked"), "{name} {arguments:?} panicked: {said}");
    for word in words {
        assert!(said.contains(word), "{name} {arguments:?} does not say `{word}`: {said}");
    }
}
