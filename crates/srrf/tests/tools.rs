//! The verbs besides `register` and `batch`.

mod common;

use common::Scene;
use serde_json::Value;
use srrf_cloud::io::read_cloud;

#[test]
fn inspect_says_what_is_there() {
    let scene = Scene::new(1500);
    let mut text: String = scene.source.points().iter().map(|[x, y, z]| format!("{x},{y},{z}\n")).collect();
    text.push_str("nan,0,0\n");
    text.push_str(&text.lines().take(150).map(|l| format!("{l}\n")).collect::<String>());
    scene.file("scan.csv", text);
    let done = scene.srrf(&["inspect", "--json", "scan.csv", "source.ply"]).ok();
    let list: Value = serde_json::from_str(&done.out).unwrap();
    let scan = &list[0];
    assert_eq!((&scan["points"], &scan["dropped_points"]), (&1650.into(), &1.into()));
    assert!((scan["duplicates"].as_f64().unwrap() - 150.0 / 1650.0).abs() < 1e-12);
    assert!(scan["suggestions"].to_string().contains("repeated points"));
    assert!((scan["centroid"][0].as_f64().unwrap() - 500_123.25).abs() < 2.0);
    assert_eq!(list[1]["format"], "ply");

    let text = scene.srrf(&["inspect", "scan.csv"]).ok().out;
    assert!(text.contains("1,650, and 1 with NaN or infinity") && text.contains("spacing"), "{text}");
    // A file that cannot be read does not keep the others from being inspected.
    let done = scene.srrf(&["inspect", "gone.ply", "source.ply"]);
    assert_eq!(done.code, 2);
    assert!(done.out.contains("source.ply: ply, 1,500 points") && done.err.contains("gone.ply"));
}

#[test]
fn inspect_names_what_is_no_measurement() {
    let scene = Scene::new(900);
    let rows =
        |points: &[[f64; 3]]| points.iter().map(|[x, y, z]| format!("{x},{y},{z}\n")).collect::<String>();
    let mut points = scene.source.points().to_vec();
    points.insert(41, [9e6, 0.0, 0.0]);
    scene.file("stray.csv", format!("x,y,z\n,,\n{}", rows(&points)));
    let text = scene.srrf(&["inspect", "stray.csv"]).ok().out;
    // The row before it that is empty counts.
    assert!(text.contains("point 42 (from 0) at (9000000, 0, 0) lies"), "{text}");
    assert!(text.contains("numpy.delete(points, 42, axis=0)"), "{text}");
    assert!(
        text.contains("1 row lacks a coordinate") && text.contains("and 1 with NaN or infinity"),
        "{text}"
    );
    let json = |name: &str| {
        serde_json::from_str::<Value>(&scene.srrf(&["inspect", "--json", name]).ok().out).unwrap()[0].clone()
    };
    let found = json("stray.csv");
    assert_eq!(found["odd_numbers"]["strays"][0]["index"], 42);
    assert_eq!(found["warnings"].as_array().unwrap().len(), 1);
    assert_eq!(json("source.ply")["warnings"].as_array().unwrap().len(), 0);
    let huge: Vec<[f64; 3]> = scene.source.points().iter().map(|p| p.map(|c| 1e30 * (c + 1e7))).collect();
    scene.file("huge.csv", rows(&huge));
    assert!(
        json("huge.csv")["warnings"][0]
            .as_str()
            .unwrap()
            .contains("in 900 points, the first of them point 0")
    );
    // A switch that says nothing to a format is not passed over.
    let done = scene.srrf(&["inspect", "source.ply", "--columns", "1,2,3"]);
    assert!(
        done.code == 2 && done.err.contains("`--columns` says nothing to a file of the format ply"),
        "{done:?}"
    );
    // Said of several files it holds for those that take it, and is refused where none does.
    let done = scene.srrf(&["inspect", "--json", "source.ply", "huge.csv", "--columns", "3,2,1"]).ok();
    let list: Value = serde_json::from_str(&done.out).unwrap();
    let (plain, turned) = (json("huge.csv")["low"].clone(), list[1]["low"].clone());
    assert_eq!((&turned[0], &turned[2]), (&plain[2], &plain[0]));
    assert_eq!(list[0]["low"], json("source.ply")["low"]);
    let nothing = "`--columns` says nothing to any of these files: ply takes none of the switches of reading";
    scene.file("pairs.csv", "source,target\nsource.ply,target.ply\n");
    for arguments in [
        &["inspect", "source.ply", "target.ply"][..],
        &["register", "source.ply", "target.ply"],
        &["view", "source.ply", "target.ply", "-o", "page.html"],
        &["align", "source.ply", "target.ply"],
        &["batch", "pairs.csv", "-o", "results.jsonl"],
    ] {
        let done = scene.srrf(&[arguments, &["--columns", "3,2,1"]].concat());
        assert!(done.code == 2 && done.err.contains(nothing), "{arguments:?}: {done:?}");
    }
    let done = scene.srrf(&["register", "source.ply", "huge.csv", "--source-columns", "3,2,1"]);
    assert!(done.code == 2 && done.err.contains("says nothing to a file of the format ply"), "{done:?}");
}

#[test]
fn corrupt_is_seeded() {
    let scene = Scene::new(600);
    let run = |out: &str, seed: &str| {
        scene
            .srrf(&[
                "corrupt",
                "source.ply",
                "-o",
                out,
                "-c",
                "background",
                "--severity",
                "5",
                "--seed",
                seed,
            ])
            .ok();
        std::fs::read(scene.path(out)).unwrap()
    };
    let first = run("a.ply", "1");
    assert_eq!(first, run("b.ply", "1"));
    assert_ne!(first, run("c.ply", "2"));
    assert!(read_cloud(&scene.path("a.ply")).unwrap().len() > 600);
    // As it was written before.
    scene.srrf(&["corrupt", "source.ply", "d.ply", "--type", "background", "-s", "5", "--seed", "1"]).ok();
    assert_eq!(first, std::fs::read(scene.path("d.ply")).unwrap());
    let done = scene.srrf(&["corrupt", "source.ply", "e.ply", "--type", "rain"]);
    assert!(done.code == 2 && done.err.contains("cutout"), "{done:?}");
}

#[test]
fn skeleton_has_radii() {
    let scene = Scene::new(1200);
    scene.srrf(&["skeleton", "source.ply", "skeleton.ply"]).ok();
    let text = scene.read("skeleton.ply");
    assert!(text.contains("property double radius"));
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip_while(|l| *l != "end_header")
        .skip(1)
        .map(|l| l.split(' ').map(|w| w.parse().unwrap()).collect())
        .collect();
    assert_eq!(rows.len(), 256);
    // Inside the chair, which has a radius of 1.5 m.
    assert!(rows.iter().all(|r| r[3] > 0.0 && r[3] < 1.5 && (r[0] - 500_123.25).abs() < 1.7), "{rows:?}");
    assert_eq!(read_cloud(&scene.path("skeleton.ply")).unwrap().len(), 256);
}

#[test]
fn weights_are_listed_shown_and_checked() {
    let scene = Scene::new(50);
    let list = scene.srrf(&["weights"]).ok().out;
    assert!(list.contains("srrf-small") && list.contains("the default") && list.contains("srrf-shapes"));
    assert!(scene.srrf(&["weights", "show", "srrf-small"]).ok().out.contains("What it is good for"));
    let here = std::env::var("CARGO_MANIFEST_DIR").unwrap();
    let file = &format!("{here}/../srrf-model/weights/srrf-shapes.safetensors")[..];
    let verified = scene.srrf(&["weights", "verify", file]).ok().out;
    assert!(verified.contains("the same as srrf-shapes"), "{verified}");

    let mut bytes = std::fs::read(file).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    scene.file("changed.safetensors", &bytes);
    let sum = verified.split("SHA-256 ").nth(1).unwrap().lines().next().unwrap();
    scene.srrf(&["weights", "verify", file, "--sha256", sum]).ok();
    let done = scene.srrf(&["weights", "verify", "changed.safetensors", "--sha256", sum]);
    assert!(done.code == 2 && done.err.contains("damaged"), "{done:?}");
    scene.file("cut.safetensors", &bytes[..1000]);
    let done = scene.srrf(&["weights", "verify", "cut.safetensors"]);
    assert!(done.code == 2 && done.err.contains("cut.safetensors"), "{done:?}");
}

#[test]
fn view_completions_and_help() {
    let scene = Scene::new(300);
    scene.file("t.txt", "1 0 0 2.5\n0 1 0 -1.25\n0 0 1 0.75\n0 0 0 1\n");
    scene.srrf(&["view", "source.ply", "target.ply", "--transform", "t.txt", "-o", "page.html"]).ok();
    assert!(scene.read("page.html").starts_with("<!doctype html>"));
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        assert!(scene.srrf(&["completions", shell]).ok().out.contains("register"), "{shell}");
    }
    let help = scene.srrf(&["register", "--help"]).ok().out;
    assert!(help.contains("abstains") && help.contains("130"), "{help}");
}
