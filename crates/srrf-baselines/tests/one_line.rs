//! A learned baseline is one file (or folder) and one line: no other source of the workspace names its type.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::fs;
use std::path::{Path, PathBuf};

/// All Rust sources under `folder`.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn no_other_source_names_a_baseline() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let list = fs::read_to_string(here.join("src/lib.rs")).unwrap();
    // Lines such as `dcp::DcpConfig, weights "dcp";`.
    let lines: Vec<(&str, &str)> = list
        .lines()
        .filter_map(|line| line.trim().split([',', ';']).next()?.split_once("::"))
        .filter(|(module, config)| !module.contains(' ') && config.ends_with("Config"))
        .collect();
    assert_eq!(lines.len(), srrf_baselines::BASELINES.len(), "{lines:?}");
    let mut files = Vec::new();
    for entry in fs::read_dir(here.join("..")).unwrap() {
        let folder = entry.unwrap().path().join("src");
        if folder.is_dir() {
            sources(&folder, &mut files);
        }
    }
    assert!(files.len() > 100, "the sources of the workspace");
    for (module, config) in lines {
        assert_eq!(list.matches(config).count(), 1, "{config} in lib.rs");
        let own = |path: &Path| {
            let inside = path.strip_prefix(here.join("../srrf-baselines/src")).ok();
            inside.is_some_and(|p| p.starts_with(module) || *p == *format!("{module}.rs") || *p == *"lib.rs")
        };
        let others: Vec<&PathBuf> = files
            .iter()
            .filter(|path| !own(path) && fs::read_to_string(path).unwrap().contains(config))
            .collect();
        assert!(others.is_empty(), "{config} is named in {others:?}");
    }
}
