//! `weights/LINEAGE.toml` against the files of the tree, the program, and the configurations of the headers.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use burn::tensor::Device;
use serde::Deserialize;
use sha2::{Digest, Sha256};
use srrf_model::weights::{from_safetensors, with_config};
use srrf_model::{SrrfConfig, embedded};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Lineage {
    weights: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    name: String,
    file: PathBuf,
    sha256: String,
    program: Option<String>,
    commit: String,
    configs: Vec<String>,
    commands: Vec<String>,
    code: String,
    #[serde(default)]
    parents: Vec<String>,
    header: Option<PathBuf>,
    note: Option<String>,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn lineage() -> Vec<Entry> {
    let text = std::fs::read_to_string(root().join("weights/LINEAGE.toml")).unwrap();
    toml::from_str::<Lineage>(&text).unwrap().weights
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

/// The weights below a folder, by their path from the root.
fn files(folder: &Path, found: &mut BTreeSet<PathBuf>) {
    for entry in std::fs::read_dir(root().join(folder)).unwrap() {
        let path = folder.join(entry.unwrap().file_name());
        if root().join(&path).is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|e| e == "safetensors") {
            found.insert(path);
        }
    }
}

#[test]
fn every_file_is_named_with_its_hash() {
    let lineage = lineage();
    let mut in_tree = BTreeSet::new();
    for folder in ["crates/srrf-model/weights", "crates/srrf-baselines/weights"] {
        files(Path::new(folder), &mut in_tree);
    }
    assert_eq!(lineage.iter().filter(|entry| entry.program.is_some()).count(), 10);
    for entry in &lineage {
        match std::fs::read(root().join(&entry.file)) {
            Ok(bytes) => assert_eq!(sha256(&bytes), entry.sha256, "{}", entry.name),
            // Those in no program may be fetched from the history.
            Err(_) => assert_eq!(entry.program, None, "{}", entry.name),
        }
        in_tree.remove(&entry.file);
    }
    assert!(in_tree.is_empty(), "not in LINEAGE.toml: {in_tree:?}");
}

#[test]
fn entries_name_where_they_come_from() {
    let lineage = lineage();
    let by_name: BTreeMap<&str, &Entry> = lineage.iter().map(|entry| (entry.name.as_str(), entry)).collect();
    assert_eq!(by_name.len(), lineage.len(), "a name twice");
    for entry in &lineage {
        for parent in &entry.parents {
            assert!(by_name.contains_key(parent.as_str()), "{}: {parent}", entry.name);
        }
        for config in &entry.configs {
            assert!(
                entry.commands.iter().any(|c| c.contains(config)),
                "{}: no command with {config}",
                entry.name
            );
        }
        assert!([&entry.commit, &entry.code].iter().all(|c| c.len() == 7), "{}", entry.name);
        assert!(entry.note.as_ref().is_none_or(|note| !note.is_empty()));
    }
    for model in embedded::MODELS {
        let entry = by_name[model.name];
        assert_eq!(entry.sha256, sha256(model.weights.bytes), "{}", model.name);
        assert_eq!(entry.header.is_some(), model.registers, "{}", model.name);
    }
}

/// The header of each model to register with is made of a configuration in the repository.
#[test]
fn headers_are_made_of_the_configurations_in_the_repository() {
    let device = Device::flex();
    for entry in lineage() {
        let Some(header) = entry.header else { continue };
        let config: SrrfConfig =
            toml::from_str(&std::fs::read_to_string(root().join(header)).unwrap()).unwrap();
        let bytes = embedded::model(&entry.name).unwrap().weights.bytes;
        let shipped = from_safetensors(bytes, &entry.name, &device).unwrap();
        assert_eq!(config, shipped.config, "{}", entry.name);

        // From another header back to this one: everything but the configuration is as before.
        let mut other = config.clone();
        (other.inference.passes, other.dense.tokens) = (1, 77);
        let changed = with_config(bytes, &entry.name, &other).unwrap();
        assert_eq!(from_safetensors(&changed, "changed", &device).unwrap().config, other);
        let back =
            from_safetensors(&with_config(&changed, "changed", &config).unwrap(), "back", &device).unwrap();
        assert_eq!(back.config, config);
        assert_eq!(back.name, shipped.name);
        let notes = |model: &srrf_model::weights::LoadedModel| {
            let mut notes = model.metadata.clone();
            notes.remove("srrf_config");
            notes
        };
        assert_eq!(notes(&back), notes(&shipped));
        let parameters = |model| srrf_model::weights::parameters(model).unwrap();
        assert_eq!(parameters(&back.model), parameters(&shipped.model));

        // Sizes of another network do not fit.
        let mut wider = config;
        wider.sem.skeleton_points += 1;
        assert!(with_config(bytes, &entry.name, &wider).unwrap_err().to_string().contains("sem.weights"));
    }
}
