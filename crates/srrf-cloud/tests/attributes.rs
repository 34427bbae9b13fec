//! What a moved copy in another format keeps, value by value, and what it says that it does not.

#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use std::path::Path;

use nalgebra::Rotation3;
use srrf_cloud::Rigid;
use srrf_cloud::io::{
    Attribute, AttributeValues, CloudFile, Kept, Outgoing, PointLayout, ReadOptions, WhyDouble,
    write_outgoing, write_transformed,
};

const POINTS: [[f64; 3]; 3] = [[0.5, -1.25, 2.0], [1.5, 0.25, -0.75], [-2.0, 4.0, 8.0]];

/// Colours, normals, an intensity and a label.
fn attributes() -> Vec<Attribute> {
    let bytes = |values: [u8; 3]| AttributeValues::U8(values.to_vec());
    let singles = |values: [f32; 3]| AttributeValues::F32(values.to_vec());
    [
        ("red", bytes([255, 1, 30])),
        ("green", bytes([0, 2, 40])),
        ("blue", bytes([128, 3, 50])),
        ("nx", singles([1.0, 0.0, 0.0])),
        ("ny", singles([0.0, 1.0, 0.0])),
        ("nz", singles([0.0, 0.0, 1.0])),
        ("intensity", singles([7.0, 300.0, 65000.0])),
        ("label", AttributeValues::I32(vec![-1, 70_000, 3])),
    ]
    .map(|(name, values)| Attribute { name: name.into(), values })
    .into()
}

/// A quarter turn about z, and a shift.
fn motion() -> Rigid {
    Rigid {
        rotation: Rotation3::from_axis_angle(&nalgebra::Vector3::z_axis(), std::f64::consts::FRAC_PI_2)
            .into_inner(),
        translation: [10.0, 20.0, 30.0].into(),
    }
}

fn write(path: &Path, single: bool) -> Kept {
    let attributes = attributes();
    write_outgoing(path, &Outgoing { single, attributes: &attributes, ..Outgoing::of_points(&POINTS) })
        .unwrap()
}

/// Three points are too few for a `.bin` to say what they are.
fn open(path: &Path) -> CloudFile {
    let bin = path.extension().is_some_and(|extension| extension == "bin");
    let options = ReadOptions { layout: bin.then_some(PointLayout::KITTI), ..ReadOptions::default() };
    CloudFile::open_with(path, options).unwrap()
}

fn values(path: &Path, name: &str) -> Option<Vec<f64>> {
    let attributes = open(path).attributes().unwrap();
    let found = attributes.iter().find(|attribute| attribute.name == name)?;
    Some((0..found.values.len()).map(|i| found.values.get(i).unwrap()).collect())
}

/// From every format to every other: what the target has room for arrives with its values, the rest is named.
#[test]
fn attributes_travel_between_formats() {
    let folder = tempfile::tempdir().unwrap();
    let all = ["red", "green", "blue", "nx", "ny", "nz", "intensity", "label"];
    let colours: &[&str] = &all[..3];
    let kept_by = |extension: &str| -> Vec<&str> {
        match extension {
            "bin" => vec!["intensity"],
            "obj" => colours.to_vec(),
            "off" | "glb" | "gltf" => all[..6].to_vec(),
            "e57" => all[..7].to_vec(),
            "pts" | "las" | "laz" => [colours, &["intensity"]].concat(),
            _ => all.to_vec(),
        }
    };
    let extensions: Vec<&str> =
        ["ply", "pcd", "csv", "xyz", "npz", "npy", "pts", "bin", "obj", "off", "vtk", "vtp", "vtu"]
            .into_iter()
            .chain(if cfg!(feature = "gltf") { vec!["glb", "gltf"] } else { Vec::new() })
            .chain(if cfg!(feature = "las") { vec!["las", "laz"] } else { Vec::new() })
            .chain(cfg!(feature = "e57").then_some("e57"))
            .chain(cfg!(feature = "parquet").then_some("parquet"))
            .collect();
    let sources = ["ply", "pcd", "csv", "xyz", "npz", "npy", "vtk", "vtp"];
    for from in sources.into_iter().chain(cfg!(feature = "parquet").then_some("parquet")) {
        let source = folder.path().join(format!("source.{from}"));
        assert!(write(&source, true).lost.is_empty(), "{from}");
        for to in &extensions {
            let target = folder.path().join(format!("{from}-to.{to}"));
            let kept = write_transformed(&source, &target, &motion()).unwrap();
            let wanted = kept_by(to);
            if from != *to {
                let mut lost = kept.lost.clone();
                lost.sort_unstable();
                let mut missing: Vec<&str> = all.into_iter().filter(|name| !wanted.contains(name)).collect();
                missing.sort_unstable();
                assert_eq!(lost, missing, "{from} to {to}");
            }
            for attribute in attributes().iter().filter(|attribute| wanted.contains(&attribute.name.as_str()))
            {
                let name = attribute.name.as_str();
                let before = |i: usize| attribute.values.get(i).unwrap();
                let mut expected: Vec<f64> = (0..3).map(before).collect();
                // x becomes y, and y becomes -x; but a copy in the same text or archive turns no columns.
                let turns = from != *to || ["ply", "pcd", "parquet", "vtk", "vtp"].contains(to);
                match name {
                    "nx" if turns => expected = vec![0.0, -1.0, 0.0],
                    "ny" if turns => expected = vec![1.0, 0.0, 0.0],
                    _ if ["las", "laz"].contains(to) && colours.contains(&name) => {
                        expected.iter_mut().for_each(|value| *value *= 257.0);
                    }
                    _ => {}
                }
                let found = values(&target, name).unwrap_or_else(|| panic!("{from} to {to}: no {name}"));
                let far = found.iter().zip(&expected).any(|(a, b)| (a - b).abs() > 1e-6);
                assert!(found.len() == 3 && !far, "{from} to {to}: {name} {found:?}, not {expected:?}");
            }
            let points = open(&target).points().unwrap();
            for (point, original) in points.iter().zip(POINTS) {
                let expected = motion().apply(&original);
                assert!((0..3).all(|c| (point[c] - expected[c]).abs() < 2e-5), "{from} to {to}: {point:?}");
            }
        }
    }
}

/// The types of the coordinates, by the words of the files.
#[test]
fn single_precision_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let header = |name: &str| String::from_utf8_lossy(&std::fs::read(path(name)).unwrap()).into_owned();
    write(&path("single.ply"), true);
    write(&path("double.ply"), false);
    let thirds = POINTS.map(|point| point.map(|c| c / 3.0));
    write_outgoing(&path("fine.ply"), &Outgoing::of_points(&thirds)).unwrap();
    let far = Rigid { translation: [4_812_345.678, 0.0, 0.0].into(), ..motion() };
    for (from, to, motion, why, words) in [
        ("single.ply", "a.ply", motion(), None, "property float x"),
        ("single.ply", "a.pcd", motion(), None, "SIZE 4 4 4 4 4 4 4 4 4\nTYPE F F F F F F F F I"),
        ("single.ply", "a.npy", motion(), None, "[('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('red', '<u1')"),
        ("double.ply", "b.ply", motion(), None, "property double x"),
        // Its numbers are those of single precision.
        ("double.ply", "b.pcd", motion(), None, "SIZE 4 4 4"),
        ("fine.ply", "f.pcd", motion(), Some(WhyDouble::AsOriginal), "SIZE 8 8 8"),
    ] {
        let kept = write_transformed(&path(from), &path(to), &motion).unwrap();
        assert_eq!(kept.double, why, "{from} to {to}");
        assert!(header(to).contains(words), "{from} to {to}: {}", &header(to)[..300.min(header(to).len())]);
    }
    for (to, words) in [("c.ply", "property double x"), ("c.pcd", "SIZE 8 8 8"), ("c.npy", "'<f8'")] {
        let kept = write_transformed(&path("single.ply"), &path(to), &far).unwrap();
        let Some(WhyDouble::SingleWouldMove(moved)) = kept.double else { panic!("{to}: {kept:?}") };
        assert!(
            moved > 0.01 && kept.to_string().contains("in double precision, since single would"),
            "{kept}"
        );
        assert!(header(to).contains(words), "{to}");
        let x = open(&path(to)).points().unwrap()[0][0];
        assert!((x - (4_812_345.678 + 1.25)).abs() < 1e-6, "{to}: {x}");
    }
    // Decimals that single precision holds, and decimals that it does not.
    std::fs::write(path("short.xyz"), "0.1 2.25 -3\n4.5 0.003 6\n7 8.125 9\n").unwrap();
    std::fs::write(path("long.xyz"), "0.123456789012 2 3\n4 5 6\n7 8 9\n").unwrap();
    assert_eq!(
        write_transformed(&path("short.xyz"), &path("d.pcd"), &Rigid::identity()).unwrap().double,
        None
    );
    assert!(header("d.pcd").contains("SIZE 4 4 4"));
    let kept = write_transformed(&path("long.xyz"), &path("e.pcd"), &Rigid::identity()).unwrap();
    assert!(kept.double.is_some() && header("e.pcd").contains("SIZE 8 8 8"), "{kept}");
}

/// Text is what the readers of its extension expect, whatever the input was.
#[test]
fn text_has_the_form_of_its_extension() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let title = "x,y,z,red,green,blue,intensity,class\n";
    std::fs::write(path("in.csv"), format!("{title}1,2,3,9,8,7,0.5,wall\n4,5,6,1,2,3,0.25,roof\n")).unwrap();
    std::fs::write(path("spaces.csv"), "1 2 3\n4 5 6\n").unwrap();
    std::fs::write(path("commas.xyz"), "1,2,3\n4,5,6\n").unwrap();
    let copy = |from: &str, to: &str| {
        let kept = write_transformed(&path(from), &path(to), &Rigid::identity()).unwrap();
        (std::fs::read_to_string(path(to)).unwrap(), kept)
    };
    let (text, kept) = copy("in.csv", "a.xyz");
    assert_eq!(text, "# x y z red green blue intensity\n1 2 3 9 8 7 0.5\n4 5 6 1 2 3 0.25\n");
    assert_eq!(kept.lost, ["class"]);
    assert_eq!(copy("in.csv", "a.pts").0, "2\n1 2 3 0.5 9 8 7\n4 5 6 0.25 1 2 3\n");
    assert_eq!(copy("in.csv", "same.csv").0, std::fs::read_to_string(path("in.csv")).unwrap());
    assert_eq!(copy("spaces.csv", "b.csv").0, "x,y,z\n1,2,3\n4,5,6\n");
    assert_eq!(copy("commas.xyz", "b.xyz").0, "1 2 3\n4 5 6\n");
    assert_eq!(copy("commas.xyz", "b.pts").0, "2\n1 2 3\n4 5 6\n");
    let (text, kept) = copy("a.pts", "c.csv");
    assert_eq!(text, "x,y,z,intensity,red,green,blue\n1,2,3,0.5,9,8,7\n4,5,6,0.25,1,2,3\n");
    assert_eq!(kept.to_string(), "with intensity, red, green, blue");
}

/// Packed colours have the bits that PCL and Open3D read.
#[test]
fn colours_of_a_pcd_are_packed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.pcd");
    write(&path, true);
    let bytes = std::fs::read(&path).unwrap();
    let body = bytes.windows(12).position(|w| w == b"DATA binary\n").unwrap() + 12;
    assert_eq!(bytes[body + 12..body + 16], [128, 0, 255, 0], "0x00RRGGBB, little endian");
    assert!(
        String::from_utf8_lossy(&bytes)
            .contains("FIELDS x y z rgb normal_x normal_y normal_z intensity label")
    );
    assert_eq!(values(&path, "blue"), Some(vec![128.0, 3.0, 50.0]));
    // The same in a text, as PCL writes it: an integer, or a float with the bits of one.
    let text = |kind: &str, word: &str| {
        format!(
            "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F {kind}\nCOUNT 1 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3 {word}\n"
        )
    };
    let packed = 0x00ff_0080u32;
    let float = format!("{:e}", f32::from_bits(packed));
    for (kind, word) in [("U", packed.to_string()), ("F", float)] {
        std::fs::write(&path, text(kind, &word)).unwrap();
        let parts = ["red", "green", "blue"].map(|name| values(&path, name).unwrap()[0]);
        assert_eq!(parts, [255.0, 0.0, 128.0], "{kind} {word}");
    }
}

/// A mesh loses its faces, lists and other elements by name.
#[test]
fn what_is_no_attribute_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("mesh.ply");
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                property list uchar int marks\nelement face 1\nproperty list uchar int vertex_indices\nelement edge 1\n\
                property int a\nend_header\n0 0 0 0\n1 0 0 1 5\n0 1 0 0\n3 0 1 2\n7\n";
    std::fs::write(&mesh, text).unwrap();
    let kept = write_transformed(&mesh, &folder.path().join("a.pcd"), &Rigid::identity()).unwrap();
    assert_eq!(kept.lost, ["marks", "edge", "faces"]);
    assert_eq!(kept.to_string(), "without marks, edge, faces, for which this format has no room");
}

/// LAS and LAZ hold the same records.
#[cfg(feature = "las")]
#[test]
fn las_and_laz_are_the_same_records() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    write(&path("a.las"), false);
    let whole = std::fs::read(path("a.las")).unwrap();
    let still = Rigid::identity();
    for (from, to) in [("a.las", "b.laz"), ("b.laz", "c.las"), ("c.las", "d.laz")] {
        assert_eq!(
            write_transformed(&path(from), &path(to), &still).unwrap(),
            Kept::default(),
            "{from} to {to}"
        );
        assert_eq!(values(&path(to), "red"), values(&path("a.las"), "red"), "{to}");
        assert_eq!(values(&path(to), "intensity"), Some(vec![7.0, 300.0, 65000.0]), "{to}");
    }
    assert_eq!(std::fs::read(path("c.las")).unwrap(), whole, "there and back: the same bytes");
    assert_eq!(std::fs::read(path("b.laz")).unwrap(), std::fs::read(path("d.laz")).unwrap());
    assert!(CloudFile::open(&path("b.laz")).unwrap().points().unwrap().len() == 3);
}

/// A column beside x, y and z may have one of their names: each name is there once in what is written.
#[test]
fn names_are_there_once() {
    let folder = tempfile::tempdir().unwrap();
    let from = folder.path().join("a.csv");
    std::fs::write(&from, "X,Y,Z,x_2,Intensity,intensity\n1,2,3,4,5,6\n7,8,9,10,11,12\n").unwrap();
    let options = ReadOptions { columns: Some("4,2,3".parse().unwrap()), ..ReadOptions::default() };
    for name in ["b.npy", "b.npz", "b.ply", "b.parquet", "b.vtp"] {
        let to = folder.path().join(name);
        let motion = Rigid { translation: [100.0, 0.0, 0.0].into(), ..Rigid::identity() };
        CloudFile::open_with(&from, options.clone()).unwrap().write_transformed(&to, &motion).unwrap();
        assert_eq!(open(&to).points().unwrap(), [[104.0, 2.0, 3.0], [110.0, 8.0, 9.0]], "{name}");
        assert_eq!(values(&to, "x_2"), Some(vec![1.0, 7.0]), "{name}");
        assert_eq!(values(&to, "intensity"), Some(vec![5.0, 11.0]), "{name}");
        assert_eq!(values(&to, "intensity_2"), Some(vec![6.0, 12.0]), "{name}");
    }
}
