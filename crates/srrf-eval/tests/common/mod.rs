//! Runs the program as a user does.
#![allow(dead_code, reason = "each test file uses a part")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests")]

use std::path::Path;
use std::process::{Command, Output};

/// Runs `srrf-eval` with these arguments in `folder`, without `SRRF_DATA`.
pub fn run(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

/// The command, for tests that set more.
pub fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_srrf-eval"));
    command.current_dir(folder).args(arguments).env_remove("SRRF_DATA");
    command
}

/// Runs it, expects success, and gives `results.json` of the folder `report`.
pub fn results(folder: &Path, arguments: &[&str]) -> serde_json::Value {
    let output = run(folder, arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {errors}");
    serde_json::from_slice(&std::fs::read(folder.join("report/results.json")).unwrap()).unwrap()
}

/// Runs it, expects exit code 2, and gives the message.
pub fn refusal(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    message
}

/// The row of the summary with these keys.
pub fn row<'a>(
    results: &'a serde_json::Value,
    corruption: &str,
    severity: impl Into<serde_json::Value>,
    method: &str,
) -> &'a serde_json::Value {
    let severity = severity.into();
    let rows = results["summary"].as_array().unwrap();
    rows.iter()
        .find(|r| r["corruption"] == corruption && r["severity"] == severity && r["method"] == method)
        .unwrap_or_else(|| panic!("no row {corruption} {severity} {method}"))
}

/// The summary without what is measured by the clock.
pub fn scores(results: &serde_json::Value) -> serde_json::Value {
    let mut summary = results["summary"].clone();
    for row in summary.as_array_mut().unwrap() {
        row.as_object_mut().unwrap().remove("seconds_per_pair");
    }
    summary
}
