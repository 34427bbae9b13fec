//! Weights on disk: what comes back, and what is said about files that are broken.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use std::collections::{BTreeMap, HashMap};
use std::error::Error;
use std::path::Path;

use burn::tensor::Device;
use common::{ratios, tiny};
use half::f16;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use srrf_model::weights::{
    WeightsError, from_safetensors, load, parameters, to_safetensors, with_parameters, write_atomically,
};
use srrf_model::{BranchRatios, IntegrationRule, McNemar, Srrf, SrrfConfig, init};

fn model() -> Srrf {
    init::seeded(tiny().init(&Device::flex()), 9)
}

fn bytes() -> Vec<u8> {
    let notes = BTreeMap::from([("data".to_string(), "made here".to_string())]);
    to_safetensors(&model(), &tiny(), "tiny", &notes).unwrap()
}

fn read(bytes: &[u8]) -> Result<srrf_model::weights::LoadedModel, WeightsError> {
    from_safetensors(bytes, "memory", &Device::flex())
}

/// The tensors of a file with their header, changed and written again.
fn rewritten(
    change: impl Fn(&mut BTreeMap<String, (Dtype, Vec<usize>, Vec<u8>)>, &mut HashMap<String, String>),
) -> Vec<u8> {
    let bytes = bytes();
    let (_, header) = SafeTensors::read_metadata(&bytes).unwrap();
    let mut metadata = header.metadata().clone().unwrap();
    let mut tensors = BTreeMap::new();
    for (name, view) in SafeTensors::deserialize(&bytes).unwrap().tensors() {
        tensors.insert(name, (view.dtype(), view.shape().to_vec(), view.data().to_vec()));
    }
    change(&mut tensors, &mut metadata);
    let views = tensors.iter().map(|(name, (dtype, shape, data))| {
        (name.as_str(), TensorView::new(*dtype, shape.clone(), data).unwrap())
    });
    safetensors::serialize(views, Some(metadata)).unwrap()
}

#[test]
fn a_network_comes_back_in_half_precision() {
    let loaded = read(&bytes()).unwrap();
    assert_eq!((loaded.name.as_str(), &loaded.config), ("tiny", &tiny()));
    assert_eq!(loaded.metadata["data"], "made here");
    assert!(loaded.sha256.len() == 64 && loaded.sha256.bytes().all(|b| b.is_ascii_hexdigit()));
    let (wanted, found) = (parameters(&model()).unwrap(), parameters(&loaded.model).unwrap());
    assert_eq!(wanted.len(), found.len());
    for (name, (shape, values)) in wanted {
        let rounded: Vec<f32> = values.iter().map(|&v| f16::from_f32(v).to_f32()).collect();
        assert_eq!(found[&name], (shape, rounded), "{name}");
    }
    // What was rounded once is kept: the second file equals the first.
    let notes = BTreeMap::from([("data".to_string(), "made here".to_string())]);
    let again = to_safetensors(&loaded.model, &loaded.config, "tiny", &notes).unwrap();
    assert_eq!(read(&again).unwrap().metadata, loaded.metadata);
    assert_eq!(parameters(&read(&again).unwrap().model).unwrap(), parameters(&loaded.model).unwrap());
}

#[test]
fn single_precision_is_read_too() {
    let name = "dense.pfi.squeeze.bias";
    let single = rewritten(|tensors, _| {
        let (_, shape, _) = tensors[name].clone();
        let data = (0..shape[0]).flat_map(|i| (i as f32 / 3.0).to_le_bytes()).collect();
        tensors.insert(name.into(), (Dtype::F32, shape, data));
    });
    let (_, values) = &parameters(&read(&single).unwrap().model).unwrap()[name];
    assert_eq!(values[1], 1.0 / 3.0);
}

#[test]
fn parameters_can_be_replaced_by_path() {
    let mut changed = parameters(&model()).unwrap();
    changed.values_mut().for_each(|(_, values)| values.iter_mut().for_each(|v| *v += 1.0));
    let other = with_parameters(model(), changed.clone()).unwrap();
    assert_eq!(parameters(&other).unwrap(), changed);
}

#[test]
fn broken_files_are_named() {
    let whole = bytes();
    for length in [0, 1, 7, 8, 100, whole.len() / 2, whole.len() - 1] {
        let error = read(&whole[..length]).unwrap_err();
        assert!(matches!(&error, WeightsError::Format { .. }), "{length} bytes: {error:?}");
        assert!(error.to_string().starts_with("memory: ") && error.source().is_some());
    }
    for text in [b"solid cube\nfacet normal 0 0 1\n".as_slice(), &[0xff; 64], &[0; 64]] {
        assert!(matches!(read(text), Err(WeightsError::Format { .. })));
    }
}

#[test]
fn equal_weights_have_equal_bytes() {
    let first = bytes();
    assert!((0..5).all(|_| bytes() == first));
}

/// Nothing is built with sizes that only a header claims: they would take terabytes.
#[test]
fn sizes_in_a_header_are_checked_before_they_are_believed() {
    type Change = fn(&mut SrrfConfig);
    let of_range: [(&str, Change); 4] = [
        ("dense.sfe.width", |c| c.dense.sfe.width = 1 << 50),
        ("skeleton.sfe.layers", |c| c.skeleton.sfe.layers = 1 << 40),
        ("dense.tokens", |c| c.dense.tokens = 1 << 60),
        ("sem.levels[0].widths[0]", |c| c.sem.levels[0].widths[0] = 1 << 40),
    ];
    let with = |change: Change| {
        rewritten(|_, header| {
            let mut config = tiny();
            change(&mut config);
            header.insert("srrf_config".into(), serde_json::to_string(&config).unwrap());
        })
    };
    for (key, change) in of_range {
        match read(&with(change)) {
            Err(WeightsError::Header { why, .. }) => assert!(why.contains(key), "{why}"),
            other => panic!("{key}: {other:?}"),
        }
    }
    // In their ranges, and far beyond what the file holds: 64 layers of 8,192 channels.
    let wide = with(|c| {
        let sfe = &mut c.dense.sfe;
        (sfe.width, sfe.mlp, sfe.layers, sfe.heads) = (8192, 8192, 64, 1);
        c.dense.pfi.heads = 1;
    });
    assert!(matches!(read(&wide), Err(WeightsError::Parameter { .. })));
}

#[test]
fn weights_of_another_architecture_are_named() {
    let message = |bytes: &[u8]| match read(bytes) {
        Err(error @ WeightsError::Parameter { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    };
    // The header describes wider features than the tensors have.
    let wider = rewritten(|_, header| {
        let mut config = tiny();
        config.skeleton.pfi.feed_forward = 21;
        header.insert("srrf_config".into(), serde_json::to_string(&config).unwrap());
    });
    let said = message(&wider);
    assert!(
        said.contains("skeleton.pfi") && said.contains("shape") && said.contains("another architecture"),
        "{said}"
    );

    let name = "sem.global.weight";
    let without = rewritten(|tensors, _| drop(tensors.remove(name)));
    let said = message(&without);
    assert!(said.contains(name) && said.contains("missing"), "{said}");

    let with_more = rewritten(|tensors, _| {
        tensors.insert("sem.extra".into(), (Dtype::F16, vec![1], vec![0, 0]));
    });
    let said = message(&with_more);
    assert!(said.contains("sem.extra") && said.contains("no such parameter"), "{said}");

    let whole_numbers = rewritten(|tensors, _| {
        let (_, shape, data) = tensors[name].clone();
        tensors.insert(name.into(), (Dtype::I16, shape, data));
    });
    let said = message(&whole_numbers);
    assert!(said.contains(name) && said.contains("I16"), "{said}");
}

#[test]
fn files_of_other_programs_are_named() {
    let said = |bytes: &[u8]| match read(bytes) {
        Err(error @ WeightsError::Header { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    };
    let nameless = rewritten(|_, header| drop(header.remove("srrf_config")));
    assert!(said(&nameless).contains("the entry is missing"));
    let unknown = rewritten(|_, header| {
        let config = header["srrf_config"].replacen("\"sem\"", "\"encoder\"", 1);
        header.insert("srrf_config".into(), config);
    });
    assert!(said(&unknown).contains("encoder"));
    // Sizes that no network can have are found before one is built.
    type Change = fn(&mut SrrfConfig);
    let changes: [(&str, Change); 10] = [
        ("dense.sfe.heads", |c| c.dense.sfe.heads = 0),
        ("skeleton.pfi.heads", |c| c.skeleton.pfi.heads = 7),
        ("skeleton.sfe.layers", |c| c.skeleton.sfe.layers = 0),
        ("sem.levels", |c| c.sem.levels.clear()),
        ("sem.levels[1].widths[1]", |c| c.sem.levels[1].widths = vec![13, 0]),
        ("sem.skeleton_points", |c| c.sem.skeleton_points = 2),
        ("inference.passes", |c| c.inference.passes = 0),
        ("inference.prior", |c| c.inference.prior = Some(0.0)),
        ("integration.skeleton_weight", |c| {
            c.integration =
                IntegrationRule::Nearest(BranchRatios { skeleton_weight: -1.0, ..ratios(0.1, 0.2) });
        }),
        ("integration.standard_errors", |c| {
            c.integration = IntegrationRule::McNemar(McNemar { threshold: 0.1, standard_errors: -3.0 });
        }),
    ];
    for (key, change) in changes {
        let impossible = rewritten(|_, header| {
            let mut config = tiny();
            change(&mut config);
            header.insert("srrf_config".into(), serde_json::to_string(&config).unwrap());
        });
        assert!(said(&impossible).contains(&format!("`{key}`")), "{}", said(&impossible));
    }
    let no_json = rewritten(|_, header| drop(header.insert("srrf_config".into(), "{".into())));
    assert!(said(&no_json).contains("srrf_config"));
}

#[test]
fn files_that_cannot_be_read_or_written_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let said = |path: &Path| match load(path, &Device::flex()) {
        Err(error @ WeightsError::Io { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    };
    let missing = folder.path().join("missing.safetensors");
    assert!(said(&missing).contains("missing.safetensors"));
    assert!(said(folder.path()).contains(&folder.path().display().to_string()));

    let path = folder.path().join("model.safetensors");
    write_atomically(&path, &bytes()).unwrap();
    assert_eq!(load(&path, &Device::flex()).unwrap().name, "tiny");
    write_atomically(&path, b"short").unwrap();
    let error = load(&path, &Device::flex()).unwrap_err();
    assert!(error.to_string().contains("model.safetensors"), "{error}");

    let nowhere = folder.path().join("no/such/folder.safetensors");
    let error = write_atomically(&nowhere, b"x").unwrap_err();
    assert!(matches!(&error, WeightsError::Io { path, .. } if *path == nowhere));
    // Only the file itself is left behind.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}
