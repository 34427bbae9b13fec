//! The learned baselines in the loop: their configurations, and a run in two sessions.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use burn::tensor::Device;
use srrf_baselines::{DcpConfig, EquiGsprConfig, LearnedConfig, PanetConfig, PointNetLkConfig, RgmConfig};
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_model::weights::{parameters, read};
use srrf_model::{NetworkConfig, SrrfConfig};
use srrf_train::config::{ConfigError, Layers, TrainConfig};
use srrf_train::nets::baseline::Baseline;
use srrf_train::run::run;
use srrf_train::{Existing, RunOptions};

/// Bytes that the weights of a method may take.
const MOST_BYTES: usize = 8_000_000;

fn method_of(path: &Path) -> String {
    Layers::read(path).unwrap().method().unwrap()
}

fn configs() -> PathBuf {
    Path::new(&std::env::var("CARGO_MANIFEST_DIR").unwrap()).join("../../configs")
}

/// The configuration that trains `name` has the pairs and the validation of one of SRRF's, and weights that are not too many.
fn belongs<C: LearnedConfig>(name: &str, file: &str, srrf: &str) {
    let path = configs().join(format!("baselines/{file}.toml"));
    assert_eq!(method_of(&path), C::NAME);
    let ours = TrainConfig::<Baseline<C>>::read(&path).unwrap();
    let srrf = <TrainConfig>::read(&configs().join("../lab/sweeps").join(srrf)).unwrap();
    assert_eq!((&ours.name, ours.seed), (&name.to_string(), srrf.seed));
    assert_eq!((&ours.data, &ours.draw, &ours.pairs), (&srrf.data, &srrf.draw, &srrf.pairs), "{name}");
    assert_eq!(ours.keep, srrf.keep, "{name}");
    let network = ours.network.init(&Device::flex());
    let bytes: usize = parameters(&network).unwrap().values().map(|(_, values)| 2 * values.len()).sum();
    assert!(bytes < MOST_BYTES, "{name}: {bytes}");
}

#[test]
fn every_configuration_has_the_pairs_of_srrf() {
    let first = "srrf-small.toml#modelnet-small-2";
    belongs::<DcpConfig>("dcp", "dcp", first);
    belongs::<DcpConfig>("dcp-v1", "dcp-v1", first);
    belongs::<PointNetLkConfig>("pointnetlk", "pointnetlk", first);
    belongs::<RgmConfig>("rgm", "rgm", first);
    belongs::<RgmConfig>("rgm", "rgm-2", "equal.toml#modelnet-equal-2");
    belongs::<PanetConfig>("panet", "panet", first);
    belongs::<EquiGsprConfig>("equi-gspr", "equi-gspr", first);
    assert_eq!(std::fs::read_dir(configs().join("baselines")).unwrap().count(), 7);
    assert_eq!(method_of(&configs().join("smoke.toml")), "srrf");
}

/// The smoke configuration with DCP in the place of SRRF.
fn smoke() -> String {
    let text = std::fs::read_to_string(configs().join("smoke.toml")).unwrap();
    let (head, tail) = (text.find("[network.sem]").unwrap(), text.find("[optimizer]").unwrap());
    let network = "[network]\nversion = \"v2\"\ntokens = 24\nneighbours = 5\nwidths = [8, 12]\nwidth = 16\n\
                   heads = 2\nfeed_forward = 20\n[losses]\nregistration = 1.0\n";
    let stages = "[[stages]]\nname = \"all\"\nepochs = 1.6\nlearning_rate = 1e-3\n\
                  schedule = { cosine = { warmup = 0.2 } }\n";
    let optimizer = &text[tail..text.find("[[stages]]").unwrap()];
    let optimizer = optimizer.replace("kind = \"adam\"", "kind = \"sgd\"\nmomentum = 0.9");
    let keep = &text[text.find("[keep]").unwrap()..];
    format!("method = \"dcp\"\n{}{network}{optimizer}{stages}{keep}", &text[..head])
}

#[test]
fn a_run_in_two_sessions_gives_the_same_weights() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dcp.toml");
    std::fs::write(&path, smoke()).unwrap();
    let config = TrainConfig::<Baseline<DcpConfig>>::read(&path).unwrap();
    let go = |name: &str, threads: usize, until_step: Option<usize>| {
        let options = RunOptions {
            folder: folder.path().join(name),
            threads,
            existing: Existing::Resume,
            until_step,
            time_limit: None,
            say: |_| {},
        };
        let shapes = ProceduralShapes::new(config.seed, config.data.shapes, None).unwrap();
        run(&config, &options, Box::new(shapes), vec![Device::flex()], &AtomicBool::new(false)).unwrap()
    };
    assert!(!go("two", 1, Some(3)).complete);
    assert_eq!((go("two", 2, None).step, go("one", 1, None).step), (8, 8));
    let weights = |name: &str| {
        let file = folder.path().join(name).join("last.safetensors");
        let loaded = read::<DcpConfig>(&file, &Device::flex()).unwrap();
        assert_eq!(loaded.config, config.network.0);
        parameters(&loaded.model).unwrap()
    };
    let (one, two) = (weights("one"), weights("two"));
    assert!(one == two, "sessions and threads change nothing");
    let start =
        parameters(&srrf_model::init::seeded(config.network.init(&Device::flex()), config.seed)).unwrap();
    assert!(one != start);
    for file in ["config.toml", "metrics.jsonl", "curve.svg", "best.safetensors"] {
        assert!(folder.path().join("one").join(file).exists(), "{file}");
    }
    // The resolved configuration is one that can be read again.
    let resolved = folder.path().join("one/config.toml");
    assert_eq!(TrainConfig::<Baseline<DcpConfig>>::read(&resolved).unwrap(), config);
}

#[test]
fn what_does_not_belong_is_refused_by_key() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |text: String| -> String {
        let path = folder.path().join("wrong.toml");
        std::fs::write(&path, text).unwrap();
        let error = TrainConfig::<Baseline<DcpConfig>>::read(&path).unwrap_err();
        match error {
            ConfigError::Value { key, .. } => key,
            other => other.to_string(),
        }
    };
    assert_eq!(refused(smoke().replace("method = \"dcp\"", "method = \"rgm\"")), "method");
    assert_eq!(refused(smoke().replace("heads = 2", "heads = 3")), "network.heads");
    assert_eq!(
        refused(smoke().replace("name = \"all\"", "name = \"all\"\nsem = \"chamfer\"")),
        "stages[0].sem"
    );
    assert_eq!(
        refused(smoke().replace("name = \"all\"", "name = \"all\"\nregistration = false")),
        "stages[0].registration"
    );
    assert!(refused(smoke().replace("heads = 2", "heads = 2\nears = 2")).contains("`ears`"));
    let path = folder.path().join("dcp.toml");
    std::fs::write(&path, smoke()).unwrap();
    assert!(TrainConfig::<SrrfConfig>::read(&path).is_err());
}
