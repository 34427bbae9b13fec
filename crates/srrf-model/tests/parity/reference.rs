//! The fixture, the parameters that both sides make, and the comparison.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "helpers of tests")]

use std::collections::BTreeMap;

use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::{DType, Device, Gradients, Tensor, TensorData};
use serde::Deserialize;
use srrf_model::{Srrf, SrrfConfig};

use crate::common::{Numbers, difference, values};
use crate::parameters::{Directions, Fill};

/// The types to run in, with the tolerances of values and of gradients.
const TYPES: [(DType, f64, f64); 2] = [(DType::F64, 1e-9, 1e-6), (DType::F32, 2e-5, 1e-4)];

#[derive(Deserialize)]
pub struct Numbered {
    pub shape: Vec<usize>,
    pub data: Vec<f64>,
}

/// The fixture, and the type that a test runs in.
pub struct Reference {
    all: BTreeMap<String, serde_json::Value>,
    pub config: SrrfConfig,
    pub device: Device,
    pub dtype: DType,
    tolerance: f64,
    gradient_tolerance: f64,
}

impl Reference {
    /// One for each type.
    pub fn each() -> [Self; 2] {
        TYPES.map(|(dtype, tolerance, gradient_tolerance)| {
            let all: BTreeMap<String, serde_json::Value> =
                serde_json::from_str(include_str!("../fixtures/parity.json")).unwrap();
            let config = serde_json::from_value(all["config"].clone()).unwrap();
            Self { all, config, device: Device::flex().autodiff(), dtype, tolerance, gradient_tolerance }
        })
    }

    pub fn get<T: serde::de::DeserializeOwned>(&self, name: &str) -> T {
        let value = self.all.get(name).unwrap_or_else(|| panic!("{name} is not in the fixture"));
        serde_json::from_value(value.clone()).unwrap()
    }

    /// A tensor of the fixture, on the graph.
    pub fn tensor<const D: usize>(&self, name: &str) -> Tensor<D> {
        let Numbered { shape, data } = self.get(name);
        let shape: [usize; D] = shape.try_into().unwrap();
        Tensor::from_data(TensorData::new(data, shape), (&self.device, self.dtype)).require_grad()
    }

    /// Compares with the fixture: the largest difference, over the largest number.
    pub fn compare<const D: usize>(&self, name: &str, found: &Tensor<D>) {
        self.compare_within(name, found, self.tolerance);
    }

    fn compare_within<const D: usize>(&self, name: &str, found: &Tensor<D>, tolerance: f64) {
        let wanted: Numbered = self.get(name);
        assert_eq!(found.dims().to_vec(), wanted.shape, "{name}");
        assert_eq!(found.dtype(), self.dtype, "{name}");
        self.compare_numbers(name, &values(found), &wanted.data, tolerance);
    }

    pub fn compare_numbers(&self, name: &str, found: &[f64], wanted: &[f64], tolerance: f64) {
        let largest = wanted.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        let error = difference(found, wanted) / largest;
        if std::env::var_os("PARITY_PRINT").is_some() {
            println!("{:?} {name}: {error:.1e}", self.dtype);
        }
        assert!(error < tolerance, "{name} in {:?}: off by {error:e} of {largest}", self.dtype);
    }

    pub fn compare_gradient<const D: usize>(&self, name: &str, of: &Tensor<D>, grads: &Gradients) {
        let gradient = of.grad(grads).unwrap_or_else(|| panic!("{name}: no gradient"));
        self.compare_within(name, &gradient, self.gradient_tolerance);
    }

    /// Compares norm and one product of the gradient of every parameter of `module`, whose path in
    /// the network is `prefix`.
    pub fn compare_parameters<M: Module>(&self, name: &str, prefix: &str, module: &M, grads: Gradients) {
        let found = Directions::of(module, prefix, GradientsParams::from_grads(grads, module));
        let wanted: BTreeMap<String, [f64; 2]> = self.get(&format!("{name}.gradient.parameters"));
        let wanted: BTreeMap<_, _> =
            wanted.into_iter().filter(|(path, _)| path.starts_with(prefix)).collect();
        assert_eq!(found.keys().collect::<Vec<_>>(), wanted.keys().collect::<Vec<_>>());
        let largest = wanted.values().map(|[norm, _]| *norm).fold(0.0, f64::max);
        for (path, wanted) in wanted {
            // Some gradients are 0 by construction (a bias before a softmax) and come out as what the
            // rounding of their terms leaves: compare those with the others' size.
            let scale = wanted[0].max(1e-2 * largest);
            let error = difference(&found[&path], &wanted) / scale;
            assert!(
                error < self.gradient_tolerance,
                "{name}, {path} in {:?}: {error:e} of {scale}",
                self.dtype
            );
        }
    }

    /// The network with the parameters that both sides make.
    pub fn network(&self) -> Srrf {
        let mut fill = Fill { path: Vec::new(), dtype: self.dtype, shapes: BTreeMap::new() };
        let model = self.config.init(&Device::flex()).map(&mut fill);
        assert_eq!(fill.shapes, self.get("parameters"), "both sides have the same parameters");
        model.train()
    }

    /// `sum signed * value` over every number of some tensors, as in the generator.
    pub fn weighed<const D: usize>(&self, numbers: &mut Numbers, tensor: &Tensor<D>) -> Tensor<1> {
        let drawn = TensorData::new(numbers.many(tensor.shape().num_elements()), tensor.dims());
        (tensor.clone() * Tensor::from_data(drawn, (&self.device, self.dtype))).sum()
    }
}

/// A part of the network by itself, with the parameters that it has at `path`.
pub fn filled_as<M: Module>(module: M, path: &str, dtype: DType) -> M {
    let path = path.split('.').map(str::to_string).collect();
    module.map(&mut Fill { path, dtype, shapes: BTreeMap::new() }).train()
}
