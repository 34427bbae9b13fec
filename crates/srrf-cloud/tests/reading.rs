//! What a file holds besides its points: faces, viewpoint, grid, precision, scans; and what bounds the reading.

#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use std::fs;

use srrf_cloud::io::{CloudFile, Contents, IoError, ReadOptions};

fn contents(format: &str, bytes: &[u8]) -> Contents {
    CloudFile::from_reader(&mut &bytes[..], Some(format)).unwrap().contents().unwrap()
}

/// A square of two triangles, and a pentagon with it.
const SQUARE: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];
const VERTICES: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

#[test]
fn polygons_become_fans() {
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty uchar red\nproperty list uchar int vertex_indices\nend_header\n{VERTICES}9 4 0 1 2 3\n"
    );
    let off = format!("OFF\n4 1 0\n{VERTICES}4 0 1 2 3 255 0 0\n");
    let obj = VERTICES.lines().map(|line| format!("v {line}\n")).collect::<String>() + "f 1/1 2/2 3//3 -1\n";
    for (format, text, single) in [("ply", ply, true), ("off", off, false), ("obj", obj, false)] {
        let read = contents(format, text.as_bytes());
        assert_eq!(read.points, [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]], "{format}");
        assert_eq!((read.faces.as_slice(), read.single), (&SQUARE[..], single), "{format}");
    }
}

#[test]
fn the_triangles_of_an_stl_share_their_corners() {
    let triangle = |[a, b, c]: [&str; 3]| {
        format!("facet normal 0 0 1\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n")
    };
    let text = format!(
        "solid s\n{}{}endsolid s\n",
        triangle(["0 0 0", "1 0 0", "1 1 0"]),
        triangle(["0 0 0", "1 1 0", "0 1 0"])
    );
    assert_eq!(contents("stl", text.as_bytes()).faces, SQUARE);
}

#[test]
fn binary_faces_strips_and_faces_before_their_vertices() {
    let mut bytes =
        b"ply\nformat binary_big_endian 1.0\nelement face 2\nproperty list uchar ushort vertex_index\n\
                      element vertex 4\nproperty short x\nproperty short y\nproperty short z\nend_header\n"
            .to_vec();
    for corners in SQUARE {
        bytes.push(3);
        corners.iter().for_each(|&corner| bytes.extend((corner as u16).to_be_bytes()));
    }
    for value in [0i16, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0] {
        bytes.extend(value.to_be_bytes());
    }
    let read = contents("ply", &bytes);
    assert_eq!((read.points[2], read.faces.as_slice(), read.single), ([1.0, 1.0, 0.0], &SQUARE[..], true));
    let strips = format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
         element tristrips 1\nproperty list int int vertex_indices\nend_header\n{VERTICES}8 0 1 3 2 -1 0 1 2\n"
    );
    let read = contents("ply", strips.as_bytes());
    assert_eq!((read.faces.as_slice(), read.single), (&[[0, 1, 3], [3, 1, 2], [0, 1, 2]][..], false));
    let wrong = strips.replace("-1 0 1 2", "-1 0 1 4");
    let error = CloudFile::from_reader(&mut wrong.as_bytes(), Some("ply")).unwrap().contents().unwrap_err();
    assert!(error.to_string().contains("line 14: a face names vertex 4, and there are 4"), "{error}");
}

fn pcd(viewpoint: &str, height: usize) -> Contents {
    let text = format!(
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT {height}\nVIEWPOINT {viewpoint}\n\
         POINTS {}\nDATA ascii\n{}",
        2 * height,
        "1 2 3\n".repeat(2 * height)
    );
    contents("pcd", text.as_bytes())
}

#[test]
fn a_pcd_says_where_the_scanner_stood_and_its_grid() {
    assert_eq!((pcd("0 0 0 1 0 0 0", 1).viewpoint, pcd("0 0 0 1 0 0 0", 1).grid), (None, None));
    assert_eq!(pcd("1.5 -2 0.25 1 0 0 0", 1).viewpoint, Some([1.5, -2.0, 0.25]));
    assert_eq!(pcd("0 0 0 0 1 0 0", 3).viewpoint, Some([0.0; 3]), "turned, so it is meant");
    assert_eq!(pcd("0 0 0 1 0 0 0", 3).grid, Some([2, 3]));
    assert!(pcd("0 0 0 1 0 0 0", 1).single);
}

#[test]
fn a_scan_is_named_by_the_path() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xyz");
    fs::write(&path, "1 2 3\n").unwrap();
    let open = |name: &str| CloudFile::open_with(&folder.path().join(name), ReadOptions::default());
    let first = open("a.xyz#1").unwrap();
    assert_eq!((first.path(), first.options().scan), (path.as_path(), Some(1)));
    assert_eq!(first.points().unwrap(), [[1.0, 2.0, 3.0]]);
    let error = open("a.xyz#2").unwrap().points().unwrap_err().to_string();
    assert!(error.contains("scan 2 is asked for") && error.contains("holds one"), "{error}");
    assert!(open("a.xyz#0").unwrap().points().is_err(), "they are counted from 1");
    fs::write(folder.path().join("a.xyz#2"), "4 5 6\n").unwrap();
    assert_eq!(open("a.xyz#2").unwrap().points().unwrap(), [[4.0, 5.0, 6.0]], "a file of that very name");
    assert!(matches!(open("none.xyz#2"), Err(IoError::Read { .. })));
    let scans = first.scans().unwrap();
    assert_eq!((scans.len(), scans[0].points), (1, 1));
}

#[test]
fn memory_is_bounded_before_the_file_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xyz");
    fs::write(&path, "1 2 3\n".repeat(1000)).unwrap();
    let open = |bytes| {
        let options = ReadOptions { max_memory: Some(bytes), ..ReadOptions::default() };
        CloudFile::open_with(&path, options).and_then(|file| file.points()).map(|points| points.len())
    };
    assert_eq!(open(100_000).unwrap(), 1000);
    for (limit, what) in [(5999, "the file alone"), (20_000, "the points")] {
        let error = open(limit).unwrap_err().to_string();
        let named = error.contains("a.xyz") && error.contains(what) && error.contains("--max-memory");
        assert!(named, "{error}");
    }
}
