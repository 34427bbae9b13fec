use std::fs;

use super::*;

fn cloud() -> PointCloud {
    // Numbers that single precision, or few digits, would change.
    let points = (0..23).map(|i| {
        let s = f64::from(i);
        [s.sin() * 1e6 + 1.0 / 3.0, -1e-9 / (s + 1.0), 0.1 * s]
    });
    PointCloud::new(points.collect()).unwrap()
}

#[test]
fn every_format_gives_back_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    // The others hold less, and their own tests say how much less.
    let lossless = FORMATS
        .iter()
        .filter(|f| !["stl", "kitti", "las", "laz", "glb", "gltf", "mcap", "ptx", "vts"].contains(&f.name()));
    let extensions: Vec<&str> = lossless.flat_map(|f| f.extensions()).copied().collect();
    for extension in &extensions {
        for name in [format!("a.{extension}"), format!("b.{}", extension.to_uppercase())] {
            let path = folder.path().join(name);
            assert!(is_cloud_file(&path));
            write_cloud(&path, &cloud()).unwrap();
            assert_eq!(read_cloud(&path).unwrap(), cloud(), "{extension}");
        }
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2 * extensions.len(), "no temporary file stays");
}

#[test]
fn not_finite_points_are_counted_and_can_be_dropped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.xyz");
    fs::write(&path, "0 0 0\nnan 1 2\n1 1 1\n3 inf 3\n").unwrap();
    let message = read_cloud(&path).unwrap_err().to_string();
    assert!(message.contains("scan.xyz") && message.contains("2 of 4 points"), "{message}");
    assert!(message.contains("the first is point 1"), "{message}");
    let (kept, dropped) = read_cloud_dropping_nan(&path).unwrap();
    assert_eq!((kept.points(), dropped), (&[[0.0; 3], [1.0; 3]][..], 2));
    fs::write(&path, "nan 1 2\n").unwrap();
    assert!(matches!(read_cloud_dropping_nan(&path), Err(IoError::Cloud { .. })));
}

#[test]
fn errors_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let message = |name: &str, content: Option<&str>| {
        let path = folder.path().join(name);
        if let Some(content) = content {
            fs::write(&path, content).unwrap();
        }
        read_cloud(&path).unwrap_err().to_string()
    };
    for (name, content, fact) in [
        ("gone.ply", None, "cannot read"),
        ("cloud.qqq", Some("x"), "known are ply, pcd"),
        ("cloud.jpg", Some("x"), "a picture"),
        ("lfs.ply", Some("version https://git-lfs.github.com/spec/v1\noid sha256:1\n"), "`git lfs pull`"),
        ("page.csv", Some("<!DOCTYPE html>\n<html>"), "a web page"),
        ("shapes.h5", Some("\u{1}\u{2}"), "HDF5"),
        ("scan.fls", Some("\u{1}"), "FARO SCENE"),
        ("no_extension", Some("x"), "neither the name nor the content"),
        ("empty", Some(""), "empty"),
        #[cfg(not(feature = "las"))]
        ("cloud.las", Some("x"), "--features las"),
        #[cfg(not(feature = "e57"))]
        ("cloud", Some("ASTM-E57"), "--features e57"),
        ("cloud.pcd", Some("ply\nformat ascii 1.0\n"), "its content is ply"),
        ("scan.bin", Some("123"), "records of 16 bytes"),
        ("short.ply", Some("ply\nformat ascii 1.0\n"), "cut short"),
        ("empty.xyz", Some("# nothing\n"), "empty"),
        ("bad.txt", Some("1 2 3\n1 2\n"), "line 2"),
    ] {
        let message = message(name, content);
        assert!(message.contains(name) && message.contains(fact), "{message}");
    }
    let stl = folder.path().join("a.stl");
    assert!(write_cloud(&stl, &cloud()).unwrap_err().to_string().contains("write .ply or .obj"));
    assert!(!stl.exists());
    let nowhere = folder.path().join("none").join("a.ply");
    assert!(matches!(write_cloud(&nowhere, &cloud()), Err(IoError::Write { .. })));
    assert!(matches!(
        write_cloud(&folder.path().join("a.jpg"), &cloud()),
        Err(IoError::UnknownFormat { .. })
    ));
}

#[test]
fn files_without_extension_and_streams_say_their_format_by_content() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = cloud();
    for format in ["ply", "pcd", "npy", "npz", "off", "obj", "xyz"] {
        let mut bytes = Vec::new();
        write_cloud_to(&mut bytes, format, &cloud).unwrap();
        let path = folder.path().join(format!("{format}_without_dot"));
        fs::write(&path, &bytes).unwrap();
        assert_eq!(read_cloud(&path).unwrap(), cloud);
        let stream = CloudFile::from_reader(&mut &bytes[..], None).unwrap();
        assert_eq!((stream.format(), stream.cloud().unwrap()), (format, cloud.clone()));
    }
    let error = CloudFile::from_reader(&mut &b"?"[..], None).unwrap_err().to_string();
    assert!(error.starts_with("\"-\": ") && error.contains("csv"), "{error}");
    assert!(CloudFile::from_reader(&mut &b"1 2 3"[..], Some("jpg")).is_err());
}

#[test]
fn a_file_can_be_moved_in_place_or_into_another_format() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xyz");
    fs::write(&path, "# kept\n1 2 3 red\nnan 0 0 none\n").unwrap();
    let motion = Rigid { translation: [1.0, 0.0, 0.0].into(), ..Rigid::identity() };
    assert_eq!(write_transformed(&path, &path, &motion).unwrap(), Kept::default());
    assert_eq!(fs::read_to_string(&path).unwrap(), "# kept\n2 2 3 red\nnan 0 0 none\n");
    let other = folder.path().join("b.ply");
    assert_eq!(write_transformed(&path, &other, &motion).unwrap().lost, ["column_4"]);
    assert_eq!(read_cloud_dropping_nan(&other).unwrap().0.points(), [[3.0, 2.0, 3.0]]);
    fs::write(&path, "1 2").unwrap();
    let error = write_transformed(&path, &other, &motion).unwrap_err().to_string();
    assert!(error.contains("a.xyz") && error.contains("line 1"), "the input is at fault: {error}");
    let error = write_transformed(&other, &folder.path().join("c.stl"), &motion).unwrap_err().to_string();
    assert!(error.contains("c.stl") && error.contains("triangles"), "the output is at fault: {error}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}
