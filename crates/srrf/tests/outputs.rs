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

/// Eight corners of a box that is no cube, and its faces, as STL.
fn stl() -> String {
    let corner = |i: usize| [i & 1, (i >> 1) & 1, i >> 2].map(|bit| bit as f64);
    let faces = [[0, 1, 3], [0, 3, 2], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4], [2, 3, 7], [2, 7, 6]];
    let mut text = "solid box\n".to_owned();
    for face in faces {
        text += "facet normal 0 0 1\nouter loop\n";
        for [x, y, z] in face.map(corner) {
            text += &format!("vertex {} {} {}\n", x, 2.0 * y, 3.0 * z);
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid box\n"
}

const IDENTITY: &str = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";

#[test]
fn what_no_format_can_hold_is_refused_before_the_search() {
    let scene = Scene::new(60);
    scene.file("box.stl", stl());
    scene.file("identity.txt", IDENTITY);
    let pair = ["register", "source.ply", "target.ply", "--progress", "lines"];
    for (save, words) in [
        ("x.stl", "STL holds triangles, and a cloud has none; write .ply"),
        ("x.ptx", "PTX holds the grid of a scanner"),
        ("x.vts", "write .vtp"),
        ("x.mcap", "recordings of ROS are not written"),
        ("x.bin", "single precision"),
        ("x.glb", "single precision"),
    ] {
        let done = scene.srrf(&[&pair[..], &["--save", save]].concat());
        assert!(done.code == 2 && done.err.contains("--save: cannot write"), "{save}: {done:?}");
        assert!(done.err.contains(words) && done.err.contains(save), "{save}: {done:?}");
        assert!(!done.err.contains("search") && !scene.path(save).exists(), "{save}: {done:?}");
    }
    for (output, verb) in [("x.stl", "corrupt"), ("x.ptx", "corrupt")] {
        let done = scene.srrf(&[verb, "source.ply", "-c", "cutout", "-o", output]);
        assert!(done.code == 2 && done.err.contains("--output: cannot write"), "{done:?}");
    }
    // A mesh has a copy of its own format, as long as its size stays.
    let mesh =
        ["register", "box.stl", "box.stl", "--vertices", "--method", "given", "--initial", "identity.txt"];
    scene.srrf(&[&mesh[..], &["--no-refine", "--save", "moved.stl"]].concat()).ok();
    assert_eq!(scene.read("moved.stl"), stl());
    let done = scene.srrf(&[&mesh[..], &["--scale", "2", "--save", "scaled.stl"]].concat());
    assert!(done.code == 2 && done.err.contains("STL holds triangles"), "{done:?}");
    // Files that say themselves that no copy can be moved.
    let points: Vec<u8> =
        [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0].map(f32::to_le_bytes).concat();
    scene.file("points.bin", points);
    scene.file(
        "a.gltf",
        r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 0}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}], "buffers": [{"byteLength": 48, "uri": "points.bin"}]}"#,
    );
    let done = scene.srrf(&["register", "a.gltf", "a.gltf", "--save", "b.gltf"]);
    assert!(done.code == 2 && done.err.contains("it refers to other files"), "{done:?}");
    let done = scene.srrf(&["align", "a.gltf", "source.ply", "--moved", "copies"]);
    let words = "--moved: no moved copy of \"a.gltf\" can be written: it refers to other files";
    assert!(done.code == 2 && done.err.contains(words) && !scene.path("copies").exists(), "{done:?}");
}

#[cfg(target_os = "linux")]
#[test]
fn an_output_that_fails_loses_no_answer() {
    let scene = Scene::new(300);
    let pair = ["register", "source.ply", "target.ply"];
    let run = |more: &[&str]| scene.srrf(&[&pair[..], more].concat());
    let done = run(&["--save", "/dev/full", "-o", "t.txt", "--html", "a.html", "--png", "/dev/full"]);
    assert!(done.code == 1 && done.out.contains("verdict") && done.out.contains("wrote a.html"), "{done:?}");
    assert_eq!(done.err.matches("cannot write \"/dev/full\"").count(), 2, "{done:?}");
    assert!(scene.worst(&pose_of(&scene.read("t.txt"))) < 1e-2 && scene.path("a.html").exists());
    assert!(!done.err.contains("the pose that was found"), "it is in a file: {done:?}");
    let done = run(&["-q", "-o", "/dev/full"]);
    let (_, pose) = done.err.trim().split_once("the pose that was found is ").unwrap();
    let pose =
        serde_json::json!({ "target_from_source": serde_json::from_str::<serde_json::Value>(pose).unwrap() });
    assert!(done.code == 1 && scene.worst(&pose_of_json(&pose)) < 1e-2, "{done:?}");

    let align = ["align", "source.ply", "target.ply"];
    let done = scene.srrf(&[&align[..], &["-o", "poses.json", "--html", "/dev/full"]].concat());
    assert!(done.code == 1 && done.out.contains("scans") && done.err.contains("/dev/full"), "{done:?}");
    assert_eq!(json(&scene.path("poses.json"))["scans"].as_array().unwrap().len(), 2);
    let done = scene.srrf(&[&align[..], &["-q", "--tum", "/dev/full", "--save", "m.ply"]].concat());
    assert!(done.code == 1 && scene.path("m.ply").exists(), "{done:?}");
    assert!(done.err.contains("# number of the scan") && done.err.contains("\n1 "), "{done:?}");
}
