use std::fs;

use super::identity::ignores_case;
use super::*;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        fs::write(folder.path("a.ply"), "a").unwrap();
        fs::create_dir(folder.path("sub")).unwrap();
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// What is said of reading `a.ply` and writing these.
    fn check(&self, outputs: &[(&str, &str, OutputKind)]) -> Result<(), String> {
        let mut places = Places::new().reads("the source", &*self.path("a.ply"));
        for (flag, name, kind) in outputs {
            let path = self.path(name);
            places = places.writes(flag, &*path, *kind).map_err(|e| e.to_string())?;
        }
        places.check().map_err(|e| e.to_string())
    }
}

const ANY: OutputKind = OutputKind { what: "a pose", extensions: &["txt", "ply"] };

#[test]
fn an_output_is_no_input_by_whatever_name() {
    let folder = Folder::new();
    assert_eq!(folder.check(&[("-o", "b.txt", ANY)]), Ok(()));
    let mut names = vec!["a.ply", "./a.ply", "sub/../a.ply"];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("a.ply", folder.path("link.ply")).unwrap();
        std::os::unix::fs::symlink("link.ply", folder.path("link-of-link.ply")).unwrap();
        std::os::unix::fs::symlink(folder.0.path(), folder.path("sub/up")).unwrap();
        names.extend(["link.ply", "link-of-link.ply", "sub/up/a.ply"]);
    }
    fs::hard_link(folder.path("a.ply"), folder.path("hard.ply")).unwrap();
    names.push("hard.ply");
    for name in names {
        let message = folder.check(&[("--output", name, ANY)]).unwrap_err();
        assert!(message.contains("(--output): it is the same file as"), "{name}: {message}");
        assert!(message.contains("a.ply\" (the source), which would be lost"), "{name}: {message}");
    }
    // A scan of a file, and a copy of the same content, which is another file.
    fs::write(folder.path("copy.ply"), "a").unwrap();
    assert_eq!(folder.check(&[("-o", "copy.ply", ANY)]), Ok(()));
    let scan = Places::new().reads("the target", &*folder.path("a.ply#2"));
    let places = scan.writes("-o", &*folder.path("a.ply"), ANY).unwrap();
    assert!(places.check().unwrap_err().to_string().contains("a.ply#2"));
}

#[test]
fn an_output_is_no_other_output() {
    let folder = Folder::new();
    let two = |a, b| folder.check(&[("--output", a, ANY), ("--save", b, ANY)]);
    assert_eq!(two("x.txt", "y.txt"), Ok(()));
    for (a, b) in [("x.txt", "x.txt"), ("x.txt", "sub/../x.txt")] {
        let message = two(a, b).unwrap_err();
        assert!(message.contains("--output") && message.contains("--save"), "{message}");
        assert!(message.contains("are one file"), "{message}");
    }
    #[cfg(unix)]
    {
        // A link to a file that is not there yet.
        std::os::unix::fs::symlink("x.txt", folder.path("later.txt")).unwrap();
        assert!(two("later.txt", "x.txt").unwrap_err().contains("are one file"));
    }
    let kept_apart = !ignores_case(folder.0.path());
    assert_eq!(two("x.txt", "X.txt").is_ok(), kept_apart, "as the file system has it");
}

#[cfg(unix)]
#[test]
fn devices_take_any_number_of_results() {
    let null = Path::new("/dev/null");
    let places = Places::new().reads("the source", null).writes("-o", null, ANY).unwrap();
    let places = places.writes("--json", null, OutputKind::JSON).unwrap();
    places.check().unwrap();
}

#[test]
fn streams_have_one_use_each() {
    let dash = Path::new("-");
    let places = Places::new().reads("the source", dash).writes("-o", dash, ANY).unwrap();
    places.check().unwrap();
    assert!(places.takes_standard_output());
    let twice = places.clone().reads("the target", dash).check().unwrap_err().to_string();
    assert!(twice.contains("standard input holds one"), "{twice}");
    let twice = places.writes("--json", dash, OutputKind::JSON).unwrap().check().unwrap_err().to_string();
    assert!(twice.contains("2 results") && twice.contains("standard output takes one"), "{twice}");
}

#[test]
fn a_name_says_what_is_written() {
    let folder = Folder::new();
    for (name, kind) in [
        ("p.html", OutputKind::PAGE),
        ("P.HTM", OutputKind::PAGE),
        ("p", OutputKind::PAGE),
        ("r.jsonl", OutputKind::JSON_LINES),
    ] {
        assert_eq!(folder.check(&[("--out", name, kind)]), Ok(()), "{name}");
    }
    for (name, kind, way_out) in [
        ("p.png", OutputKind::PAGE, ".html or .htm"),
        ("p.json", OutputKind::PAGE, ".html or .htm"),
        ("r.parquet", OutputKind::JSON_LINES, ".jsonl or .ndjson"),
        ("r.txt", OutputKind::JSON, "with .json"),
    ] {
        let message = folder.check(&[("--html", name, kind)]).unwrap_err();
        assert!(message.contains("the name says .") && message.ends_with(way_out), "{message}");
    }
    let cloud = Places::new().writes_cloud("--save", &*folder.path("a.doc")).unwrap_err().to_string();
    assert!(cloud.contains("ply") && cloud.contains("a.doc"), "{cloud}");
    // A file in a folder that is still to be made.
    let inside = Places::new().reads("--pairs", &*folder.path("a.ply"));
    inside.clone().writes_into("--output", &folder.path("new"), "a.ply").check().unwrap();
    assert!(inside.writes_into("--output", folder.0.path(), "a.ply").check().is_err());
    let twice = Places::new().fills("--output", folder.0.path()).fills("--book", &*folder.path("sub/.."));
    assert!(twice.check().unwrap_err().to_string().contains("--book"));
}

#[test]
fn a_cloud_has_a_format_with_room_for_it() {
    let folder = Folder::new();
    let cloud = |name: &str| {
        Places::new().writes_cloud("--output", &*folder.path(name)).map(drop).map_err(|e| e.to_string())
    };
    assert_eq!((cloud("b.ply"), cloud("b.CSV")), (Ok(()), Ok(())));
    for (name, words) in [
        ("b.stl", "--output: cannot write"),
        ("b.stl", "STL holds triangles, and a cloud has none; write .ply"),
        ("b.ptx", "write .ply or .e57"),
        ("b.vts", "write .vtp"),
        ("b.foo", "names no format of clouds"),
    ] {
        let message = cloud(name).unwrap_err();
        assert!(message.contains(words), "{name}: {message}");
    }
    assert!(Places::new().writes_copy("--save", &*folder.path("b.stl")).is_ok(), "of another STL");
    assert!(Places::new().writes_copy("--save", &*folder.path("b.foo")).is_err());
}
