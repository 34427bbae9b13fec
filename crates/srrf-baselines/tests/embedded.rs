//! The trained weights in the program: each loads under its name, and answers better than the identity does on
//! shapes that it has never seen.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use burn::tensor::Device;
use srrf_baselines::{BASELINES, BaselineVisitor, LearnedConfig, LearnedRegister, embedded, visit};
use srrf_cloud::Register;
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::{Pair, PairConfig, PairSynthesizer, PoseDraw, Stream};
use srrf_model::weights::parse;

const PAIRS: u64 = 12;

fn pairs() -> Vec<Pair> {
    let shapes = ProceduralShapes::new(11, PAIRS as usize, None).unwrap();
    let synthesizer = PairSynthesizer::new(PairConfig::default()).unwrap();
    let clean = |item: u64| {
        synthesizer.pair(&shapes, item as usize, None, PoseDraw::Seeded, Stream { seed: 5, item }).unwrap()
    };
    (0..PAIRS).map(clean).collect()
}

/// The middle angle that a method leaves of what the identity leaves.
fn middle_share<C: LearnedConfig>() -> f64 {
    let bytes = embedded(C::NAME).unwrap();
    assert!(bytes.len() < 8_000_000, "{}: {} bytes", C::NAME, bytes.len());
    let device = Device::flex();
    let loaded = parse::<C>(bytes, C::NAME, &device).unwrap();
    assert_eq!(loaded.name, C::NAME);
    let method = LearnedRegister::new(loaded, device);
    let mut shares: Vec<f64> = pairs()
        .iter()
        .map(|pair| {
            let truth = &pair.target_from_source;
            let found = method.register(&pair.source, &pair.target).unwrap().target_from_source;
            found.angle_to_deg(truth) / srrf_cloud::Rigid::identity().angle_to_deg(truth)
        })
        .collect();
    shares.sort_by(f64::total_cmp);
    shares[shares.len() / 2]
}

struct MiddleShare;

impl BaselineVisitor for MiddleShare {
    type Output = f64;

    fn visit<C: LearnedConfig + 'static>(self) -> f64 {
        middle_share::<C>()
    }
}

#[test]
fn every_embedded_baseline_loads_and_helps() {
    for entry in BASELINES {
        let weights = entry.weights.unwrap();
        assert!(weights.card.contains(entry.name), "the card of {}", entry.name);
        let share = visit(entry.name, MiddleShare).unwrap();
        assert!(share < 0.8, "{}: {share}", entry.name);
    }
    assert!(embedded("icp").is_none() && visit("icp", MiddleShare).is_none());
}

#[test]
fn names_differ() {
    let names: std::collections::BTreeSet<&str> = BASELINES.iter().map(|entry| entry.name).collect();
    assert_eq!(names.len(), BASELINES.len());
}
