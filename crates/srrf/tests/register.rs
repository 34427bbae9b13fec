//! `srrf register` from files to files.

mod common;

use common::{Scene, json, pose_of, pose_of_json};
use serde_json::Value;
use srrf_cloud::io::read_cloud;

#[test]
fn map_coordinates_keep_their_last_millimetre() {
    let scene = Scene::new(2500);
    let arguments =
        ["register", "source.ply", "target.ply", "-o", "t.txt", "--save", "moved.ply", "--json", "r.json"];
    let done = scene.srrf(&[&arguments[..], &["--html", "page.html", "--unit", "m"]].concat()).ok();
    for word in ["rotation", "translation", "right", "evidence", "asked source points", "time", "wrote t.txt"]
    {
        assert!(done.out.contains(word), "{word}: {}", done.out);
    }

    let pose = pose_of(&scene.read("t.txt"));
    assert!(scene.worst(&pose) < 1e-3, "{} m", scene.worst(&pose));
    let result = json(&scene.path("r.json"));
    // The reader of these tests rounds the last digit.
    let difference = pose_of_json(&result).to_matrix4() - pose.to_matrix4();
    assert!(difference.abs().max() < 1e-8, "{difference}");
    assert_eq!(done.code == 3, result["abstain"] == true);
    assert!((0.0..=1.0).contains(&result["probability"].as_f64().unwrap()));
    assert_eq!(result["points"]["source"], 2500);
    assert_eq!(result["evidence"]["fitness"], 1.0);
    for name in [
        "quaternion_wxyz",
        "euler_xyz_deg",
        "network",
        "refinement",
        "seconds",
        "seed",
        "weights",
        "warnings",
    ] {
        assert!(!result[name].is_null(), "{name}");
    }

    let moved = read_cloud(&scene.path("moved.ply")).unwrap();
    let target = read_cloud(&scene.path("target.ply")).unwrap();
    let off = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max);
    assert!(moved.points().iter().zip(target.points()).map(off).fold(0.0, f64::max) < 1e-3);
    let page = scene.read("page.html");
    assert!(page.starts_with("<!doctype html>") && page.contains("source.ply to target.ply"));
    let shown = page.split("application/json\">").nth(1).unwrap().split("</script").next().unwrap();
    let shown: Value = serde_json::from_str(shown).unwrap();
    let pair = &shown["pairs"][0];
    for side in 0..2 {
        let (points, radii) = (&pair["skeletons"][side]["points"], &pair["skeletons"][side]["radii"]);
        assert_eq!((points.as_array().unwrap().len(), radii.as_array().unwrap().len()), (256, 256));
    }
    assert!(!pair["matches"].as_array().unwrap().is_empty());
}

#[test]
fn streams_in_and_out() {
    let scene = Scene::new(800);
    let source = std::fs::read(scene.path("source.ply")).unwrap();
    let method = ["--method", "fpfh-ransac"];
    let done = scene
        .srrf_reading(&[&["register", "-", "target.ply", "-o", "-"], &method[..]].concat(), &source)
        .ok();
    assert!(scene.worst(&pose_of(&done.out)) < 1e-3);
    assert!(done.err.contains("rotation"), "the summary goes aside: {}", done.err);

    let quiet = ["register", "source.ply", "-", "--json", "-", "--quiet", "--format-target", "ply"];
    let target = std::fs::read(scene.path("target.ply")).unwrap();
    let done = scene.srrf_reading(&[&quiet[..], &method].concat(), &target).ok();
    assert_eq!(done.err, "");
    let result: Value = serde_json::from_str(&done.out).unwrap();
    assert!(scene.worst(&pose_of_json(&result)) < 1e-3);
    assert_eq!((&result["source"], &result["target"]), (&"source.ply".into(), &"-".into()));

    let done =
        scene.srrf(&[&["register", "source.ply", "target.ply", "--save", "-"], &method[..]].concat()).ok();
    assert!(done.bytes.starts_with(b"ply\n"));
}

#[test]
fn a_first_guess() {
    let scene = Scene::new(800);
    scene.srrf(&["register", "source.ply", "target.ply", "-o", "t.txt", "--method", "fpfh-ransac"]).ok();
    let given =
        ["register", "source.ply", "target.ply", "--method", "given", "--no-refine", "--json", "r.json"];
    scene.srrf(&[&given[..], &["--initial", "t.txt"]].concat()).ok();
    let result = json(&scene.path("r.json"));
    assert!(scene.worst(&pose_of_json(&result)) < 1e-3);
    assert_eq!((&result["start"], &result["refinement"]), (&"given".into(), &Value::Null));
}

/// Clouds that have nothing to do with each other: an answer is written, and nobody should rely on it.
#[test]
fn doubt_has_an_exit_code_of_its_own() {
    let scene = Scene::new(900);
    let slab = |i: u32| {
        let (u, v) = (f64::from(i % 40) + 0.3 * f64::from(i).sin(), f64::from(i / 40));
        format!("{} {} {}\n", 0.1 * u, 0.1 * v, 0.02 * (1.7 * f64::from(i)).cos())
    };
    scene.file("slab.xyz", (0..1200).map(slab).collect::<String>());
    let done = scene.srrf(&["register", "source.ply", "slab.xyz", "-o", "t.txt", "--json", "r.json"]);
    assert_eq!(done.code, 3, "{done:?}");
    assert!(done.out.contains("abstain") && done.out.contains("wrote t.txt"), "{}", done.out);
    pose_of(&scene.read("t.txt"));
    assert_eq!(json(&scene.path("r.json"))["abstain"], true);
}

#[test]
fn a_pose_with_no_inlier_is_doubtful() {
    let scene = Scene::new(800);
    let done = scene.srrf(&[
        "register",
        "source.ply",
        "target.ply",
        "--method",
        "given",
        "--no-refine",
        "-o",
        "t.txt",
    ]);
    assert_eq!(pose_of(&scene.read("t.txt")), srrf_cloud::Rigid::identity());
    assert_eq!(done.code, 3, "{done:?}");
}

#[test]
fn nan_is_dropped_and_counted() {
    let scene = Scene::new(700);
    let mut text: String = scene.source.points().iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    text.push_str("nan 1 2\n3 nan 4\n");
    scene.file("holes.xyz", text);
    let arguments =
        ["register", "holes.xyz", "target.ply", "--method", "fpfh-ransac", "--json", "r.json", "-o", "t.txt"];
    let done = scene.srrf(&arguments).ok();
    assert!(done.out.contains("2 more with NaN or infinity left out"), "{}", done.out);
    let result = json(&scene.path("r.json"));
    assert_eq!(
        (&result["dropped_points"]["source"], &result["dropped_points"]["target"]),
        (&2.into(), &0.into())
    );
    assert!(
        result["warnings"].to_string().contains("holes.xyz: 2 points with NaN or infinity were left out.")
    );
    assert!(scene.worst(&pose_of(&scene.read("t.txt"))) < 1e-3);
}

/// The answer is that of the seed alone.
#[test]
fn same_seed_same_bytes_for_any_number_of_threads() {
    let scene = Scene::new(900);
    let run = |threads: &str, seed: &str| {
        let arguments = ["register", "source.ply", "target.ply", "--seed", seed, "--threads", threads];
        scene.srrf(&[&arguments[..], &["-o", "t.txt", "--json", "r.json"]].concat()).ok();
        let mut result = json(&scene.path("r.json"));
        result.as_object_mut().unwrap().remove("seconds").unwrap();
        (scene.read("t.txt"), result.to_string())
    };
    let (one, two) = (run("1", "7"), run("2", "7"));
    assert_eq!(one, two);
    assert_ne!(one.1, run("2", "8").1, "the seed is in the result at least");
}
