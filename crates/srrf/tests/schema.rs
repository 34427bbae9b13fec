//! The JSON of the programs follows the JSON Schema in the repository, and the book names each of its keys.

#![allow(clippy::unwrap_used, reason = "a test may fail loudly")]

mod common;

use std::collections::BTreeSet;
use std::path::PathBuf;

use common::{Scene, json, lines};
use serde_json::Value;
use srrf::answer_schema;

fn repository(path: &str) -> PathBuf {
    PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").unwrap()).join("../..").join(path)
}

const SCHEMA: &str = "schemas/srrf-register-1.schema.json";

fn written() -> String {
    format!("{:#}\n", answer_schema().as_value())
}

#[test]
#[ignore = "writes the schema into the repository"]
fn write_schema() {
    std::fs::write(repository(SCHEMA), written()).unwrap();
}

#[test]
fn the_schema_in_the_repository_is_that_of_the_types() {
    let there = std::fs::read_to_string(repository(SCHEMA)).unwrap();
    assert!(there == written(), "write it anew: cargo test -p srrf --test schema -- --ignored");
}

/// Every key of the schema, in any of its parts.
fn keys(schema: &Value, found: &mut BTreeSet<String>) {
    match schema {
        Value::Object(map) => {
            let properties = map.get("properties").and_then(Value::as_object);
            found.extend(properties.into_iter().flat_map(|p| p.keys().cloned()));
            map.values().for_each(|value| keys(value, found));
        }
        Value::Array(list) => list.iter().for_each(|value| keys(value, found)),
        _ => {}
    }
}

#[test]
fn the_book_names_every_key() {
    let pages = ["book/src/use/json.md", "book/src/use/batch.md"]
        .map(|page| std::fs::read_to_string(repository(page)).unwrap());
    let mut found = BTreeSet::new();
    keys(answer_schema().as_value(), &mut found);
    assert!(found.len() > 40, "{found:?}");
    let named = |key: &str| pages.iter().any(|page| page.contains(&format!("`{key}`")));
    let missing: Vec<&String> = found.iter().filter(|key| !named(key)).collect();
    assert!(missing.is_empty(), "not in the book: {missing:?}");
}

#[test]
fn answers_follow_the_schema() {
    let schema: Value = json(&repository(SCHEMA));
    let validator = jsonschema::validator_for(&schema).unwrap();
    let check = |value: &Value| {
        let wrong: Vec<String> = validator.iter_errors(value).map(|e| e.to_string()).collect();
        assert!(wrong.is_empty(), "{wrong:?}");
    };
    let scene = Scene::new(400);
    scene.file("first.txt", "1 0 0 2.5\n0 1 0 -1.25\n0 0 1 0.75\n0 0 0 1\n");
    scene.file("pairs.csv", "source,target,initial\nsource.ply,target.ply,first.txt\nsource.ply,gone.ply,\n");
    for (name, more) in [
        ("auto.json", &["--method", "auto"][..]),
        ("icp.json", &["--method", "icp", "--no-refine"]),
        ("given.json", &["--method", "given", "--initial", "first.txt"]),
    ] {
        scene.srrf(&[&["register", "source.ply", "target.ply", "--json", name], more].concat()).ok();
        let answer = json(&scene.path(name));
        assert_eq!((&answer["schema"], &answer["target"]), (&"srrf-register/1".into(), &"target.ply".into()));
        check(&answer);
        // A key that nobody knows, a probability that is none, a pose that is no matrix.
        let rejected = |key: &str, value: Value| {
            let mut other = answer.clone();
            other[key] = value;
            assert!(!validator.is_valid(&other), "{key}");
        };
        rejected("unknown", 1.into());
        rejected("probability", 1.5.into());
        rejected("target_from_source", vec![1.0, 0.0].into());
        rejected("schema", "srrf-register/0".into());
    }
    let done = scene.srrf(&["batch", "pairs.csv", "-o", "r.jsonl", "--method", "icp"]);
    assert_eq!(done.code, 1, "{done:?}");
    let rows = lines(&scene.read("r.jsonl"));
    assert_eq!(rows.len(), 2);
    assert!(rows[0]["abstain"].is_boolean() && rows[1]["error"].is_string());
    rows.iter().for_each(check);
}
