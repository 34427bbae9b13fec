//! The parameters of a module by their paths, out of it and into it.

use std::collections::BTreeMap;

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{Tensor, TensorData};

use crate::ops::{CopyError, to_host};

/// The shape and the values of each parameter, by its path.
pub type ParametersByPath = BTreeMap<String, (Vec<usize>, Vec<f32>)>;

/// The parameters of a module by path.
///
/// # Errors
/// [`CopyError`] where the device does not give them.
pub fn parameters<M: Module>(module: &M) -> Result<ParametersByPath, CopyError> {
    let mut collector = Collector { path: Vec::new(), found: Ok(BTreeMap::new()) };
    module.visit(&mut collector);
    collector.found
}

struct Collector {
    path: Vec<String>,
    /// Or the first error.
    found: Result<ParametersByPath, CopyError>,
}

impl ModuleVisitor for Collector {
    fn enter_module(&mut self, name: &str, _container_type: &str) {
        self.path.push(name.to_string());
    }

    fn exit_module(&mut self, _name: &str, _container_type: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let Ok(found) = &mut self.found else { return };
        let tensor = param.val();
        match to_host(&tensor) {
            Ok(values) => drop(found.insert(self.path.join("."), (tensor.dims().to_vec(), values))),
            Err(error) => self.found = Err(error),
        }
    }
}

/// Replaces every parameter of `module` by the one of the same path in `values`.
///
/// # Errors
/// The path and what is wrong with it, for the first parameter that is missing, has another shape,
/// or is left over.
pub fn with_parameters<M: Module>(module: M, values: ParametersByPath) -> Result<M, (String, String)> {
    let mut applier = Applier { path: Vec::new(), values, failed: None };
    let module = module.map(&mut applier);
    if let Some(failed) = applier.failed {
        return Err(failed);
    }
    match applier.values.into_keys().next() {
        Some(name) => Err((name, "the network has no such parameter".to_string())),
        None => Ok(module),
    }
}

struct Applier {
    path: Vec<String>,
    values: ParametersByPath,
    failed: Option<(String, String)>,
}

impl ModuleMapper for Applier {
    fn enter_module(&mut self, name: &str, _container_type: &str) {
        self.path.push(name.to_string());
    }

    fn exit_module(&mut self, _name: &str, _container_type: &str) {
        self.path.pop();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let name = self.path.join(".");
        // Nothing is allocated for a parameter that the file does not have: its sizes are the header's word only.
        let wanted: [usize; D] = param.lazy_shape().dims();
        let fits = self.values.get(&name).is_some_and(|(shape, _)| *shape == wanted);
        if !fits {
            let why = match self.values.get(&name) {
                Some((shape, _)) => format!("the file has shape {shape:?}, the network {wanted:?}"),
                None => "missing from the file".to_string(),
            };
            self.failed.get_or_insert((name, why));
            return param;
        }
        let (id, tensor, mapper) = param.consume();
        let tensor = match self.values.remove(&name) {
            Some((_, values)) => {
                Tensor::from_data(TensorData::new(values, wanted), (&tensor.device(), tensor.dtype()))
            }
            None => tensor,
        };
        Param::from_mapped_value(id, tensor, mapper)
    }
}
