//! What goes wrong is said in one message with the file, the fact and the way out.

mod common;

use common::{Done, Scene};

/// One line, on standard error only, that holds all of `words`.
fn says(done: &Done, code: i32, words: &[&str]) {
    assert_eq!(done.code, code, "{done:?}");
    assert_eq!(done.out, "", "{done:?}");
    assert!(done.err.starts_with("error: ") && done.err.lines().count() == 1, "{done:?}");
    for word in words {
        assert!(done.err.contains(word), "{word}: {}", done.err);
    }
}

#[test]
fn clouds_that_cannot_be_used() {
    let scene = Scene::new(200);
    let good = std::fs::read(scene.path("source.ply")).unwrap();
    scene.file("cut.ply", &good[..good.len() / 2]);
    scene.file("header.ply", &good[..20]);
    scene.file("empty.xyz", "");
    scene.file("none.ply", "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n");
    scene.file("nan.xyz", "nan 0 0\n0 nan 0\n0 0 inf\n");
    scene.file("two.xyz", "0 0 0\n1 2 3\n");
    scene.file("line.xyz", "0 0 0\n1 2 3\n2 4 6\n-1 -2 -3\n");
    scene.file("words.xyz", "0 0 0\n1 two 3\n2 4 6\n");
    scene.file("wrong.pcd", &good);
    scene.file("no.format", b"\x00\x01\x02 something else");
    for (name, facts, way_out) in [
        ("missing.ply", &["No such file"][..], "check the path"),
        ("cut.ply", &["cut short", "200"], "is the file complete"),
        ("header.ply", &["header"], "is the file complete"),
        ("empty.xyz", &["empty"], "is it the right file"),
        ("none.ply", &["empty"], "is it the right file"),
        ("nan.xyz", &["each of its 3 points", "NaN"], "write the file again"),
        ("two.xyz", &["2 points"], "take a cloud with three points or more"),
        ("line.xyz", &["on one line"], "take a cloud with three points or more"),
        ("words.xyz", &["line 2"], "is the file complete"),
        ("wrong.pcd", &["its content is ply"], "rename the file"),
        ("no.format", &["format"], "convert the file"),
    ] {
        let words = [&[name][..], facts, &[way_out]].concat();
        says(&scene.srrf(&["register", name, "target.ply"]), 2, &words);
        says(&scene.srrf(&["register", "source.ply", name]), 2, &words);
    }
    let stream = scene.srrf_reading(&["register", "-", "target.ply"], &good[..good.len() / 2]);
    says(&stream, 2, &["\"-\"", "cut short"]);
}

#[test]
fn outputs_that_cannot_be_written_are_found_before_the_work() {
    let scene = Scene::new(200);
    let register =
        |option: &str, path: &str| scene.srrf(&["register", "source.ply", "target.ply", option, path]);
    says(&register("-o", "none/t.txt"), 2, &["none/t.txt", "does not exist", "create it first"]);
    says(&register("--json", "."), 2, &["it is a folder", "name a file"]);
    says(&register("--save", "moved.docx"), 2, &["moved.docx", "names no format", "ply"]);
    if cfg!(target_os = "linux") {
        says(&register("--html", "/proc/page.html"), 2, &["/proc/page.html", "choose another place"]);
    }
    let both = scene.srrf(&["register", "source.ply", "target.ply", "-o", "-", "--json", "-"]);
    says(&both, 2, &["standard output takes one"]);
    says(&scene.srrf(&["register", "-", "-"]), 2, &["standard input holds one"]);
    let files: Vec<_> = std::fs::read_dir(scene.folder.path()).unwrap().collect();
    assert_eq!(files.len(), 2, "nothing was left behind");
}

#[test]
fn options_that_make_no_sense() {
    let scene = Scene::new(200);
    scene.file("scaled.txt", "1 0 0 0\n0 2 0 0\n0 0 1 0\n0 0 0 1\n");
    let register = |more: &[&str]| scene.srrf(&[&["register", "source.ply", "target.ply"], more].concat());
    says(
        &register(&["--initial", "scaled.txt"]),
        2,
        &["scaled.txt", "lengths [1.0, 2.0, 1.0]", "neither scale nor shear"],
    );
    says(&register(&["--initial", "gone.txt"]), 2, &["gone.txt", "4 rows of 4"]);
    says(&register(&["--weights", "srrf-huge"]), 2, &["srrf-huge", "srrf-small"]);
    says(&register(&["--weights", "source.ply"]), 2, &["source.ply", "safetensors"]);
    says(&register(&["--device", "abacus"]), 2, &["abacus", "flex"]);
    if cfg!(not(feature = "rerun")) {
        says(&register(&["--rrd", "out.rrd"]), 2, &["--rrd", "--features rerun", "--html"]);
    }
    // What the parser of arguments refuses ends with a hint at --help.
    for (name, number, words) in
        [("threads", "0", "from 1 to 4,096"), ("seed", "-1", "a whole number from 0 to")]
    {
        let done = register(&[&format!("--{name}"), number]);
        assert!(done.code == 2 && done.err.starts_with("error: "), "{done:?}");
        assert!(done.err.contains(&format!("--{name} <N>")) && done.err.contains(words), "{done:?}");
    }
    says(&register(&["--source-format", "pcd"]), 2, &["source.ply", "streams only"]);
    for bad in [&["--method", "magic"][..], &["--rotation", "90"], &["--seed", "-1"], &["--nonsense"]] {
        let done = register(bad);
        assert!(done.code == 2 && done.err.starts_with("error: "), "{done:?}");
    }
    assert!(register(&["--method", "magic"]).err.contains("fpfh-ransac"));
}
