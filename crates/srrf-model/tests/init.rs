//! Initial weights: the same bytes for the same seed, and what the distribution promises.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use std::collections::HashSet;

use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{Device, Tensor};
use common::tiny;
use srrf_model::weights::parameters;
use srrf_model::{Srrf, init};

fn seeded(seed: u64) -> Srrf {
    init::seeded(tiny().init(&Device::flex()), seed)
}

fn ids(model: &Srrf) -> Vec<u64> {
    struct Ids(Vec<u64>);
    impl ModuleVisitor for Ids {
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            self.0.push(param.id.val());
        }
    }
    let mut visitor = Ids(Vec::new());
    model.visit(&mut visitor);
    visitor.0
}

#[test]
fn weights_depend_on_the_seed_alone() {
    let bits = |model: &Srrf| -> Vec<(String, Vec<u32>)> {
        let found = parameters(model).unwrap().into_iter();
        found.map(|(name, (_, values))| (name, values.iter().map(|v| v.to_bits()).collect())).collect()
    };
    let first = bits(&seeded(7));
    assert_eq!(first, bits(&seeded(7)));
    // Also where lazy parameters were woken up before, in another order, or live on a graph.
    let woken = tiny().init(&Device::flex());
    let _ = (parameters(&woken.skeleton).unwrap(), parameters(&woken.sem).unwrap());
    assert_eq!(first, bits(&init::seeded(woken, 7)));
    assert_eq!(first, bits(&init::seeded(tiny().init(&Device::flex().autodiff()), 7)));

    let other = bits(&seeded(8));
    for ((name, a), (_, b)) in first.iter().zip(&other) {
        let constant = name.contains("norm") || name.ends_with("log_sharpness");
        assert_eq!(a == b, constant, "{name}");
    }
}

#[test]
fn parameters_have_their_own_numbers() {
    let found = ids(&seeded(7));
    assert_eq!(found.len(), parameters(&seeded(7)).unwrap().len());
    assert_eq!(found.iter().collect::<HashSet<_>>().len(), found.len());
    assert_eq!(found, ids(&seeded(8)), "an optimizer finds its parameters again");
}

#[test]
fn linear_layers_are_uniform_within_the_root_of_their_inputs() {
    for (name, (shape, values)) in parameters(&seeded(7)).unwrap() {
        if name.contains("norm") || name.ends_with("log_sharpness") {
            let constant = if name.ends_with("gamma") { 1.0 } else { 0.0 };
            assert!(values.iter().all(|&v| v == constant), "{name}");
        } else if name.ends_with("weight") {
            let bound = 1.0 / (shape[0] as f32).sqrt();
            let most = values.iter().fold(0.0_f32, |most, v| most.max(v.abs()));
            assert!(most <= bound && most > 0.7 * bound, "{name}: {most} of {bound}");
            let mean = values.iter().sum::<f32>() / values.len() as f32;
            // Five standard errors of the mean of a uniform distribution.
            assert!(mean.abs() < 5.0 * bound / (3.0 * values.len() as f32).sqrt(), "{name}: {mean}");
        }
    }
}
