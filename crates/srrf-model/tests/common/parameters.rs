//! Parameters that the reference implementations in `tests/fixtures` make too, and what stands for their
//! gradients.

use std::collections::BTreeMap;

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::optim::GradientsParams;
use burn::tensor::{DType, Tensor, TensorData};

use crate::common::{Numbers, values};

/// FNV-1a, 64 bits.
pub fn fnv(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |h, byte| (h ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

/// Gives each parameter the numbers that the generator documents.
pub struct Fill {
    /// Where the module stands in the network.
    pub path: Vec<String>,
    /// The type to make them in.
    pub dtype: DType,
    /// What was made.
    pub shapes: BTreeMap<String, Vec<usize>>,
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
pub struct Directions {
    grads: GradientsParams,
    path: Vec<String>,
    found: BTreeMap<String, [f64; 2]>,
}

impl Directions {
    /// Those of `module`, whose path in the network is `prefix`.
    pub fn of<M: Module>(module: &M, prefix: &str, grads: GradientsParams) -> BTreeMap<String, [f64; 2]> {
        let path = prefix.split('.').filter(|field| !field.is_empty()).map(str::to_string).collect();
        let mut found = Self { grads, path, found: BTreeMap::new() };
        module.visit(&mut found);
        found.found
    }
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
