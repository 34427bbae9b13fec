//! `srrf register` from and to every format of this build.

mod common;

use common::{Scene, pose_of};
use srrf_cloud::io::{read_cloud, write_cloud};

/// Extensions, and what the format's own precision costs at map coordinates, in metres.
const FORMATS: &[(&str, f64)] = &[
    ("ply", 1e-6),
    ("pcd", 1e-6),
    ("xyz", 1e-6),
    ("csv", 1e-6),
    ("npy", 1e-6),
    ("npz", 1e-6),
    ("obj", 1e-6),
    ("off", 1e-6),
    ("las", 1e-3),
    ("laz", 1e-3),
    ("e57", 1e-6),
];

#[test]
fn from_and_to_every_format() {
    let scene = Scene::new(301);
    let rows = scene.truth.to_matrix4();
    let row = |i: usize| (0..4).map(|j| format!("{:.17e}", rows[(i, j)])).collect::<Vec<_>>().join(" ");
    scene.file("first.txt", (0..4).map(|i| row(i) + "\n").collect::<String>());
    for (extension, precision) in FORMATS {
        let [source, target, moved] =
            ["a", "b", "moved"].map(|name| format!("{extension}-{name}.{extension}"));
        write_cloud(&scene.path(&source), &scene.source).unwrap();
        write_cloud(&scene.path(&target), &scene.source.transformed(&scene.truth)).unwrap();
        let method = ["--method", "given", "--initial", "first.txt"];
        let files = ["register", &source, &target, "-o", "t.txt", "--save", &moved];
        let done = scene.srrf(&[&files[..], &method].concat()).ok();
        assert!(done.out.contains("all else that its file holds"), "{extension}: {}", done.out);
        assert!(scene.worst(&pose_of(&scene.read("t.txt"))) < 1e-3 + precision, "{extension}");
        let (moved, target) = (read_cloud(&scene.path(&moved)), read_cloud(&scene.path(&target)));
        for (p, q) in moved.unwrap().points().iter().zip(target.unwrap().points()) {
            let off = (0..3).map(|c| (p[c] - q[c]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-3 + 2.0 * precision, "{extension}: {off}");
        }
    }
}

/// A recording starts with Rerun's mark and holds both clouds.
#[cfg(feature = "rerun")]
#[test]
fn a_recording() {
    let scene = Scene::new(700);
    scene.srrf(&["register", "source.ply", "target.ply", "--rrd", "out.rrd"]).ok();
    let bytes = std::fs::read(scene.path("out.rrd")).unwrap();
    assert_eq!(&bytes[..3], b"RRF");
    assert!(bytes.len() > 3 * 700 * 12, "{} bytes", bytes.len());
}
