//! Outputs: none is an input or another output, a name says the format, an abstained pose says so, and a full disk is an error.

#![allow(clippy::unwrap_used, reason = "a test may fail loudly")]

mod common;

use common::{Scene, json, pose_of, pose_of_json};
use srrf_cloud::pose::PoseFile;

/// Every verb, each with an output that is one of its inputs by some name.
#[cfg(unix)]
#[test]
fn no_verb_overwrites_what_it_reads() {
    let scene = Scene::new(60);
    std::fs::create_dir(scene.path("sub")).unwrap();
    std::os::unix::fs::symlink("source.ply", scene.path("link.ply")).unwrap();
    std::fs::hard_link(scene.path("target.ply"), scene.path("hard.ply")).unwrap();
    scene.file("t.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    scene.file("pairs.csv", "source,target,initial\nsource.ply,target.ply,t.txt\n");
    std::os::unix::fs::symlink("pairs.csv", scene.path("list.jsonl")).unwrap();
    std::os::unix::fs::symlink("source.ply", scene.path("page.html")).unwrap();
    std::os::unix::fs::symlink("source.ply", scene.path("row.jsonl")).unwrap();
    let here = std::env::var("CARGO_MANIFEST_DIR").unwrap();
    std::fs::copy(
        format!("{here}/../srrf-model/weights/srrf-shapes.safetensors"),
        scene.path("w.safetensors"),
    )
    .unwrap();
    scene.file("w.toml", "");
    let before: Vec<Vec<u8>> = ["source.ply", "target.ply", "t.txt", "pairs.csv"]
        .map(|name| std::fs::read(scene.path(name)).unwrap())
        .into();
    let pair = ["register", "source.ply", "target.ply"];
    for arguments in [
        &[&pair[..], &["--save", "source.ply"]].concat()[..],
        &[&pair[..], &["--save", "./sub/../target.ply"]].concat(),
        &[&pair[..], &["--save", "link.ply"]].concat(),
        &[&pair[..], &["--save", "hard.ply"]].concat(),
        &[&pair[..], &["--html", "page.html"]].concat(),
        &[&pair[..], &["--initial", "t.txt", "-o", "t.txt"]].concat(),
        &[&pair[..], &["-o", "x.json", "--json", "x.json"]].concat(),
        &["view", "source.ply", "target.ply", "-o", "page.html"],
        &["corrupt", "source.ply", "-c", "cutout", "-o", "link.ply"],
        &["skeleton", "source.ply", "-o", "link.ply"],
        &["batch", "pairs.csv", "-o", "list.jsonl"],
        &["batch", "pairs.csv", "-o", "row.jsonl"],
        &["weights", "write", "w.safetensors", "--used-as", "w.toml", "-o", "w.safetensors"],
    ] {
        let done = scene.srrf(arguments);
        assert_eq!(done.code, 2, "{arguments:?}: {done:?}");
        assert!(
            done.err.contains("which would be lost") || done.err.contains("are one file"),
            "{arguments:?}: {}",
            done.err
        );
    }
    let after: Vec<Vec<u8>> = ["source.ply", "target.ply", "t.txt", "pairs.csv"]
        .map(|name| std::fs::read(scene.path(name)).unwrap())
        .into();
    assert!(before == after, "an input has changed");
}

#[test]
fn a_name_of_another_format_is_refused() {
    let scene = Scene::new(60);
    scene.file("pairs.csv", "source,target\nsource.ply,target.ply\n");
    let pair = ["register", "source.ply", "target.ply"];
    for (more, name) in [
        (&["--html", "out.png"][..], ".png"),
        (&["--json", "out.txt"], ".txt"),
        (&["--png", "out.html"], ".html"),
        (&["-o", "out.ply"], "out.ply"),
        (&["--save", "out.html"], "out.html"),
    ] {
        let done = scene.srrf(&[&pair[..], more].concat());
        assert!(done.code == 2 && done.err.contains(name), "{more:?}: {done:?}");
    }
    for arguments in [
        &["view", "source.ply", "target.ply", "-o", "out.json"][..],
        &["skeleton", "source.ply", "-o", "out.pcd"],
        &["batch", "pairs.csv", "-o", "out.txt"],
        &["weights", "write", "srrf-small", "--used-as", "pairs.csv", "-o", "out.npz"],
    ] {
        let done = scene.srrf(arguments);
        assert!(done.code == 2 && done.err.contains("the name says ."), "{arguments:?}: {done:?}");
    }
    let left = std::fs::read_dir(scene.folder.path()).unwrap().flatten();
    assert!(left.map(|e| e.file_name().into_string().unwrap()).all(|name| !name.starts_with("out")));
}

/// The pose that is right in every format, in and out, and an abstained one.
#[test]
fn poses_in_and_out() {
    let scene = Scene::new(500);
    let pair = ["register", "source.ply", "target.ply", "--method", "given", "--initial"];
    let rows = scene.truth.to_matrix4();
    let row = |i: usize| (0..4).map(|j| format!("{:.17e}", rows[(i, j)])).collect::<Vec<_>>().join(" ");
    scene.file("first.txt", (0..4).map(|i| row(i) + "\n").collect::<String>());
    let mut guess = "first.txt".to_owned();
    for extension in ["json", "npy", "tum", "kitti", "ros", "txt"] {
        let output = format!("pose.{extension}");
        let done = scene.srrf(&[&pair[..], &[&guess, "-o", &output]].concat()).ok();
        assert!(done.out.contains("taken as target_from_source"), "{extension}: {}", done.out);
        let read = PoseFile::parse(&std::fs::read(scene.path(&output)).unwrap(), None).unwrap();
        assert!(scene.worst(&read.target_from_source) < 1e-3, "{extension}");
        guess = output;
    }
    assert!(scene.worst(&pose_of(&scene.read("pose.txt"))) < 1e-3);
    // The JSON of an answer is a guess, too.
    scene.srrf(&[&pair[..], &["pose.txt", "--json", "answer.json"]].concat()).ok();
    scene.srrf(&[&pair[..], &["answer.json", "-o", "again.json"]].concat()).ok();
    assert!(scene.worst(&pose_of_json(&json(&scene.path("again.json")))) < 1e-3);

    scene.file(
        "transposed.txt",
        (0..4)
            .map(|j| (0..4).map(|i| format!("{:e} ", rows[(i, j)])).collect::<String>() + "\n")
            .collect::<String>(),
    );
    let done = scene.srrf(&[&pair[..], &["transposed.txt"]].concat());
    assert!(done.code == 2 && done.err.contains("transposed") && done.err.contains("matrix.T"), "{done:?}");

    // The clouds as they lie, metres apart: the answer is to abstain.
    scene.file("wrong.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    let wrong = [&pair[..], &["wrong.txt", "--no-refine"]].concat();
    let done = scene.srrf(&[&wrong[..], &["-o", "doubt.txt", "--json", "doubt.json"]].concat());
    assert_eq!(done.code, 3, "{done:?}");
    assert!(scene.read("doubt.txt").starts_with("# abstain"), "{}", scene.read("doubt.txt"));
    assert_eq!(json(&scene.path("doubt.json"))["abstain"], true);
    let done =
        scene.srrf(&[&wrong[..], &["-o", "none.txt", "--json", "none.json", "--require-answer"]].concat());
    assert!(done.code == 3 && done.out.contains("nothing was written"), "{done:?}");
    assert!(!scene.path("none.txt").exists() && !scene.path("none.json").exists());
}

/// Lines that a full disk cannot take are an error; a reader that goes away is none.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_said_and_a_closed_pipe_is_fine() {
    let scene = Scene::new(60);
    let run = |script: &str| {
        let program = env!("CARGO_BIN_EXE_srrf");
        let output = std::process::Command::new("bash")
            .args(["-c", &script.replace("SRRF", program)])
            .current_dir(scene.folder.path())
            .output()
            .unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    for verb in ["inspect source.ply", "weights", "--help", "completions bash", "corrupt --list"] {
        let (code, said) = run(&format!("SRRF {verb} > /dev/full"));
        assert!(code == Some(1) && said.contains("No space left on device"), "{verb}: {code:?} {said}");
        let (code, said) = run(&format!("set -o pipefail; SRRF {verb} | true"));
        assert!(code == Some(0) && said.is_empty(), "{verb}: {code:?} {said}");
    }
}

/// What a killed run left half written goes at the next start.
#[test]
fn left_overs_are_removed() {
    let scene = Scene::new(60);
    scene.file(".writing-abc", "half");
    scene.srrf(&["corrupt", "source.ply", "-c", "cutout", "-o", "a.ply"]).ok();
    assert!(!scene.path(".writing-abc").exists() && scene.path("a.ply").exists());
}
