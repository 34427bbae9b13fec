//! What `corruptions/mod.rs` promises: a corruption is one file and one line. No other code of the crate names one.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::fs;
use std::path::{Path, PathBuf};

use srrf_corrupt::CorruptionKind;

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("tests.rs") {
            found.push(path);
        }
    }
}

/// The code of a file without comments and without its tests.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let lines = text.lines().map(|line| line.split("//").next().unwrap_or("").trim_end());
    lines.take_while(|line| *line != "#[cfg(test)]").collect::<Vec<_>>().join("\n")
}

/// The name as it is written in the list.
fn variant(kind: CorruptionKind) -> String {
    format!("{kind:?}")
}

#[test]
fn a_corruption_is_one_file_and_one_line() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let registry = root.join("corruptions/mod.rs");
    let mut files = Vec::new();
    sources(&root, &mut files);
    assert!(files.len() > 60 && files.contains(&registry), "{files:?}");

    let whole = fs::read_to_string(&registry).unwrap();
    for kind in CorruptionKind::ALL {
        let line = format!("    {} = {kind},", variant(kind));
        assert_eq!(whole.matches(&line).count(), 1, "{line}");
        assert!(root.join(format!("corruptions/{kind}.rs")).is_file(), "{kind}");
    }
    for file in files.iter().filter(|file| **file != registry) {
        let code = code(file);
        for kind in CorruptionKind::ALL {
            let own = file.file_stem().unwrap() == kind.name();
            let names =
                [format!("CorruptionKind::{}", variant(kind)), format!("\"{kind}\""), format!("{kind}::")];
            for name in names.iter().filter(|_| !own) {
                // `uniform::` would be within `some_uniform::`.
                let found = code
                    .match_indices(name.as_str())
                    .any(|(at, _)| !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_'));
                assert!(!found, "{} names {name}", file.display());
            }
        }
    }
}
