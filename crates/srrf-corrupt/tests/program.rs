//! The program from the outside: files, messages, exit codes.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use srrf_cloud::io::read_cloud;
use tempfile::TempDir;

fn program(folder: &TempDir, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_srrf-corrupt"))
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .output()
        .unwrap()
}

/// Exit code 2, and one message on standard error that holds all of `parts`.
fn refuses(folder: &TempDir, arguments: &str, parts: &[&str]) {
    let output = program(folder, arguments);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments}: {message}");
    assert!(parts.iter().all(|part| message.contains(part)), "{arguments}: {message}");
    assert!(message.starts_with("error: ") && !message.contains("panicked"), "{message}");
    assert!(!folder.path().join("out.ply").exists());
}

/// A folder with `in.xyz`: 400 points of a spiral far from the origin, in millimetres.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::new();
    for i in 0..400 {
        let a = f64::from(i) * 0.1;
        writeln!(text, "{} {} {}", 5000.0 + 300.0 * a.cos(), 100.0 * a.sin() - 70.0, 9.0 * a).unwrap();
    }
    fs::write(folder.path().join("in.xyz"), text).unwrap();
    folder
}

fn points(folder: &TempDir, name: &str) -> Vec<[f64; 3]> {
    read_cloud(&folder.path().join(name)).unwrap().into_points()
}

#[test]
fn corrupts_a_file_in_its_own_unit_and_repeats_itself() {
    let folder = folder();
    let output = program(&folder, "in.xyz --corruption cutout --severity 3 --seed 1 -o out.ply");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(String::from_utf8(output.stdout).unwrap().contains("400 points became 340, 0 of them new"));
    let (clean, cut) = (points(&folder, "in.xyz"), points(&folder, "out.ply"));
    // Five clusters of 30 for 1,024 points: 12 for 400.
    assert_eq!(cut.len(), 340);
    for p in &cut {
        // There and back over the unit sphere of a cloud 5,000 away costs some last places.
        assert!(clean.iter().any(|q| (0..3).all(|c| (p[c] - q[c]).abs() < 1e-9)));
    }
    program(&folder, "in.xyz again.ply -t cutout --severity 3 --seed 1 --quiet");
    program(&folder, "in.xyz --corruption cutout --severity 3 --seed 2 -o other.ply");
    let bytes = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert_eq!(bytes("out.ply"), bytes("again.ply"));
    assert_ne!(bytes("out.ply"), bytes("other.ply"));
}

#[test]
fn every_corruption_runs() {
    let folder = folder();
    let list = String::from_utf8(program(&folder, "--list").stdout).unwrap();
    let names: Vec<&str> = list.lines().skip(1).filter_map(|l| l.split_whitespace().next()).collect();
    assert_eq!(names.len(), 12);
    for name in names {
        let output = program(&folder, &format!("in.xyz -c {name} -s 5 -o {name}.xyz"));
        assert_eq!(output.status.code(), Some(0), "{name}: {output:?}");
        assert_ne!(points(&folder, &format!("{name}.xyz")), points(&folder, "in.xyz"));
    }
}

#[test]
fn bad_usage_and_bad_input_are_refused() {
    let folder = folder();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("nan.xyz", "0 0 0\n1 NaN 0\n0 1 0\n");
    write("three.xyz", "0 0 0\n1 0 0\n0 1 0\n");
    write("empty.xyz", "");
    refuses(&folder, "in.xyz -c cutout -s 9 -o out.ply", &["severity 9 does not exist", "1, 2, 3, 4 and 5"]);
    refuses(&folder, "in.xyz -c rain -o out.ply", &["unknown corruption `rain`", "distortion_rbf_inv"]);
    refuses(&folder, "none.ply -c cutout -o out.ply", &["none.ply"]);
    refuses(&folder, "three.xyz -c density_dec -o out.ply", &["three.xyz", "at least 32 points", "has 3"]);
    refuses(&folder, "empty.xyz -c uniform -o out.ply", &["empty.xyz", "empty"]);
    refuses(&folder, "in.xyz -c uniform -o out.docx", &["out.docx", "ply"]);
    refuses(&folder, "in.xyz -c uniform -o no/out.ply", &["no/out.ply", "does not exist"]);
    refuses(&folder, "in.xyz -o out.ply", &["--corruption"]);
    refuses(&folder, "", &["--corruption <NAME>", "<INPUT>", "--help"]);
    refuses(&folder, "sheet none.ply -o sheet.png", &["none.ply"]);
    refuses(&folder, "in.xyz -c uniform -o out.ply --seed -1", &["--seed <N>", "from 0 to"]);
    refuses(&folder, "sheet -o out.ply --points 31", &["--points <N>", "from 32 to 100,000"]);
    let output = program(&folder, "nan.xyz -c uniform -o out.ply");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(String::from_utf8(output.stdout).unwrap().contains("1 with NaN or infinity were left out"));
    assert_eq!(points(&folder, "out.ply").len(), 2);
}

#[test]
fn draws_a_sheet_with_and_without_a_file() {
    let folder = folder();
    for arguments in ["sheet -o built-in.png", "sheet in.xyz --points 200 --up y -o file.png"] {
        let output = program(&folder, arguments);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
    }
    let size = |name: &str| {
        let file = fs::File::open(folder.path().join(name)).unwrap();
        let reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
        (reader.info().width, reader.info().height)
    };
    assert_eq!(size("built-in.png"), size("file.png"));
    assert!(size("file.png").0 > 1000);
    let leftovers = fs::read_dir(&folder).unwrap().filter_map(Result::ok);
    let hidden = |path: &Path| path.file_name().unwrap().to_string_lossy().starts_with('.');
    assert_eq!(leftovers.filter(|entry| hidden(&entry.path())).count(), 0);
}
