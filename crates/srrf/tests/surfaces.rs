//! Meshes, units and depth cameras, from files to files.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

#[path = "../examples/cad_clouds.rs"]
#[allow(dead_code, reason = "its own `main`")]
mod cad_clouds;
mod common;

use common::{Done, Scene, json, pose_of_json};
use nalgebra::Vector3;
use serde_json::Value;
use srrf_cloud::Rigid;
use srrf_cloud::io::{read_cloud, write_cloud};

/// A folder with a part, a scan of it, and the pose between them.
fn cad(metres: bool) -> (Scene, Rigid) {
    let scene = Scene::new(50);
    let pose = cad_clouds::write_files(scene.folder.path(), metres).unwrap();
    (scene, pose)
}

/// Greatest distance between where a pose takes the corners of the part and where they belong, unit of the scan.
fn worst(scene: &Scene, found: &Rigid, truth: &Rigid, factor: f64) -> f64 {
    let corners = read_cloud(&scene.path("part.stl")).unwrap().scaled(factor).unwrap();
    let off = |p: &[f64; 3]| (Vector3::from(found.apply(p)) - Vector3::from(truth.apply(p))).norm();
    corners.points().iter().map(off).fold(0.0, f64::max)
}

#[test]
fn a_part_of_36_triangles_lies_on_its_scan() {
    let (scene, truth) = cad(false);
    let done = scene.srrf(&["register", "part.stl", "scan.ply", "--json", "r.json", "--png", "r.png"]).ok();
    assert_eq!(done.code, 0, "{}", done.out);
    assert!(
        done.out.contains("part.stl: a mesh of 36 faces") && done.out.contains("--vertices"),
        "{}",
        done.out
    );
    let result = json(&scene.path("r.json"));
    let error = worst(&scene, &pose_of_json(&result), &truth, 1.0);
    assert!(error < 0.1, "{error} mm");
    assert!(pose_of_json(&result).angle_to_deg(&truth) < 0.05);
    let source = &result["surfaces"]["source"];
    assert_eq!((&source["faces"], &source["faces_left_out"]), (&Value::from(36), &Value::from(0)));
    let points = source["draw"]["surface"]["points"].as_u64().unwrap();
    assert!((20_000..100_000).contains(&points), "{points}");
    assert_eq!(result["points"]["source"], points);
    assert_eq!(result["surfaces"]["target"], Value::Null);
    assert!(std::fs::read(scene.path("r.png")).unwrap().starts_with(b"\x89PNG"));

    // Its corners alone are asked for, and said.
    let done = scene.srrf(&[
        "register",
        "part.stl",
        "scan.ply",
        "--vertices",
        "--method",
        "icp",
        "--json",
        "v.json",
    ]);
    assert!(done.out.contains("vertices are the cloud, as asked"), "{}{}", done.out, done.err);
    assert_eq!(json(&scene.path("v.json"))["surfaces"]["source"]["draw"], Value::Null);
}

#[test]
fn a_part_in_millimetres_and_a_scan_in_metres_are_told_apart_and_brought_together() {
    let (scene, truth) = cad(true);
    let done = scene.srrf(&["register", "part.stl", "scan.ply", "-o", "t.txt"]);
    assert_eq!(done.code, 2, "{}", done.out);
    for words in
        ["different units of length", "near 1,000", "--source-unit mm --target-unit m", "--scale auto"]
    {
        assert!(done.err.contains(words), "{words}: {}", done.err);
    }
    assert!(!scene.path("t.txt").exists(), "named before the work");

    let units = ["--source-unit", "mm", "--target-unit", "m"];
    let files = ["register", "part.stl", "scan.ply", "--json", "r.json", "--save", "moved.ply"];
    let done = scene.srrf(&[&files[..], &units].concat()).ok();
    assert!(done.out.contains("the source times 0.001 (by the units)"), "{}", done.out);
    let result = json(&scene.path("r.json"));
    assert_eq!(
        (&result["scale"]["factor"], &result["scale"]["origin"]),
        (&Value::from(0.001), &Value::from("units"))
    );
    assert_eq!(result["abstain"], false);
    let error = worst(&scene, &pose_of_json(&result), &truth, 0.001);
    assert!(error < 1e-4, "{error} m");
    // The vertices of the part in metres, moved; not the points that were drawn.
    let (saved, pose) = (read_cloud(&scene.path("moved.ply")).unwrap(), pose_of_json(&result));
    let corners = read_cloud(&scene.path("part.stl")).unwrap();
    assert_eq!(saved.len(), corners.len());
    for (saved, corner) in saved.points().iter().zip(corners.points()) {
        let expected = pose.apply(&corner.map(|c| 0.001 * c));
        assert!((0..3).all(|c| (saved[c] - expected[c]).abs() < 1e-6), "{saved:?}, not {expected:?}");
    }

    // The same question the other way round, and in a batch.
    scene.file("pairs.csv", "source,target\nscan.ply,part.stl\n");
    assert_eq!(scene.srrf(&["batch", "pairs.csv", "-o", "b.jsonl"]).code, 1);
    assert!(scene.read("b.jsonl").contains("--source-unit m --target-unit mm"), "{}", scene.read("b.jsonl"));

    // One unit alone says too little, and a factor is a number above 0.
    says(&scene.srrf(&["register", "part.stl", "scan.ply", "--source-unit", "mm"]), 2, "--target-unit");
    says(&scene.srrf(&["register", "part.stl", "scan.ply", "--scale", "-3"]), 2, "above 0");
    says(
        &scene.srrf(&["register", "part.stl", "scan.ply", "--source-unit", "yd", "--target-unit", "m"]),
        2,
        "us-ft",
    );
}

fn says(done: &Done, code: i32, words: &str) {
    assert_eq!(done.code, code, "{}{}", done.out, done.err);
    assert!(done.err.contains(words), "{words}: {}", done.err);
}

#[test]
fn faces_without_a_surface_are_named() {
    let scene = Scene::new(400);
    let head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    scene.file("line.ply", format!("{head}0 0 0\n1 0 0\n2 0 0\n0 1 1\n3 0 1 2\n"));
    scene.file("nan.ply", format!("{head}0 0 0\nnan 0 0\n2 0 1\n0 1 1\n3 0 1 2\n"));
    scene.file("many.ply", format!("{head}0 0 0\n1 0 0\n2 0 0\n0 1 1\n3 0 1 9\n"));
    for name in ["line.ply", "nan.ply"] {
        let done = scene.srrf(&["register", name, "target.ply"]);
        says(&done, 2, "none of its 1 faces has an area");
        assert!(done.err.contains(name) && done.err.contains("--vertices"), "{}", done.err);
    }
    let done = scene.srrf(&["register", "many.ply", "target.ply"]);
    assert!(done.code == 2 && done.err.contains("many.ply") && done.err.contains('9'), "{}", done.err);
}

#[test]
fn piles_of_zeros_are_no_returns() {
    let scene = Scene::new(2000);
    let cloud = read_cloud(&scene.path("source.ply")).unwrap();
    let place = cloud.points()[0];
    let near: Vec<[f64; 3]> =
        cloud.points().iter().map(|p| std::array::from_fn(|c| p[c] - place[c] + 5.0)).collect();
    let text =
        |points: &[[f64; 3]]| points.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect::<String>();
    scene.file("camera.xyz", text(&[&[[0.0; 3]; 700][..], &near].concat()));
    scene.file("near.xyz", text(&near));
    let run = |more: &[&str]| {
        let files = ["register", "camera.xyz", "near.xyz", "--method", "given", "--json", "r.json"];
        let done = scene.srrf(&[&files[..], more].concat());
        (done.out.clone(), json(&scene.path("r.json")))
    };
    let (out, result) = run(&[]);
    assert!(
        out.contains("700 points at exactly 0, 0, 0 were left out") && out.contains("--keep-zeros"),
        "{out}"
    );
    assert_eq!(result["points"]["source"], 2000);
    assert_eq!(result["evidence"]["fitness"], 1.0);
    // A moved copy holds them, moved with the rest; a scaled one has the points that were registered.
    let places = |name: &str| read_cloud(&scene.path(name)).unwrap().into_points();
    let far = |found: &[f64; 3], expected: [f64; 3]| (0..3).any(|c| (found[c] - expected[c]).abs() > 1e-6);
    let (_, result) = run(&["--save", "moved.xyz"]);
    let (pose, saved) = (pose_of_json(&result), places("moved.xyz"));
    assert_eq!(saved.len(), 2700);
    assert!(saved[..700].iter().all(|p| !far(p, pose.apply(&[0.0; 3]))), "{:?}", saved[0]);
    assert!(saved[700..].iter().zip(&near).all(|(p, before)| !far(p, pose.apply(before))));
    let (out, result) = run(&["--scale", "1.5", "--save", "scaled.xyz"]);
    assert!(out.contains("scaled.xyz: the points of the source, scaled and moved"), "{out}");
    let (pose, saved) = (pose_of_json(&result), places("scaled.xyz"));
    assert_eq!(saved.len(), 2000);
    assert!(saved.iter().zip(&near).all(|(p, before)| !far(p, pose.apply(&before.map(|c| 1.5 * c)))));
    let (out, result) = run(&["--keep-zeros"]);
    assert!(!out.contains("were left out"), "{out}");
    assert_eq!(result["points"]["source"], 2700);

    scene.file("dark.xyz", "0 0 0\n".repeat(50));
    says(
        &scene.srrf(&["register", "dark.xyz", "near.xyz"]),
        2,
        "each of its 50 points lies at exactly 0, 0, 0",
    );
}

#[test]
fn other_verbs_draw_meshes_too() {
    let (scene, _) = cad(false);
    let corners = read_cloud(&scene.path("part.stl")).unwrap();
    let inspect = |more: &[&str]| {
        let out = scene.srrf(&[&["inspect", "part.stl", "--json"][..], more].concat()).ok().out;
        serde_json::from_str::<Value>(&out).unwrap()[0].clone()
    };
    let found = inspect(&[]);
    assert_eq!((&found["faces"], &found["points"]), (&Value::from(36), &Value::from(corners.len())));
    assert_eq!(found["surface"]["points"], 20_000);
    let high: f64 = corners.points().iter().map(|p| p[0]).fold(f64::NEG_INFINITY, f64::max);
    assert_eq!(found["high"][0], high, "the box is that of the vertices");
    let spacing = found["spacing"].as_f64().unwrap();
    let drawn = found["surface"]["spacing"].as_f64().unwrap();
    assert!((spacing / drawn - 1.0).abs() < 0.3, "{spacing} {drawn}");
    assert_eq!(inspect(&["--vertices"])["surface"], Value::Null);
    let text = scene.srrf(&["inspect", "part.stl"]).ok().out;
    assert!(text.contains("20,000 points drawn from its surface"), "{text}");

    let corrupt = |more: &[&str]| {
        let words = ["corrupt", "part.stl", "-c", "gaussian", "-o", "c.ply"];
        let out = scene.srrf(&[&words[..], more].concat()).ok().out;
        (out, read_cloud(&scene.path("c.ply")).unwrap().len())
    };
    let (out, points) = corrupt(&[]);
    assert!(
        points == 20_000 && out.contains("part.stl is a mesh of 36 faces: 20,000 points drawn"),
        "{points} {out}"
    );
    assert_eq!(corrupt(&["--vertices"]).1, corners.len());
    let out = scene.srrf(&["skeleton", "part.stl", "-o", "s.ply"]).ok().out;
    assert!(out.contains("20,000 points drawn from its surface"), "{out}");
}

#[test]
fn steps_are_shown_where_they_are_wanted() {
    let scene = Scene::new(600);
    let files = ["register", "source.ply", "target.ply", "--method", "given"];
    let run = |more: &[&str]| scene.srrf(&[&files[..], more].concat());
    let lines = run(&["--progress", "lines", "--html", "p.html"]).err;
    for words in [
        "reading \"source.ply\"",
        "preparing the target",
        "round 1 of",
        "ranking and refining",
        "writing \"p.html\"",
    ] {
        assert!(lines.contains(words), "{words}: {lines}");
    }
    for quiet in [&[][..], &["--progress", "off"], &["--progress", "bar"], &["-q", "--progress", "lines"]] {
        assert_eq!(run(quiet).err, "", "{quiet:?}");
    }
    let view = scene.srrf(&["view", "source.ply", "target.ply", "--png", "p.png", "--progress", "lines"]);
    assert!(view.err.contains("writing \"p.png\""), "{}", view.err);
    let corrupt =
        scene.srrf(&["corrupt", "source.ply", "-c", "gaussian", "-o", "c.ply", "--progress", "lines"]);
    assert!(corrupt.err.contains("corrupting"), "{}", corrupt.err);
}

#[test]
fn a_small_part_in_a_large_scene_is_no_other_unit() {
    // One scanner: a sixth of the scene, at the same spacing.
    let scene = Scene::new(6000);
    let whole = read_cloud(&scene.path("source.ply")).unwrap();
    let centre = whole.points()[0];
    let away = |p: &[f64; 3]| (0..3).map(|c| (p[c] - centre[c]).powi(2)).sum::<f64>();
    let mut points = whole.points().to_vec();
    points.sort_by(|a, b| away(a).total_cmp(&away(b)));
    points.truncate(1000);
    write_cloud(&scene.path("part.ply"), &srrf_cloud::PointCloud::new(points).unwrap()).unwrap();
    let done = scene.srrf(&["register", "part.ply", "source.ply", "--json", "r.json"]);
    assert!(!done.err.contains("unit") && !done.out.contains("unit"), "{}{}", done.out, done.err);
    assert_ne!(done.code, 2);
}
