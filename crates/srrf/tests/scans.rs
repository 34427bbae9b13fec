//! Files of several scans in the program: listed, chosen, and asked for.

mod common;

use common::Scene;
use serde_json::Value;

const HEAD: &str = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
const STANDING: &str = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
const MOVED: &str = "1 0 0 0\n0 1 0 0\n0 0 1 0\n10 20 30 1\n";

#[test]
fn scans_with_poses_are_one_cloud_and_listed() {
    let scene = Scene::new(10);
    let scan = |matrix: &str, points: &str| format!("1\n{}\n{HEAD}{matrix}{points}", points.lines().count());
    let text =
        scan(STANDING, "1 2 3 0.5\n2 2 3 0.5\n") + &scan(MOVED, "1 0 0 1\n0 1 0 1\n0 0 1 1\n0 0 0 1\n");
    scene.file("site.ptx", text);
    let out = scene.srrf(&["inspect", "site.ptx"]).ok().out;
    for fact in ["#1: 2 points", "#2: 4 points, scanner at", "2 scans as one cloud", "and 1 with NaN"] {
        assert!(out.contains(fact), "{fact}: {out}");
    }
    let json: Value = serde_json::from_str(&scene.srrf(&["inspect", "--json", "site.ptx"]).ok().out).unwrap();
    let scans = json[0]["scans"].as_array().unwrap();
    assert_eq!(
        (scans.len(), &scans[1]["points"], &scans[1]["number"]),
        (2, &Value::from(4), &Value::from(2))
    );
    assert_eq!(scans[1]["file_from_scan"][1][3], 20.0);
    let second = &serde_json::from_str::<Value>(&scene.srrf(&["inspect", "--json", "site.ptx#2"]).ok().out)
        .unwrap()[0];
    assert_eq!((&second["points"], &second["viewpoint"][2]), (&Value::from(3), &Value::from(30.0)));
}

#[test]
fn scans_without_poses_are_listed_and_asked_for() {
    let scene = Scene::new(10);
    scene.file(
        "site.pts",
        "2\n1 2 3 4 5 6 7\n2 2 3 4 5 6 7\n3\n1 0 0 1 2 3 4\n0 1 0 1 2 3 4\n0 0 1 1 2 3 4\n",
    );
    let out = scene.srrf(&["inspect", "site.pts"]).ok().out;
    assert!(out.contains("#1: 2 points") && out.contains("#2: 3 points"), "{out}");
    let out = scene.srrf(&["inspect", "site.pts", "--scan", "2"]).ok().out;
    assert!(out.contains("3 points"), "{out}");
    let done = scene.srrf(&["register", "site.pts", "source.ply"]);
    assert!(done.err.contains("2 scans") && done.err.contains("--scan"), "{}", done.err);
    let done = scene.srrf(&["inspect", "site.pts#3"]);
    assert!(done.err.contains("scan 3 is asked for"), "{}", done.err);
}
