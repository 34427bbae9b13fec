//! `srrf-eval tables` through the program: whole reports, and what a kill leaves.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use common::{command, refusal, run};

const SMALL: [&str; 9] = [
    "tables",
    "--shapes",
    "3",
    "--points",
    "200",
    "--methods",
    "icp,oracle",
    "--parts",
    "main,beyond,mixtures",
];

/// The files of a folder with their bytes, without the answers that are kept.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<(String, Vec<u8>)> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file())
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read(path).unwrap()))
        .collect();
    files.sort();
    files
}

#[test]
fn the_report_is_complete_and_a_second_run_computes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let first = run(folder.path(), &SMALL);
    assert!(first.status.success(), "{}", String::from_utf8_lossy(&first.stderr));
    let report = folder.path().join("report");
    let written = files(&report);
    let names: Vec<&str> = written.iter().map(|(name, _)| name.as_str()).collect();
    for name in [
        "report.html",
        "tables.md",
        "results.json",
        "table1.csv",
        "table3.csv",
        "beyond.csv",
        "mixtures.csv",
        "severity-rmse-r.svg",
        "corruptions.svg",
        "registrations.svg",
    ] {
        assert!(names.contains(&name), "{name} is missing in {names:?}");
    }
    let text = fs::read_to_string(report.join("tables.md")).unwrap();
    for part in ["upsampling", "local cutout", "s = 7", "12.71", "Left out"] {
        assert_eq!(text.contains(part), part != "Left out", "{part}");
    }
    let page = fs::read_to_string(report.join("report.html")).unwrap();
    assert!(page.contains("class=\"srrf-view\"") && page.contains("three.js"));

    let second = run(folder.path(), &SMALL);
    let said = String::from_utf8(second.stdout).unwrap();
    // 61 + 22 + 10 groups of 3 pairs, some of which hold the same clouds; the oracle is not kept.
    assert!(said.contains(&format!("{} answers were taken from the cache", 93 * 3)), "{said}");
    let again = files(&report);
    for ((name, before), (_, after)) in written.iter().zip(&again) {
        assert!(before == after, "{name} differs");
    }
}

#[test]
fn spread_tables_show_five_times_the_shapes_and_ablations_the_same_ones() {
    let folder = tempfile::tempdir().unwrap();
    let spread = ["--shapes", "10", "--spread", "--points", "200", "--methods", "icp,oracle"];
    let parts = ["--parts", "main,severity,one-sided", "--out", "report"];
    let first = run(folder.path(), &[&["tables"], &spread[..], &parts[..]].concat());
    assert!(first.status.success(), "{}", String::from_utf8_lossy(&first.stderr));
    let said = String::from_utf8(first.stdout).unwrap();
    // Clean pairs of 10 shapes and 12 corruptions of 2 for each severity; then 2 shapes in all 61 groups.
    for part in [(10 + 12 * 10), 2 * 61, 2 * 12] {
        assert!(said.contains(&format!("{part} pairs")), "{part}: {said}");
    }
    let read = |name: &str| fs::read_to_string(folder.path().join("report").join(name)).unwrap();
    let text = read("tables.md");
    assert!(text.contains("10 shapes scored, each at one severity"), "{text}");
    assert!(text.contains("2 shapes scored; corrupt both"), "{text}");
    // The column `both` of the ablation is that of the severities.
    let line = |name: &str| read(name).lines().find(|l| l.starts_with("cutout,icp")).unwrap().to_owned();
    let (compared, severities) = (line("one-sided.csv"), line("severity-rmse_r.csv"));
    assert_eq!(compared.split(',').nth(2), severities.split(',').nth(4));
    assert!(!read("ranking-rmse_r.csv").contains(",,"));
    // Without the severities there is nothing to compare with, and the report says so.
    let alone = [&["tables"], &spread[..], &["--parts", "one-sided", "--out", "alone"]].concat();
    assert!(run(folder.path(), &alone).status.success());
    let text = fs::read_to_string(folder.path().join("alone/tables.md")).unwrap();
    assert!(text.contains("Left out: one-sided: it is compared with the part `severity`"), "{text}");
    let few = refusal(folder.path(), &["tables", "--shapes", "3", "--spread", "--methods", "oracle"]);
    assert!(few.contains("--spread"), "{few}");
}

#[test]
fn a_killed_run_goes_on_to_the_same_numbers() {
    let folder = tempfile::tempdir().unwrap();
    // Slow enough to be killed in the middle.
    let slow = ["tables", "--shapes", "6", "--methods", "icp,oracle", "--parts", "main,mixtures"];
    let total = 6 * (61 + 10);
    let straight = run(folder.path(), &[&slow[..], &["--out", "straight"]].concat());
    assert!(straight.status.success());

    let arguments = [&slow[..], &["--out", "killed", "--threads", "1"]].concat();
    let mut child = command(folder.path(), &arguments).stdout(std::process::Stdio::null()).spawn().unwrap();
    let answers = folder.path().join("killed/cache/answers.jsonl");
    let start = Instant::now();
    let lines = || fs::read(&answers).map_or(0, |bytes| bytes.iter().filter(|b| **b == b'\n').count());
    while lines() < 20 {
        assert!(start.elapsed() < Duration::from_secs(120), "no answer was kept");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap(); // SIGKILL where there are signals
    child.wait().unwrap();
    let kept = lines();
    assert!(kept < total, "killed in the middle");
    // As if the kill had torn a line.
    let mut bytes = fs::read(&answers).unwrap();
    bytes.extend_from_slice(b"0123456789abcdef0123456789abcdef {\"s\":\"1e-");
    fs::write(&answers, bytes).unwrap();

    let resumed = run(folder.path(), &arguments);
    let said = String::from_utf8(resumed.stdout).unwrap();
    assert!(said.contains(&format!("{kept} answers were taken from the cache")), "{said}");
    let compared = ["table1.csv", "table2.csv", "table3.csv", "clean.csv", "mixtures.csv"];
    for name in compared {
        let read = |out: &str| fs::read_to_string(folder.path().join(out).join(name)).unwrap();
        assert_eq!(read("straight"), read("killed"), "{name}");
    }
}

#[test]
fn what_cannot_be_used_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let message = |arguments: &[&str]| refusal(folder.path(), &[&["tables"], arguments].concat());
    assert!(message(&["--methods", "magic"]).contains("`magic`"));
    assert!(message(&["--shapes", "0"]).contains("--shapes"));
    assert!(message(&["--parts", "everything"]).contains("everything"));
    assert!(message(&["--variant", "file"]).contains("--variant"));
    assert!(message(&["--data", "nowhere"]).contains("nowhere"));
    fs::write(folder.path().join("file"), "").unwrap();
    assert!(message(&["--cache", "file/cache"]).contains("--cache"));
}
