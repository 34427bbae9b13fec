use srrf_corrupt::{CorruptionKind, PairConfig, Severity};

use super::*;
use crate::data;
use crate::protocol::{Protocol, SynthesizedPairs};

fn synthesized() -> SynthesizedPairs {
    let protocol = Protocol {
        clean: true,
        corruptions: vec![CorruptionKind::Background],
        mixtures: vec![],
        severities: vec![Severity::ALL[1]],
        shapes: 5,
        seed: 3,
        pair: PairConfig { points: 67, ..PairConfig::default() },
        crop: None,
        dcp_poses: false,
        spread: false,
    };
    SynthesizedPairs::new(data::procedural(5).unwrap(), protocol).unwrap()
}

#[test]
fn exported_pairs_are_read_back_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pairs.npz");
    let mut done = 0;
    export(&synthesized(), &path, &mut || done += 1).unwrap();
    assert_eq!(done, 10);
    let file = PairFile::read(&path, &ReadOptions::default()).unwrap();
    let names: Vec<String> = file.groups().iter().map(Group::name).collect();
    assert_eq!(names, ["clean", "background_s2"]);
    assert!(file.has_oracle());
    for group in 0..2 {
        for item in 0..5 {
            let (a, b) = (file.pair(group, item).unwrap(), synthesized().pair(group, item).unwrap());
            assert_eq!(a.pair.source, b.pair.source);
            assert_eq!(a.pair.target, b.pair.target);
            assert_eq!(a.pair.source_origin, b.pair.source_origin);
            assert_eq!(a.pair.target_origin, b.pair.target_origin);
            assert_eq!(a.pair.symmetric, b.pair.symmetric);
            assert_eq!(a.clean, b.clean);
            assert_eq!(a.pair.target_from_source.translation, b.pair.target_from_source.translation);
            // The rotation is brought back to SO(3), which may change the last digit.
            let difference = a.pair.target_from_source.rotation - b.pair.target_from_source.rotation;
            assert!(difference.abs().max() < 1e-14);
        }
    }
}

/// Writes a file of one good group `g` of 2 pairs with 4 and 5 points, changed by `change`.
fn message(change: impl Fn(&mut BTreeMap<&'static str, (Vec<usize>, Vec<f64>)>)) -> String {
    let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let mut arrays: BTreeMap<&'static str, (Vec<usize>, Vec<f64>)> = [
        ("g_x", (vec![2, 4, 3], vec![0.5; 24])),
        ("g_y", (vec![2, 5, 3], vec![0.5; 30])),
        ("g_R", (vec![2, 3, 3], identity.repeat(2))),
        ("g_t", (vec![2, 3], vec![0.0; 6])),
    ]
    .into();
    change(&mut arrays);
    let file = tempfile::Builder::new().suffix("bad.npz").tempfile().unwrap();
    let mut npz = NpzWriter::new(file.reopen().unwrap());
    for (name, (shape, values)) in &arrays {
        npz.array(name, shape, values).unwrap();
    }
    npz.finish().unwrap();
    match PairFile::read(file.path(), &ReadOptions::default()) {
        Ok(file) => file.description(),
        Err(error) => {
            let text = error.to_string();
            assert!(text.contains("bad.npz"), "{text}");
            text
        }
    }
}

#[test]
fn bad_arrays_are_named_with_the_fact() {
    assert!(message(|_| ()).contains("2 pairs in 1 group,"));
    let text = message(|a| drop(a.remove("g_t")));
    assert!(text.contains("array g_t: is missing; expected shape [2, 3]"), "{text}");
    let text = message(|a| drop(a.insert("g_y", (vec![3, 5, 3], vec![0.5; 45]))));
    assert!(text.contains("array g_y: has shape [3, 5, 3], expected [2, any, 3]"), "{text}");
    let text = message(|a| a.get_mut("g_x").unwrap().1[13] = f64::NAN);
    assert!(text.contains("array g_x: pair 1 holds NaN"), "{text}");
    let text = message(|a| drop(a.insert("g_x", (vec![2, 0, 3], vec![]))));
    assert!(text.contains("array g_x: has shape [2, 0, 3]: it is empty"), "{text}");
    let text = message(|a| a.get_mut("g_R").unwrap().1[0] = -1.0);
    assert!(text.contains("array g_R: pair 0 is not a rotation"), "{text}");
    let text = message(|a| {
        a.clear();
        a.insert("source", (vec![1], vec![0.0]));
    });
    assert!(text.contains("<group>_x") && text.contains("[\"source\"]"), "{text}");
}

/// A file that would take more than is allowed is refused before its arrays are unpacked.
#[test]
fn memory_is_bounded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pairs.npz");
    export(&synthesized(), &path, &mut || ()).unwrap();
    let limited = |bytes| ReadOptions { max_memory: Some(bytes), ..ReadOptions::default() };
    let error = PairFile::read(&path, &limited(2_000)).unwrap_err().to_string();
    assert!(error.contains("pairs.npz") && error.contains("2.0 kB are allowed"), "{error}");
    assert!(error.contains("--max-memory"), "{error}");
    PairFile::read(&path, &limited(2_000_000)).unwrap();
}
