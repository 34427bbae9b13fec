//! The network against an implementation of its own, in PyTorch:
//!
//! ```text
//! python3 crates/srrf-model/tests/fixtures/parity_reference.py crates/srrf-model/tests/fixtures/parity.json
//! ```
//!
//! The reference computes in `f64`. Here every part runs twice, and a tensor's largest error is
//! taken over its largest number. In `f64` values must agree to `1e-9`, which leaves room for
//! rounding and for nothing else, and gradients to `1e-6`: Burn's backward passes round some factors
//! to `f32` (`6e-8`). In `f32`, the type that the network runs in, sums of some hundred products in
//! another order are off by several times `6e-8`, and the layers and the SVD, whose gradient grows
//! with one over the gap of its singular values, carry that on: `2e-5` for values, `1e-4` for
//! gradients.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/parameters.rs"]
mod parameters;
mod reference;

use burn::tensor::{Device, Tensor};
use common::Numbers;
use reference::{Numbered, Reference, filled_as};
use srrf_model::{
    BranchOutput, SkeletonBatch, SkeletonLossConfig, SoftMatching, chamfer, correspondence_loss, procrustes,
    registration_loss, skeleton_loss,
};

#[test]
fn skeleton_module() {
    for reference in Reference::each() {
        let sem = reference.network().sem;
        let clouds = reference.tensor::<3>("sem.clouds");
        let skeleton = sem.forward(clouds.clone()).unwrap();
        reference.compare("sem.samples", &skeleton.samples);
        reference.compare("sem.weights", &skeleton.weights);
        reference.compare("sem.points", &skeleton.points);
        reference.compare("sem.radii", &skeleton.radii);

        let numbers = &mut Numbers(2);
        let loss = reference.weighed(numbers, &skeleton.points)
            + reference.weighed(numbers, &skeleton.radii)
            + reference.weighed(numbers, &skeleton.weights);
        let grads = loss.backward();
        reference.compare_gradient("sem.gradient.clouds", &clouds, &grads);
        reference.compare_parameters("sem", "sem", &sem, grads);
    }
}

#[test]
fn skeleton_losses() {
    for reference in Reference::each() {
        // A graph serves one backward pass: each loss is made anew.
        let compare = |name: &str, of_points: bool, of_radii: bool| {
            let [source, target, skeletons] = ["source", "target", "skeletons"]
                .map(|name| reference.tensor::<3>(&format!("losses.{name}")));
            let radii = reference.tensor::<2>("losses.radii");
            let half = |which: usize| SkeletonBatch {
                points: skeletons.clone().narrow(0, 2 * which, 2),
                radii: radii.clone().narrow(0, 2 * which, 2),
                // The losses look at neither of these.
                weights: Tensor::zeros([2, 1, 11], &reference.device),
                samples: Tensor::zeros([2, 1, 3], &reference.device),
            };
            let losses = skeleton_loss(
                &reference.get::<SkeletonLossConfig>("loss"),
                (source.clone(), &half(0)),
                (target.clone(), &half(1)),
                reference.tensor("losses.rotation"),
                reference.tensor("losses.translation"),
            )
            .unwrap();
            let loss = match name {
                "sampling" => losses.sampling,
                "point_to_sphere" => losses.point_to_sphere,
                "radius" => losses.radius,
                "distribution" => losses.distribution,
                "index_match" => losses.index_match,
                "total" => losses.total,
                _ => chamfer(skeletons.clone(), Tensor::cat(vec![source, target], 0)).unwrap(),
            };
            reference.compare(&format!("losses.{name}"), &loss);
            let grads = loss.backward();
            if of_points {
                reference.compare_gradient(&format!("losses.{name}.gradient.skeletons"), &skeletons, &grads);
            }
            if of_radii {
                reference.compare_gradient(&format!("losses.{name}.gradient.radii"), &radii, &grads);
            }
        };
        compare("sampling", true, true);
        compare("point_to_sphere", true, true);
        compare("radius", false, true);
        compare("distribution", true, false);
        compare("index_match", true, false);
        compare("total", true, true);
        compare("chamfer", true, false);
    }
}

#[test]
fn structural_features() {
    for reference in Reference::each() {
        let sfe = reference.config.dense.sfe.init(&Device::flex());
        let sfe = filled_as(sfe, "dense.sfe", reference.dtype);
        let cloud = reference.tensor::<3>("sfe.cloud");
        let features = sfe.forward(reference.tensor("sfe.tokens"), cloud.clone()).unwrap();
        reference.compare("sfe.features", &features);
        let grads = reference.weighed(&mut Numbers(7), &features).backward();
        reference.compare_gradient("sfe.gradient.cloud", &cloud, &grads);
        reference.compare_parameters("sfe", "dense.sfe", &sfe, grads);
    }
}

#[test]
fn feature_interaction() {
    for reference in Reference::each() {
        let config = &reference.config.dense;
        let pfi = config.pfi.init(config.sfe.output_width(), &Device::flex());
        let pfi = filled_as(pfi, "dense.pfi", reference.dtype);
        let (features, points) = (reference.tensor::<3>("pfi.features"), reference.tensor::<3>("pfi.points"));
        let phi = pfi.forward(features.clone(), points.clone());
        reference.compare("pfi.phi", &phi);
        let grads = reference.weighed(&mut Numbers(9), &phi).backward();
        reference.compare_gradient("pfi.gradient.features", &features, &grads);
        reference.compare_gradient("pfi.gradient.points", &points, &grads);
        reference.compare_parameters("pfi", "dense.pfi", &pfi, grads);
    }
}

#[test]
fn matching_and_svd() {
    for reference in Reference::each() {
        let matching = filled_as(SoftMatching::new(&Device::flex()), "dense.matching", reference.dtype);
        let names = ["source_features", "target_features", "source_points", "target_points"];
        let inputs = names.map(|name| reference.tensor::<3>(&format!("head.{name}")));
        let [source_features, target_features, source, target] = inputs.clone();
        let found = matching.forward(source_features, target_features, target, None);
        let (rotation, translation) = procrustes(source, found.points.clone()).unwrap();
        reference.compare("head.matches", &found.points);
        reference.compare("head.probabilities", &found.probabilities);
        reference.compare("head.rotation", &rotation);
        reference.compare("head.translation", &translation);

        let numbers = &mut Numbers(11);
        let loss = reference.weighed(numbers, &found.points)
            + reference.weighed(numbers, &found.probabilities)
            + reference.weighed(numbers, &rotation)
            + reference.weighed(numbers, &translation);
        let grads = loss.backward();
        for (name, input) in names.iter().zip(&inputs) {
            reference.compare_gradient(&format!("head.gradient.{name}"), input, &grads);
        }
        reference.compare_parameters("head", "dense.matching", &matching, grads);
    }
}

#[test]
fn whole_network_and_all_losses() {
    for reference in Reference::each() {
        let network = reference.network();
        let (source, target) = (reference.tensor::<3>("whole.source"), reference.tensor::<3>("whole.target"));
        let (rotation, translation) =
            (reference.tensor::<3>("whole.rotation"), reference.tensor::<2>("whole.translation"));
        let phase = reference.get::<f32>("phase");
        let output =
            network.forward(&reference.config.integration, source.clone(), target.clone(), phase).unwrap();

        let (x, y) = (&output.source_skeleton, &output.target_skeleton);
        reference.compare("whole.skeletons", &Tensor::cat(vec![x.points.clone(), y.points.clone()], 0));
        reference.compare("whole.radii", &Tensor::cat(vec![x.radii.clone(), y.radii.clone()], 0));
        for (name, branch) in [("dense", &output.dense), ("skeleton", &output.skeleton)] {
            reference.compare(&format!("whole.{name}.source_points"), &branch.source_points);
            reference.compare(&format!("whole.{name}.target_points"), &branch.target_points);
            reference.compare(&format!("whole.{name}.matches"), &branch.matches);
            reference.compare(&format!("whole.{name}.rotation"), &branch.rotation);
            reference.compare(&format!("whole.{name}.translation"), &branch.translation);
        }
        // Ratios are counts over 37 points: equal, up to the digits of the fixture.
        let fused = &output.fused;
        let gammas: Vec<f64> =
            (0..2).flat_map(|i| [fused.dense_inlier_ratio[i], fused.skeleton_inlier_ratio[i]]).collect();
        let wanted: Numbered = reference.get("whole.gammas");
        reference.compare_numbers("gammas", &gammas, &wanted.data, 1e-12);
        let wanted: Numbered = reference.get("whole.lambda");
        reference.compare_numbers("lambda", &fused.lambda, &wanted.data, 1e-12);
        reference.compare("whole.fused.rotation", &fused.rotation);
        reference.compare("whole.fused.translation", &fused.translation);

        let pose = |r: &Tensor<3>, t: &Tensor<2>| {
            registration_loss(r.clone(), t.clone(), rotation.clone(), translation.clone())
        };
        let matched = |branch: &BranchOutput| {
            let (points, matches) = (branch.source_points.clone(), branch.matches.clone());
            correspondence_loss(points, matches, rotation.clone(), translation.clone())
        };
        let skeleton = skeleton_loss(
            &reference.get("loss"),
            (source.clone(), x),
            (target.clone(), y),
            rotation.clone(),
            translation.clone(),
        )
        .unwrap();
        let losses = [
            ("skeleton_loss", skeleton.total),
            ("dense.registration", pose(&output.dense.rotation, &output.dense.translation)),
            ("dense.correspondence", matched(&output.dense)),
            ("skeleton.registration", pose(&output.skeleton.rotation, &output.skeleton.translation)),
            ("skeleton.correspondence", matched(&output.skeleton)),
            ("fused.registration", pose(&fused.rotation, &fused.translation)),
        ];
        for (name, loss) in &losses {
            reference.compare(&format!("whole.{name}"), loss);
        }
        let total = losses.into_iter().map(|(_, loss)| loss).reduce(|a, b| a + b).unwrap();
        let grads = total.backward();
        reference.compare_gradient("whole.gradient.source", &source, &grads);
        reference.compare_gradient("whole.gradient.target", &target, &grads);
        reference.compare_parameters("whole", "", &network, grads);
    }
}
