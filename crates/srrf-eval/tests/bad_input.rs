//! Every bad input is a clear message and exit code 2.

mod common;

use std::fs;

use common::{command, refusal, run};

#[test]
fn bad_options_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let check = |arguments: &[&str], parts: &[&str]| {
        let message = refusal(folder.path(), arguments);
        for part in parts {
            assert!(message.contains(part), "{arguments:?}: `{part}` is missing in {message}");
        }
    };
    check(&["--corruptions", "rain"], &["`rain`", "cutout", "clean"]);
    check(&["--severities", "9"], &["severity 9", "1, 2, 3, 4 and 5"]);
    check(&["--severities", "0"], &["severity 0"]);
    check(&["--methods", "magic"], &["`magic`", "identity, icp"]);
    check(&["--shapes", "0"], &["--shapes <N>", "from 1 to"]);
    check(&["--points", "2"], &["--points <N>", "from 3 to"]);
    check(&["--threads", "0"], &["--threads <N>", "from 1 to 4,096"]);
    check(&["--methods", "icp;oracle"], &["--methods", "apart by commas: icp,oracle"]);
    check(&["--rotation", "wide"], &["--rotation wide", "so3"]);
    check(&["--translation", "NaN"], &["translation"]);
    check(&["--corrupt", "neither"], &["neither", "both"]);
    check(&["--independent", "--methods", "oracle"], &["oracle", "--sampling shared"]);
    check(&["--unknown"], &["--unknown"]);
}

#[test]
fn one_process_at_a_time_writes_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    let lock = srrf_args::OutputLock::take(&out.join("report")).unwrap();
    let arguments = ["--output", "out", "--shapes", "1", "--methods", "identity", "--clean-only"];
    let message = refusal(folder.path(), &arguments);
    assert!(message.contains(&format!("process {} is writing it", std::process::id())), "{message}");
    drop(lock);
    let pairs = srrf_args::OutputLock::take(&folder.path().join("pairs.npz")).unwrap();
    let message = refusal(folder.path(), &[&arguments[..], &["--export-pairs", "pairs.npz"]].concat());
    assert!(message.contains("pairs.npz") && message.contains("is writing it"), "{message}");
    drop(pairs);
    run(folder.path(), &arguments);
    assert!(out.join("table.md").exists() && !out.join(".report.lock").exists());
}

#[test]
fn missing_data_say_where_and_what_works_without() {
    let folder = tempfile::tempdir().unwrap();
    let message = refusal(folder.path(), &["--data", "nowhere"]);
    for part in ["nowhere", "--data", "accepted layouts", "cargo run -p srrf-eval"] {
        assert!(message.contains(part), "`{part}` is missing in {message}");
    }
    fs::create_dir(folder.path().join("empty")).unwrap();
    assert!(refusal(folder.path(), &["--data", "empty"]).contains("accepted layouts"));
    let output = command(folder.path(), &["--shapes", "1"]).env("SRRF_DATA", "elsewhere").output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("elsewhere") && message.contains("SRRF_DATA"), "{message}");
}

#[test]
fn damaged_data_are_named() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("ply_data_test0.h5"), b"\x89HDF\r\n\x1a\n and then nothing").unwrap();
    let message = refusal(folder.path(), &["--data", "."]);
    assert!(message.contains("ply_data_test0.h5"), "{message}");
}

#[test]
fn bad_pair_files_and_transforms_are_named() {
    let folder = tempfile::tempdir().unwrap();
    assert!(refusal(folder.path(), &["--pairs", "none.npz"]).contains("none.npz"));
    fs::write(folder.path().join("text.npz"), "text").unwrap();
    assert!(refusal(folder.path(), &["--pairs", "text.npz"]).contains("not an .npz archive"));
    let message = refusal(folder.path(), &["--pairs", "text.npz", "--corruptions", "cutout"]);
    assert!(message.contains("--corruptions"), "{message}");

    let made = run(
        folder.path(),
        &[
            "--shapes",
            "2",
            "--points",
            "64",
            "--clean-only",
            "--methods",
            "identity",
            "--export-pairs",
            "p.npz",
        ],
    );
    assert!(made.status.success());
    let whole = fs::read(folder.path().join("p.npz")).unwrap();
    fs::write(folder.path().join("cut.npz"), &whole[..whole.len() / 2]).unwrap();
    assert!(refusal(folder.path(), &["--pairs", "cut.npz"]).contains("cut.npz"));
    let pairs = ["--pairs", "p.npz", "--methods", "identity", "--transforms"];
    fs::write(folder.path().join("t.json"), "{\"clean\": []}").unwrap();
    let message = refusal(folder.path(), &[&pairs[..], &["t.json"]].concat());
    assert!(message.contains("t.json") && message.contains("0 transforms for 2 pairs"), "{message}");
    fs::write(folder.path().join("icp.json"), "[null, null]").unwrap();
    let message = refusal(folder.path(), &[&pairs[..], &["icp.json"]].concat());
    assert!(message.contains("`icp`") && message.contains("rename"), "{message}");
}

#[test]
fn an_output_folder_that_cannot_be_is_refused_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    let message = refusal(folder.path(), &["--out", "file/report"]);
    assert!(message.contains("file/report") && message.contains("--output"), "{message}");
    let export = ["--shapes", "1", "--clean-only", "--export-pairs", "none/pairs.npz"];
    let message = refusal(folder.path(), &export);
    assert!(message.contains("none/pairs.npz") && message.contains("--export-pairs"), "{message}");
}

/// Clouds that determine no rotation are no reason to stop: the method fails on them, and that is
/// counted.
#[test]
fn pairs_that_cannot_be_registered_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let made = common::results(
        folder.path(),
        &["--shapes", "1", "--points", "3", "--clean-only", "--methods", "icp,oracle,srrf"],
    );
    assert_eq!(common::row(&made, "clean", 0, "icp")["pairs"], 1);
    assert_eq!(common::row(&made, "clean", 0, "srrf")["failed"], 0, "three points are enough for a pose");
    // Two pairs of 4 points: on a line, and not.
    let line = [0.0, 1.0, 2.0, 3.0].map(|i| [i, 2.0 * i, -i]);
    let corner = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut file = srrf_cloud::io::NpzWriter::new(fs::File::create(folder.path().join("few.npz")).unwrap());
    let clouds = [line, corner].as_flattened().as_flattened().to_vec();
    file.array("few_x", &[2, 4, 3], &clouds).unwrap();
    file.array("few_y", &[2, 4, 3], &clouds).unwrap();
    file.array("few_R", &[2, 3, 3], [identity; 2].as_flattened().as_flattened()).unwrap();
    file.array("few_t", &[2, 3], &[0.0; 6]).unwrap();
    file.finish().unwrap();
    let results = common::results(folder.path(), &["--pairs", "few.npz", "--methods", "icp,srrf"]);
    for method in ["icp", "srrf"] {
        assert_eq!(common::row(&results, "few", 0, method)["failed"], 1);
        let failure = results["pairs"][0]["methods"][method]["failure"].as_str().unwrap();
        assert!(failure.contains("one line"), "{failure}");
        assert_eq!(results["pairs"][1]["methods"][method]["failed"], false);
    }
}

#[test]
fn weights_of_another_architecture_are_refused_by_parameter() {
    let folder = tempfile::tempdir().unwrap();
    let small = ["--shapes", "1", "--clean-only", "--methods", "srrf", "--weights"];
    let refused = |name: &str| refusal(folder.path(), &[&small[..], &[name]].concat());
    assert!(refused("none.safetensors").contains("none.safetensors"));

    let whole = include_bytes!("../../srrf-model/weights/srrf-small.safetensors");
    fs::write(folder.path().join("cut.safetensors"), &whole[..whole.len() / 3]).unwrap();
    let message = refused("cut.safetensors");
    assert!(message.contains("cut.safetensors") && message.contains("not a complete"), "{message}");

    // The same file, whose header describes a network of another size.
    let (header, other) = (r#"\"skeleton_points\":64"#, r#"\"skeleton_points\":65"#);
    let at = whole.windows(header.len()).position(|w| w == header.as_bytes()).unwrap();
    let mut changed = whole.to_vec();
    changed[at..at + other.len()].copy_from_slice(other.as_bytes());
    fs::write(folder.path().join("other.safetensors"), &changed).unwrap();
    let message = refused("other.safetensors");
    assert!(message.contains("sem.weights") && message.contains("another architecture"), "{message}");

    // A safetensors file that is no network of this program.
    fs::write(folder.path().join("empty.safetensors"), [&2_u64.to_le_bytes()[..], b"{}"].concat()).unwrap();
    let message = refused("empty.safetensors");
    assert!(message.contains("empty.safetensors") && message.contains("srrf_config"), "{message}");
}
