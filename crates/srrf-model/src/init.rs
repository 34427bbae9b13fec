//! Initial weights that depend on the seed and on nothing else: not on the backend, not on the
//! order in which lazy parameters wake up.

use burn::module::{Module, ModuleMapper, Param, ParamId};
use burn::tensor::{Tensor, TensorData};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// Gives every linear layer weights and biases from `U(-1/sqrt(fan_in), 1/sqrt(fan_in))` (PyTorch's
/// default), drawn on the host from `seed`, and numbers the parameters in order, so that an
/// optimizer's state finds its parameters again in another process. Other parameters (norms,
/// temperature) keep their constants.
pub fn seeded<M: Module>(module: M, seed: u64) -> M {
    let rng = ChaCha8Rng::seed_from_u64(seed);
    module.map(&mut SeededInit { rng, path: Vec::new(), fan_in: 1, next_id: 1 })
}

struct SeededInit {
    rng: ChaCha8Rng,
    path: Vec<String>,
    /// Rows of the last weight matrix; its bias follows it.
    fan_in: usize,
    next_id: u64,
}

impl ModuleMapper for SeededInit {
    fn enter_module(&mut self, name: &str, _container_type: &str) {
        self.path.push(name.to_string());
    }

    fn exit_module(&mut self, _name: &str, _container_type: &str) {
        self.path.pop();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (_, tensor, mapper) = param.consume();
        let id = ParamId::from(self.next_id);
        self.next_id += 1;
        let field = self.path.last().map(String::as_str);
        let dims = tensor.dims();
        if field == Some("weight") {
            self.fan_in = dims[0];
        }
        let tensor = if matches!(field, Some("weight" | "bias")) {
            let bound = 1.0 / (self.fan_in as f32).sqrt();
            let count = dims.iter().product();
            let values: Vec<f32> = (0..count).map(|_| self.rng.random_range(-bound..bound)).collect();
            Tensor::from_data(TensorData::new(values, dims), (&tensor.device(), tensor.dtype()))
        } else {
            tensor
        };
        Param::from_mapped_value(id, tensor, mapper)
    }
}
