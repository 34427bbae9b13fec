//! The gradient stop between SEM and registration: neither loss moves the other's parameters.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use burn::module::{Module, ModuleVisitor, Param};
use burn::optim::{AdamConfig, GradientsParams};
use burn::tensor::{Device, Tensor};
use common::{Numbers, row_major, tensor, tiny};
use srrf_model::weights::parameters;
use srrf_model::{
    SkeletonLossConfig, Srrf, SrrfOutput, correspondence_loss, init, registration_loss, skeleton_loss,
};

const BATCH: usize = 3;
const POINTS: usize = 61;

/// The network on the graph, its output on a drawn batch, and the batch with its true poses.
struct Case {
    model: Srrf,
    output: SrrfOutput,
    source: Tensor<3>,
    target: Tensor<3>,
    rotation: Tensor<3>,
    translation: Tensor<2>,
}

fn case() -> Case {
    let device = Device::flex();
    let config = tiny();
    let model = init::seeded(config.init(&device), 5).train();
    let mut numbers = Numbers(11);
    let cloud = numbers.many(BATCH * POINTS * 3);
    let source = tensor(&cloud, [BATCH, POINTS, 3], &device);
    let rotations: Vec<f64> = (0..BATCH).flat_map(|_| row_major(&numbers.rotation(45.0))).collect();
    let rotation = tensor(&rotations, [BATCH, 3, 3], &device);
    let translation = tensor(&numbers.many(BATCH * 3), [BATCH, 3], &device);
    let target = srrf_model::transform(source.clone(), rotation.clone(), translation.clone());
    let output = model.forward(&config.integration, source.clone(), target.clone(), 0.5).unwrap();
    Case { model, output, source, target, rotation, translation }
}

impl Case {
    /// Every registration loss: both branches, their correspondences, the fused pose.
    fn registration(&self) -> Tensor<1> {
        let pose = |r: &Tensor<3>, t: &Tensor<2>| {
            registration_loss(r.clone(), t.clone(), self.rotation.clone(), self.translation.clone())
        };
        let branches = [&self.output.dense, &self.output.skeleton].map(|branch| {
            let (points, matches) = (branch.source_points.clone(), branch.matches.clone());
            pose(&branch.rotation, &branch.translation)
                + correspondence_loss(points, matches, self.rotation.clone(), self.translation.clone())
        });
        let [dense, skeleton] = branches;
        dense + skeleton + pose(&self.output.fused.rotation, &self.output.fused.translation)
    }

    fn skeleton(&self) -> Tensor<1> {
        let config = SkeletonLossConfig {
            point_to_sphere: 0.3,
            radius: 0.4,
            distribution: 1.0,
            distribution_over_spread: 1.0,
            index_match: 1.0,
        };
        let source = (self.source.clone(), &self.output.source_skeleton);
        let target = (self.target.clone(), &self.output.target_skeleton);
        skeleton_loss(&config, source, target, self.rotation.clone(), self.translation.clone()).unwrap().total
    }
}

/// Paths of the parameters that have a gradient other than 0.
fn moved<M: Module>(module: &M, grads: &GradientsParams) -> Vec<String> {
    struct Moved<'a>(&'a GradientsParams, Vec<String>, Vec<String>);
    impl ModuleVisitor for Moved<'_> {
        fn enter_module(&mut self, name: &str, _container_type: &str) {
            self.1.push(name.to_string());
        }
        fn exit_module(&mut self, _name: &str, _container_type: &str) {
            self.1.pop();
        }
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            if let Some(gradient) = self.0.get::<D>(param.id)
                && common::values(&gradient).iter().any(|&v| v != 0.0)
            {
                self.2.push(self.1.join("."));
            }
        }
    }
    let mut visitor = Moved(grads, Vec::new(), Vec::new());
    module.visit(&mut visitor);
    visitor.2
}

/// Parameters that one Adam step on these gradients changes.
fn changed_by_a_step(model: &Srrf, grads: GradientsParams) -> Vec<String> {
    let before = parameters(model).unwrap();
    let after = parameters(&AdamConfig::new().init().step(0.1, model.clone(), grads)).unwrap();
    before.into_iter().filter(|(name, values)| after[name] != *values).map(|(name, _)| name).collect()
}

#[test]
fn registration_loss_moves_no_parameter_of_the_skeleton_module() {
    let case = case();
    let grads = GradientsParams::from_grads(case.registration().backward(), &case.model);
    assert_eq!(moved(&case.model.sem, &grads), [""; 0]);
    // Both branches learn: every parameter has a gradient, whatever its size.
    for (name, module) in [("dense", &case.model.dense), ("skeleton", &case.model.skeleton)] {
        let (moved, all) = (moved(module, &grads), parameters(module).unwrap());
        let still: Vec<_> = all.keys().filter(|name| !moved.contains(name)).collect();
        assert!(still.is_empty(), "{name}: {still:?}");
    }
    let changed = changed_by_a_step(&case.model, grads);
    assert!(!changed.is_empty() && changed.iter().all(|name| !name.starts_with("sem.")), "{changed:?}");
}

#[test]
fn skeleton_loss_moves_no_parameter_of_the_branches() {
    let case = case();
    let grads = GradientsParams::from_grads(case.skeleton().backward(), &case.model);
    assert_eq!(moved(&case.model.dense, &grads), [""; 0]);
    assert_eq!(moved(&case.model.skeleton, &grads), [""; 0]);
    let (moved, all) = (moved(&case.model.sem, &grads), parameters(&case.model.sem).unwrap());
    let still: Vec<_> = all.keys().filter(|name| !moved.contains(name)).collect();
    assert!(still.is_empty(), "{still:?}");
    let changed = changed_by_a_step(&case.model, grads);
    assert!(!changed.is_empty() && changed.iter().all(|name| name.starts_with("sem.")), "{changed:?}");
}

#[test]
fn branches_learn_apart() {
    let case = case();
    let dense = &case.output.dense;
    let loss = registration_loss(
        dense.rotation.clone(),
        dense.translation.clone(),
        case.rotation.clone(),
        case.translation.clone(),
    );
    let grads = GradientsParams::from_grads(loss.backward(), &case.model);
    assert_eq!(moved(&case.model.skeleton, &grads), [""; 0]);
    assert!(!moved(&case.model.dense, &grads).is_empty());
}
