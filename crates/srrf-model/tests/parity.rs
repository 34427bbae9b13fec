//! The network against an implementation of its own, in PyTorch:
//!
//! ```text
//! python3 scripts/parity_reference.py crates/srrf-model/tests/fixtures/parity.json
//! ```
//!
//! The reference computes in `f64`. Here every part runs twice, and a tensor's largest error is
//! taken over its largest number. In `f64` values must agree to `1e-9`, which leaves room for
//! rounding and for nothing else, and gradients to `1e-6`: Burn's backward passes round some factors
//! to `f32` (`6e-8`). In `f32`, the type that the network runs in, sums of some hundred products in
//! another order are off by several times `6e-8`, and the layers and the SVD, whose gradient grows
//! with one over the gap of its singular values, carry that on: `2e-5` for values, `1e-4` for
//! gradients.

mod common;

use std::collections::BTreeMap;

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::optim::GradientsParams;
use burn::tensor::{DType, Device, Gradients, Tensor, TensorData};
use common::{Numbers, difference, values};
use serde::Deserialize;
use srrf_model::{
    BranchOutput, Skeleton, SkeletonLossConfig, SoftMatching, Srrf, SrrfConfig, chamfer, correspondence_loss,
    procrustes, registration_loss, skeleton_loss,
};

/// The types to run in, with the tolerances of values and of gradients.
const TYPES: [(DType, f64, f64); 2] = [(DType::F64, 1e-9, 1e-6), (DType::F32, 2e-5, 1e-4)];

#[derive(Deserialize)]
struct Numbered {
    shape: Vec<usize>,
    data: Vec<f64>,
}

/// The fixture, and the type that a test runs in.
struct Reference {
    all: BTreeMap<String, serde_json::Value>,
    config: SrrfConfig,
    device: Device,
    dtype: DType,
    tolerance: f64,
    gradient_tolerance: f64,
}

impl Reference {
    /// One for each type.
    fn each() -> [Self; 2] {
        TYPES.map(|(dtype, tolerance, gradient_tolerance)| {
            let all: BTreeMap<String, serde_json::Value> =
                serde_json::from_str(include_str!("fixtures/parity.json")).unwrap();
            let config = serde_json::from_value(all["config"].clone()).unwrap();
            Self { all, config, device: Device::flex().autodiff(), dtype, tolerance, gradient_tolerance }
        })
    }

    fn get<T: serde::de::DeserializeOwned>(&self, name: &str) -> T {
        let value = self.all.get(name).unwrap_or_else(|| panic!("{name} is not in the fixture"));
        serde_json::from_value(value.clone()).unwrap()
    }

    /// A tensor of the fixture, on the graph.
    fn tensor<const D: usize>(&self, name: &str) -> Tensor<D> {
        let Numbered { shape, data } = self.get(name);
        let shape: [usize; D] = shape.try_into().unwrap();
        Tensor::from_data(TensorData::new(data, shape), (&self.device, self.dtype)).require_grad()
    }

    /// Compares with the fixture: the largest difference, over the largest number.
    fn compare<const D: usize>(&self, name: &str, found: &Tensor<D>) {
        self.compare_within(name, found, self.tolerance);
    }

    fn compare_within<const D: usize>(&self, name: &str, found: &Tensor<D>, tolerance: f64) {
        let wanted: Numbered = self.get(name);
        assert_eq!(found.dims().to_vec(), wanted.shape, "{name}");
        assert_eq!(found.dtype(), self.dtype, "{name}");
        self.compare_numbers(name, &values(found), &wanted.data, tolerance);
    }

    fn compare_numbers(&self, name: &str, found: &[f64], wanted: &[f64], tolerance: f64) {
        let largest = wanted.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        let error = difference(found, wanted) / largest;
        if std::env::var_os("PARITY_PRINT").is_some() {
            println!("{:?} {name}: {error:.1e}", self.dtype);
        }
        assert!(error < tolerance, "{name} in {:?}: off by {error:e} of {largest}", self.dtype);
    }

    fn compare_gradient<const D: usize>(&self, name: &str, of: &Tensor<D>, grads: &Gradients) {
        let gradient = of.grad(grads).unwrap_or_else(|| panic!("{name}: no gradient"));
        self.compare_within(name, &gradient, self.gradient_tolerance);
    }

    /// Compares norm and one product of the gradient of every parameter of `module`, whose path in
    /// the network is `prefix`.
    fn compare_parameters<M: Module>(&self, name: &str, prefix: &str, module: &M, grads: Gradients) {
        let mut found = Directions {
            grads: GradientsParams::from_grads(grads, module),
            path: prefix.split('.').filter(|field| !field.is_empty()).map(str::to_string).collect(),
            found: BTreeMap::new(),
        };
        module.visit(&mut found);
        let wanted: BTreeMap<String, [f64; 2]> = self.get(&format!("{name}.gradient.parameters"));
        let wanted: BTreeMap<_, _> =
            wanted.into_iter().filter(|(path, _)| path.starts_with(prefix)).collect();
        assert_eq!(found.found.keys().collect::<Vec<_>>(), wanted.keys().collect::<Vec<_>>());
        let largest = wanted.values().map(|[norm, _]| *norm).fold(0.0, f64::max);
        for (path, wanted) in wanted {
            // Some gradients are 0 by construction (a bias before a softmax) and come out as what the
            // rounding of their terms leaves: compare those with the others' size.
            let scale = wanted[0].max(1e-2 * largest);
            let error = difference(&found.found[&path], &wanted) / scale;
            assert!(
                error < self.gradient_tolerance,
                "{name}, {path} in {:?}: {error:e} of {scale}",
                self.dtype
            );
        }
    }

    /// The network with the parameters that both sides make.
    fn network(&self) -> Srrf {
        let mut fill = Fill { path: Vec::new(), dtype: self.dtype, shapes: BTreeMap::new() };
        let model = self.config.init(&Device::flex()).map(&mut fill);
        assert_eq!(fill.shapes, self.get("parameters"), "both sides have the same parameters");
        model.train()
    }

    /// `sum signed * value` over every number of some tensors, as in the generator.
    fn weighed<const D: usize>(&self, numbers: &mut Numbers, tensor: &Tensor<D>) -> Tensor<1> {
        let drawn = TensorData::new(numbers.many(tensor.shape().num_elements()), tensor.dims());
        (tensor.clone() * Tensor::from_data(drawn, (&self.device, self.dtype))).sum()
    }
}

/// FNV-1a, 64 bits.
fn fnv(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |h, byte| (h ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

/// Gives each parameter the numbers that the generator documents.
struct Fill {
    path: Vec<String>,
    dtype: DType,
    shapes: BTreeMap<String, Vec<usize>>,
}

impl ModuleMapper for Fill {
    fn enter_module(&mut self, name: &str, _container_type: &str) {
        self.path.push(name.to_string());
    }

    fn exit_module(&mut self, _name: &str, _container_type: &str) {
        self.path.pop();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (id, tensor, mapper) = param.consume();
        let (path, dims) = (self.path.join("."), tensor.dims());
        let mut numbers = Numbers(fnv(&path));
        let field = self.path.last().map(String::as_str);
        let drawn = (0..dims.iter().product::<usize>()).map(|_| {
            let signed = numbers.signed();
            let value = match field {
                Some("weight") => signed * (1.5 / (dims[0] as f64).sqrt()),
                Some("bias" | "beta") => signed * 0.2,
                Some("gamma") => 1.0 + signed * 0.3,
                _ => signed * 0.4,
            };
            f64::from(value as f32)
        });
        let data = TensorData::new(drawn.collect::<Vec<f64>>(), dims);
        self.shapes.insert(path, dims.to_vec());
        Param::from_mapped_value(id, Tensor::from_data(data, (&tensor.device(), self.dtype)), mapper)
    }
}

/// Norm and product with a drawn direction of each parameter's gradient.
struct Directions {
    grads: GradientsParams,
    path: Vec<String>,
    found: BTreeMap<String, [f64; 2]>,
}

impl ModuleVisitor for Directions {
    fn enter_module(&mut self, name: &str, _container_type: &str) {
        self.path.push(name.to_string());
    }

    fn exit_module(&mut self, _name: &str, _container_type: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let Some(gradient) = self.grads.get::<D>(param.id) else { return };
        let (path, gradient) = (self.path.join("."), values(&gradient));
        let direction = Numbers(fnv(&format!("{path}.direction"))).many(gradient.len());
        let norm = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        let along = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
        self.found.insert(path, [norm, along]);
    }
}

#[test]
fn skeleton_module() {
    for reference in Reference::each() {
        let sem = reference.network().sem;
        let clouds = reference.tensor::<3>("sem.clouds");
        let skeleton = sem.forward(clouds.clone());
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
            let half = |which: usize| Skeleton {
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
            );
            let loss = match name {
                "sampling" => losses.sampling,
                "point_to_sphere" => losses.point_to_sphere,
                "radius" => losses.radius,
                "distribution" => losses.distribution,
                "index_match" => losses.index_match,
                "total" => losses.total,
                _ => chamfer(skeletons.clone(), Tensor::cat(vec![source, target], 0)),
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
        let features = sfe.forward(reference.tensor("sfe.tokens"), cloud.clone());
        reference.compare("sfe.features", &features);
        let grads = reference.weighed(&mut Numbers(7), &features).backward();
        reference.compare_gradient("sfe.gradient.cloud", &cloud, &grads);
        reference.compare_parameters("sfe", "dense.sfe", &sfe, grads);
    }
}

/// A part of the network by itself, with the parameters that it has at `path`.
fn filled_as<M: Module>(module: M, path: &str, dtype: DType) -> M {
    let path = path.split('.').map(str::to_string).collect();
    module.map(&mut Fill { path, dtype, shapes: BTreeMap::new() }).train()
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
        let found = matching.forward(source_features, target_features, target);
        let (rotation, translation) = procrustes(source, found.points.clone());
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
        let output = network.forward(&reference.config.integration, source.clone(), target.clone(), phase);

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
        );
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
