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
    for extension in FORMATS.iter().flat_map(|f| f.extensions()) {
        for name in [format!("a.{extension}"), format!("b.{}", extension.to_uppercase())] {
            let path = folder.path().join(name);
            assert!(is_cloud_file(&path));
            write_cloud(&path, &cloud()).unwrap();
            assert_eq!(read_cloud(&path).unwrap(), cloud(), "{extension}");
        }
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2 * 7, "no temporary file stays");
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
        ("cloud.las", Some("x"), "known are ply, xyz"),
        ("no_extension", Some("x"), "known are"),
        ("short.ply", Some("ply\nformat ascii 1.0\n"), "cut short"),
        ("empty.xyz", Some("# nothing\n"), "empty"),
        ("bad.txt", Some("1 2 3\n1 2\n"), "line 2"),
    ] {
        let message = message(name, content);
        assert!(message.contains(name) && message.contains(fact), "{message}");
    }
    let nowhere = folder.path().join("none").join("a.ply");
    assert!(matches!(write_cloud(&nowhere, &cloud()), Err(IoError::Write { .. })));
    assert!(matches!(
        write_cloud(&folder.path().join("a.jpg"), &cloud()),
        Err(IoError::UnknownFormat { .. })
    ));
}
