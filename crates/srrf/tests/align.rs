//! `srrf align`: scans in, one map out.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

mod common;

use common::Scene;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;
use srrf_cloud::io::{CloudFile, write_cloud};
use srrf_cloud::{PointCloud, Rigid};
use srrf_corrupt::datasets::ShapeSource;
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::views::{anywhere, seen_from, turntable};

/// Writes views `0..kept` of eight of a shape to `scans/NAME-I.ply`, each moved to anywhere; `object_from_scan` of each.
fn views(scene: &Scene, name: &str, shape: usize, kept: usize) -> Vec<Rigid> {
    let shapes = ProceduralShapes::new(23, 6, None).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(shape as u64);
    let dense = shapes.sample(shape, 60_000, &mut rng).unwrap();
    std::fs::create_dir_all(scene.path("scans")).unwrap();
    turntable(8, 3.5, 1.3)
        .into_iter()
        .take(kept)
        .enumerate()
        .map(|(i, eye)| {
            let seen = seen_from(&dense, eye, 0.012).unwrap();
            let scan_from_object = anywhere(
                std::array::from_fn(|_| rng.random_range(-3.0..3.0)),
                std::array::from_fn(|_| rng.random_range(-5.0..5.0)),
            );
            let thin = seen.points().iter().filter(|_| rng.random_range(0.0..1.0) < 0.1);
            let scan = PointCloud::new(thin.map(|p| scan_from_object.apply(p)).collect()).unwrap();
            write_cloud(&scene.path(&format!("scans/{name}-{i}.ply")), &scan).unwrap();
            scan_from_object.inverse()
        })
        .collect()
}

fn pose(scan: &Value) -> Rigid {
    let rows: Vec<Vec<f64>> = serde_json::from_value(scan["map_from_scan"].clone()).unwrap();
    let mut pose = Rigid::identity();
    for (r, row) in rows.iter().take(3).enumerate() {
        (0..3).for_each(|c| pose.rotation[(r, c)] = row[c]);
        pose.translation[r] = row[3];
    }
    pose
}

/// Largest angle in degrees of the scans against the first.
fn worst_deg(found: &[Rigid], truth: &[Rigid]) -> f64 {
    let off = |i: usize| {
        let (should, does) = (truth[0].inverse().compose(&truth[i]), found[0].inverse().compose(&found[i]));
        should.angle_to_deg(&does)
    };
    (0..found.len()).map(off).fold(0.0, f64::max)
}

#[test]
fn a_folder_of_views_gives_one_map_and_an_added_scan_joins_it() {
    let scene = Scene::new(50);
    let truth = views(&scene, "a", 1, 4);
    std::fs::rename(scene.path("scans/a-3.ply"), scene.path("late.ply")).unwrap();
    let done = scene.srrf(&[
        "align",
        "scans",
        "-o",
        "poses.json",
        "--tum",
        "t.txt",
        "--kitti",
        "k.txt",
        "--save",
        "m.ply",
        "--html",
        "m.html",
        "--edges",
        "e.jsonl",
    ]);
    assert_eq!(done.code, 0, "{done:?}");
    assert!(done.out.contains("one, of 3 scans") && done.out.contains("3 of 3 registered"), "{}", done.out);
    let result: Value = serde_json::from_str(&scene.read("poses.json")).unwrap();
    assert_eq!((&result["schema"], &result["schema_version"]), (&"srrf-align".into(), &1.into()));
    let found: Vec<Rigid> = result["scans"].as_array().unwrap().iter().map(pose).collect();
    assert!(worst_deg(&found, &truth[..3]) < 0.3, "{}", worst_deg(&found, &truth[..3]));
    assert_eq!(result["scans"][2]["name"], "scans/a-2.ply");
    assert_eq!(result["edges"].as_array().unwrap().len(), 3);

    // All three forms say the same.
    let kitti = scene.read("k.txt");
    let row: Vec<f64> = kitti.lines().nth(1).unwrap().split(' ').map(|w| w.parse().unwrap()).collect();
    assert!(
        (row[3] - found[1].translation.x).abs() < 1e-9 && (row[4] - found[1].rotation[(1, 0)]).abs() < 1e-9
    );
    let tum = scene.read("t.txt");
    let rows: Vec<&str> = tum.lines().filter(|l| !l.starts_with('#')).collect();
    assert!(rows.len() == 3 && rows[2].starts_with("2 "), "{tum}");

    // The merged cloud has the scans' points, moved, and their numbers.
    let merged = CloudFile::open(&scene.path("m.ply")).unwrap().cloud().unwrap();
    let scan = CloudFile::open(&scene.path("scans/a-1.ply")).unwrap().cloud().unwrap();
    let moved: Vec<[f64; 3]> = scan.points().iter().map(|p| found[1].apply(p)).collect();
    assert!(merged.points().iter().filter(|p| moved.contains(p)).count() > 100);
    let bytes = std::fs::read(scene.path("m.ply")).unwrap();
    let text = String::from_utf8_lossy(&bytes[..300]).into_owned();
    assert!(
        text.contains("property uint scan") && text.contains(&format!("vertex {}", merged.len())),
        "{text}"
    );
    assert!(scene.read("m.html").contains("a-1.ply"));

    // One more scan: its pairs alone are registered, and the others stay.
    let lines = |scene: &Scene| scene.read("e.jsonl").lines().count();
    assert_eq!(lines(&scene), 3);
    let done =
        scene.srrf(&["align", "late.ply", "--add", "poses.json", "--edges", "e.jsonl", "-o", "more.json"]);
    assert!(done.code == 0 && done.out.contains("3 pairs known already"), "{done:?}");
    assert_eq!(lines(&scene), 6);
    let result: Value = serde_json::from_str(&scene.read("more.json")).unwrap();
    let found: Vec<Rigid> = result["scans"].as_array().unwrap().iter().map(pose).collect();
    assert!(found.len() == 4 && worst_deg(&found, &truth) < 0.3, "{}", worst_deg(&found, &truth));
    let twice = scene.srrf(&["align", "scans/a-0.ply", "--add", "poses.json"]);
    assert!(twice.code == 2 && twice.err.contains("only new ones with --add"), "{twice:?}");
}

#[test]
fn two_objects_give_two_maps_and_exit_code_3() {
    let scene = Scene::new(50);
    let (first, second) = (views(&scene, "a", 1, 2), views(&scene, "b", 3, 2));
    let done = scene.srrf(&["align", "scans", "-o", "poses.json", "--kitti", "k.txt", "--edges", "e.jsonl"]);
    // The poses are written; KITTI cannot hold two maps.
    assert_eq!(done.code, 1, "{done:?}");
    assert!(
        done.err.contains("--kitti holds the poses of one map") && done.err.contains("make 2"),
        "{done:?}"
    );
    let done = scene.srrf(&["align", "scans", "-o", "poses.json", "--edges", "e.jsonl"]);
    assert_eq!(done.code, 3, "{done:?}");
    assert!(done.out.contains("nothing is known of how they lie to each other"), "{}", done.out);
    let result: Value = serde_json::from_str(&scene.read("poses.json")).unwrap();
    let components: Vec<u64> =
        result["scans"].as_array().unwrap().iter().map(|s| s["component"].as_u64().unwrap()).collect();
    assert_eq!(components, [0, 0, 1, 1]);
    let found: Vec<Rigid> = result["scans"].as_array().unwrap().iter().map(pose).collect();
    assert!(worst_deg(&found[..2], &first) < 0.5 && worst_deg(&found[2..], &second) < 0.5);
}

#[test]
fn bad_use_says_what_to_do() {
    let scene = Scene::new(50);
    let error = |arguments: &[&str], words: &str| {
        let done = scene.srrf(&[&["align"], arguments].concat());
        assert!(done.code == 2 && done.err.contains(words), "{arguments:?}: {done:?}");
    };
    error(&["source.ply"], "at least two scans are needed");
    error(&["source.ply", "gone.ply"], "gone.ply");
    error(&["source.ply", "-"], "are files");
    error(&["source.ply", "source.ply"], "twice");
    error(&["source.ply", "target.ply", "--save", "m.xyz"], "name it `.ply`");
    error(&["source.ply", "target.ply", "-o", "none/p.json"], "does not exist; create it first");
    error(&["source.ply", "target.ply", "-o", "-", "--tum", "-"], "name files for the others");
    error(&["source.ply", "target.ply", "--voxel", "0.1"], "--save");
    error(&["source.ply", "target.ply", "--max-memory", "0"], "a size of memory");
    error(&["source.ply", "target.ply", "--sequence", "--all-pairs"], "one of them");
    error(&["--add", "gone.json", "source.ply"], "should be what --output wrote");
    scene.file("bare.csv", "a,b,c,d\n1,2,3,4\n2,3,4,5\n5,5,1,1\n9,1,1,3\n");
    error(&["source.ply", "bare.csv"], "--columns");
    scene.file("also.csv", "a,b,c,d\n1,2,3,9\n2,7,4,5\n5,5,1,1\n9,1,1,3\n");
    let columns = scene.srrf(&["align", "bare.csv", "also.csv", "--columns", "b,c,d", "--initial", "gone"]);
    assert!(columns.err.contains("gone") && !columns.err.contains(".csv"), "{columns:?}");
    scene.file("poses.txt", "1 2 3\n");
    error(&["source.ply", "target.ply", "--initial", "poses.txt"], "TUM has 8");
    scene.file("edges.jsonl", "hello\n");
    error(&["source.ply", "target.ply", "--edges", "edges.jsonl"], "line 1: not a registered pair");
}

/// A PTX file of three views of a shape, its poses a little off; the true poses. A point is as red as its number.
fn project(scene: &Scene) -> Vec<Rigid> {
    let shapes = ProceduralShapes::new(23, 6, None).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let dense = shapes.sample(1, 60_000, &mut rng).unwrap();
    let (mut text, mut truth) = (String::new(), Vec::new());
    for (i, eye) in turntable(8, 3.5, 1.3).into_iter().take(3).enumerate() {
        let seen = seen_from(&dense, eye, 0.012).unwrap();
        let turned = anywhere(std::array::from_fn(|_| rng.random_range(-3.0..3.0)), [0.0; 3]);
        let file_from_scan = Rigid { translation: eye.into(), ..turned };
        let points: Vec<[f64; 3]> = seen
            .points()
            .iter()
            .filter(|_| rng.random_range(0.0..1.0) < 0.1)
            .map(|p| file_from_scan.inverse().apply(p))
            .collect();
        let s = 0.02 * i as f64;
        let written = anywhere([s, -s, s], [s, 0.0, -s]).compose(&file_from_scan).to_matrix4();
        text += &format!("{}\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n", points.len());
        for column in 0..4 {
            let row: Vec<String> = (0..4).map(|r| written[(r, column)].to_string()).collect();
            text += &(row.join(" ") + "\n");
        }
        for (n, p) in points.iter().enumerate() {
            text += &format!("{} {} {} 0.5 {} {} 7\n", p[0], p[1], p[2], n % 256, i);
        }
        truth.push(file_from_scan);
    }
    scene.file("site.ptx", text);
    truth
}

#[test]
fn a_file_of_several_scans_is_taken_apart_and_its_copy_gets_better_poses() {
    let scene = Scene::new(50);
    let truth = project(&scene);
    let done = scene.srrf(&["align", "site.ptx", "-o", "p.json", "--save", "m.ply", "--moved", "out"]);
    assert_eq!(done.code, 0, "{done:?}");
    assert!(done.out.contains("3 scans with a first guess by the poses in their file"), "{}", done.out);
    let result: Value = serde_json::from_str(&scene.read("p.json")).unwrap();
    assert_eq!(
        (&result["scans"][1]["name"], &result["edges"][0]["reason"]),
        (&"site.ptx#2".into(), &"guess".into())
    );

    // The copy holds the same points at poses that agree with the truth, where the original does not.
    let poses = |name: &str| -> Vec<Rigid> {
        let scans = CloudFile::open(&scene.path(name)).unwrap().scans().unwrap();
        scans.iter().map(|s| s.pose.unwrap()).collect()
    };
    let (before, after) = (worst_deg(&poses("site.ptx"), &truth), worst_deg(&poses("out/site.ptx"), &truth));
    assert!(before > 2.0 && after < 0.3, "{before} {after}");

    // Colours and intensity come along: green is the number of the scan, red that of the point.
    let merged = CloudFile::open(&scene.path("m.ply")).unwrap();
    let attributes = merged.attributes().unwrap();
    let value =
        |name: &str, i: usize| attributes.iter().find(|a| a.name == name).unwrap().values.get(i).unwrap();
    let scan = CloudFile::open(&scene.path("site.ptx#2")).unwrap().points().unwrap();
    let pose = pose(&result["scans"][1]);
    let points = merged.points().unwrap();
    let (mut asked, mut right) = (0, 0);
    for (i, p) in points.iter().enumerate().filter(|(i, _)| value("scan", *i) == 1.0) {
        let number =
            scan.iter().position(|q| (0..3).all(|c| (pose.apply(q)[c] - p[c]).abs() < 1e-9)).unwrap();
        asked += 1;
        right += usize::from(
            value("red", i) == (number % 256) as f64
                && value("green", i) == 1.0
                && value("intensity", i) == 0.5,
        );
    }
    assert!(asked > 100 && right == asked, "{right} of {asked}");

    // Two files of one name would have one copy.
    std::fs::create_dir(scene.path("other")).unwrap();
    std::fs::copy(scene.path("site.ptx"), scene.path("other/site.ptx")).unwrap();
    let done = scene.srrf(&["align", "site.ptx", "other/site.ptx", "--moved", "out"]);
    assert!(done.code == 2 && done.err.contains("have the same name"), "{done:?}");
}
