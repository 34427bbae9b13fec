//! The configurations of the repository: what they resolve to, and the reference of their keys.
#![allow(clippy::panic, clippy::unwrap_used, reason = "helpers of tests")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::Value as Json;
use srrf_baselines::{BASELINES, BaselineVisitor, LearnedConfig, visit};
use srrf_model::SrrfConfig;
use srrf_train::config::{Keys, Layers, TrainConfig, key_reference, read_layers, read_sweep};
use srrf_train::nets::baseline::Baseline;
use srrf_train::{TrainError, Trained};

/// A configuration as version 0.1.0 had it, each in a file of its own, and where it is now: a file, or a run of a list.
#[derive(Deserialize)]
struct Before {
    was: String,
    now: String,
    config: Json,
}

fn root() -> PathBuf {
    Path::new(&std::env::var("CARGO_MANIFEST_DIR").unwrap()).join("../..").canonicalize().unwrap()
}

fn before() -> Vec<Before> {
    let text = std::fs::read_to_string(root().join("crates/srrf-train/tests/fixtures/configs-0.1.0.jsonl"));
    text.unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn layers(place: &str) -> Layers {
    read_layers(&root().join(place)).unwrap()
}

/// Does something with the method of a configuration, of which only the name is known.
trait WithMethod {
    fn with<C: Trained>(&self);

    fn of(&self, method: &str)
    where
        Self: Sized,
    {
        struct Visitor<'a, W>(&'a W);
        impl<W: WithMethod> BaselineVisitor for Visitor<'_, W> {
            type Output = ();
            fn visit<C: LearnedConfig + 'static>(self) {
                self.0.with::<Baseline<C>>();
            }
        }
        match method {
            SrrfConfig::METHOD => self.with::<SrrfConfig>(),
            other => visit(other, Visitor(self)).unwrap(),
        }
    }
}

struct IsAsBefore<'a>(&'a Before, Layers);

impl WithMethod for IsAsBefore<'_> {
    fn with<C: Trained>(&self) {
        let Self(before, layers) = self;
        let was: TrainConfig<C> = serde_json::from_value(before.config.clone()).unwrap();
        let is = TrainConfig::<C>::resolve(layers).unwrap_or_else(|e| panic!("{}: {e}", before.now));
        assert_eq!(is, was, "{} is not what {} was", before.now, before.was);
    }
}

#[test]
fn every_configuration_is_what_it_was() {
    let all = before();
    assert_eq!(all.len(), 34);
    for before in &all {
        let layers = layers(&before.now);
        let method = layers.method().unwrap();
        IsAsBefore(before, layers).of(&method);
    }
}

/// The `.toml` files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

#[test]
fn no_configuration_is_left_out() {
    let known: BTreeSet<String> = before().into_iter().map(|before| before.now).collect();
    let place = |path: &Path| path.strip_prefix(root()).unwrap().to_str().unwrap().to_string();
    let shared = ["configs/base.toml", "configs/modelnet-gpu.toml"];
    for path in files(&root().join("configs")) {
        let place = place(&path);
        assert!(
            known.contains(&place) || shared.contains(&place.as_str()),
            "{place} is compared with nothing"
        );
    }
    for path in files(&root().join("lab/sweeps")) {
        // Lists of other things than trainings have no runs.
        for run in read_sweep(&path).into_iter().flatten() {
            let place = format!("{}#{}", place(&path), run.name);
            assert!(known.contains(&place), "{place} is compared with nothing");
        }
    }
}

#[test]
fn a_shared_part_is_no_run() {
    let error = TrainConfig::<SrrfConfig>::read(&root().join("configs/base.toml")).unwrap_err();
    let error = TrainError::from(error);
    assert!(error.to_string().contains("base.toml") && error.is_bad_input(), "{error}");
}

/// The keys of a configuration, lists without the numbers of their entries.
fn keys_of(value: &toml::Value, at: &str, found: &mut BTreeSet<String>) {
    match value {
        toml::Value::Table(table) => {
            for (key, value) in table {
                let at = if at.is_empty() { key.clone() } else { format!("{at}.{key}") };
                found.insert(at.clone());
                keys_of(value, &at, found);
            }
        }
        toml::Value::Array(items) => items.iter().for_each(|item| keys_of(item, &format!("{at}[]"), found)),
        _ => {}
    }
}

/// Values for every key that a file may leave out, and each way of a choice once.
const REST: [&str; 2] = [
    "device = \"flex\"\nmethod = \"METHOD\"\nstart = \"srrf\"\npairs = { rotation = \"so3\" }\n\
     data = { path = \"p\" }\noptimizer = { momentum = 0.9 }\n",
    "start = { sem = \"srrf\" }\npairs = { rotation = { euler_axes = { max_deg = 30.0 } } }\n",
];
const REST_OF_SRRF: &str = "network.dense.matching = { normalise = true, sinkhorn = 2 }\n\
     network.skeleton.matching = { normalise = true, sinkhorn = 2 }\n\
     network.inference = { passes = 3, last_tokens = 9, last_matches = \"best\", prior = 0.1 }\n\
     losses = { registration = 0.5, matching = 0.5, fused = 0.5, skeleton.distribution_over_spread = 1.0 }\n";

/// A rule has keys of its own, so that it stands in the place of the one that a file has.
const RULES_OF_SRRF: [&str; 2] = [
    "test = \"mcnemar\"\nthreshold = 0.02\nstandard_errors = 4.0\n",
    "test = \"both_ways\"\ndense_threshold = 0.03\nskeleton_threshold = 0.03\nsharpness = 1.0\nskeleton_weight = 0.8\n",
];

/// So has a schedule.
const SCHEDULES: [&str; 2] = [
    "milestones = { at = [75.0, 150.0], of_epochs = 250.0, factor = 0.1 }\n",
    "cosine = { warmup = 0.03 }\n",
];

struct IsComplete(&'static str);

impl WithMethod for IsComplete {
    fn with<C: Trained>(&self) {
        let listed: Vec<String> = Keys::of::<C>().names().map(str::to_string).collect();
        let names: BTreeSet<String> = listed.iter().cloned().collect();
        // Ways of a choice that have keys in common are listed once.
        assert_eq!(names.len(), listed.len(), "a key is there twice: {listed:?}");
        let mut used = BTreeSet::new();
        for before in before() {
            let method = before.config.get("method").and_then(Json::as_str).unwrap_or(SrrfConfig::METHOD);
            if method != self.0 {
                continue;
            }
            let mut rest = REST.map(|text| text.replace("METHOD", self.0));
            if method == SrrfConfig::METHOD {
                rest[0].push_str(REST_OF_SRRF);
            }
            for ((rest, rule), schedule) in rest.iter().zip(RULES_OF_SRRF).zip(SCHEDULES) {
                let mut value = toml::Value::try_from(&before.config).unwrap();
                merge(&mut value, &toml::from_str(rest).unwrap());
                value["stages"][0]["schedule"] = toml::from_str(schedule).unwrap();
                if method == SrrfConfig::METHOD {
                    value["network"]["integration"] = toml::from_str(rule).unwrap();
                }
                let config: TrainConfig<C> = value.try_into().unwrap();
                keys_of(&toml::Value::try_from(&config).unwrap(), "", &mut used);
            }
        }
        // The names of the parts are the network's own.
        used.retain(|key| !key.starts_with("start."));
        let unlisted: Vec<_> = used.difference(&names).collect();
        assert!(unlisted.is_empty(), "{}: not in the reference: {unlisted:?}", self.0);
        let unused: Vec<_> = names.difference(&used).collect();
        assert!(unused.is_empty(), "{}: in the reference, and in no configuration: {unused:?}", self.0);
    }
}

fn merge(below: &mut toml::Value, above: &toml::Value) {
    match (below, above) {
        (toml::Value::Table(below), toml::Value::Table(above)) => {
            for (key, value) in above {
                match below.get_mut(key) {
                    Some(known) => merge(known, value),
                    None => drop(below.insert(key.clone(), value.clone())),
                }
            }
        }
        (below, above) => *below = above.clone(),
    }
}

#[test]
fn the_reference_of_keys_is_complete() {
    IsComplete(SrrfConfig::METHOD).of(SrrfConfig::METHOD);
    BASELINES.iter().for_each(|entry| IsComplete(entry.name).of(entry.name));
}

#[test]
fn the_page_of_keys_is_what_the_program_prints() {
    let path = root().join("book/src/generated/config-keys.md");
    let page = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        page == key_reference(),
        "write it anew: cargo run -p srrf-train -- keys > book/src/generated/config-keys.md"
    );
}
