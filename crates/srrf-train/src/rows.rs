//! Parameters and gradients as one row of numbers for each part of a network (its top-level fields), so
//! that the optimiser makes some dozen operations a part, and not some dozen for each of hundreds of
//! tensors: on a GPU their launches would cost as much as the network.

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param, ParamId};
use burn::optim::{GradientsParams, ModuleOptimizer};
use burn::tensor::{Device, Tensor};
use srrf_model::ops::{CopyError, to_host};

/// The parameters of a part as rows, each with its gradient if it has one.
type PartRows = Vec<(Tensor<1>, Option<Tensor<1>>)>;

/// The gradient of each part; none where nothing in it was trained.
pub struct RowGradients(Vec<Option<Tensor<1>>>);

impl RowGradients {
    /// The gradients of `network`, which must be off the graph, without those of other modules.
    pub fn new<M: Module>(gradients: GradientsParams, network: &M) -> Self {
        let whole = |part: PartRows| {
            let trained = part.iter().any(|(_, gradient)| gradient.is_some());
            let filled =
                part.into_iter().map(|(value, gradient)| gradient.unwrap_or_else(|| value.zeros_like()));
            trained.then(|| Tensor::cat(filled.collect(), 0))
        };
        Self(RowCollector::of(network, gradients).into_iter().map(whole).collect())
    }

    /// The same numbers on another device.
    pub fn to_device(self, device: &Device) -> Self {
        Self(self.0.into_iter().map(|row| row.map(|row| row.to_device(device))).collect())
    }

    /// The sum, in the order given.
    pub fn sum(all: impl IntoIterator<Item = Self>) -> Self {
        let sum = all.into_iter().reduce(|a, b| {
            let both = |(a, b): (Option<Tensor<1>>, Option<Tensor<1>>)| match (a, b) {
                (Some(a), Some(b)) => Some(a + b),
                (a, b) => a.or(b),
            };
            Self(a.0.into_iter().zip(b.0).map(both).collect())
        });
        sum.unwrap_or_else(|| Self(Vec::new()))
    }

    /// Euclidean norm over all parts; not finite where any number is not.
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn norm(&self) -> Result<f64, CopyError> {
        let squares: Vec<Tensor<1>> = self.0.iter().flatten().map(|g| g.clone().square().sum()).collect();
        if squares.is_empty() {
            return Ok(0.0);
        }
        // Read at once: a device that works ahead has to stop for it.
        let squares: Vec<f64> = to_host(&Tensor::cat(squares, 0))?;
        Ok(squares.iter().sum::<f64>().sqrt())
    }

    /// Multiplies every gradient.
    pub fn scale(&mut self, factor: f64) {
        for gradient in &mut self.0 {
            *gradient = gradient.take().map(|g| g * factor);
        }
    }
}

/// Burn's optimiser on the rows of a network.
pub struct Updater {
    optimizer: ModuleOptimizer,
    rows: ParameterRows,
}

impl Updater {
    /// The optimiser, new or with the state that [`Updater::optimizer`] had, on the parameters of `network`,
    /// which must be off the graph.
    pub fn new<M: Module>(optimizer: ModuleOptimizer, network: &M) -> Self {
        let part = |(i, part): (usize, PartRows)| {
            let values = part.into_iter().map(|(value, _)| value).collect();
            // Numbered in order, so that the state finds its rows again in another process.
            Param::initialized(ParamId::from(i as u64 + 1), Tensor::cat(values, 0))
        };
        let parts = RowCollector::of(network, GradientsParams::new());
        Self { optimizer, rows: ParameterRows { parts: parts.into_iter().enumerate().map(part).collect() } }
    }

    /// What a checkpoint keeps.
    pub fn optimizer(&self) -> &ModuleOptimizer {
        &self.optimizer
    }

    /// One step of `network`, which must be as the last step left it.
    pub fn step<M: Module>(&mut self, rate: f64, network: M, gradients: RowGradients) -> M {
        let mut given = GradientsParams::new();
        let mut trained = Vec::new();
        for (part, gradient) in self.rows.parts.iter().zip(gradients.0) {
            trained.push(gradient.is_some());
            if let Some(gradient) = gradient {
                given.register(part.id, gradient);
            }
        }
        // The optimiser takes a module on the autodiff device; between steps it lives without.
        self.rows = self.optimizer.step(rate, self.rows.clone().train(), given).valid();
        let parts = self.rows.parts.iter().zip(trained);
        let parts = parts.map(|(part, trained)| trained.then(|| part.val())).collect();
        network.map(&mut Spread { parts, path: Path::default(), at: 0 })
    }
}

/// The parameters of each part.
#[derive(Module, Debug)]
struct ParameterRows {
    parts: Vec<Param<Tensor<1>>>,
}

/// Which part a visit is in: a new one begins with the first parameter of each top-level field.
#[derive(Default)]
struct Path {
    depth: usize,
    /// Whether the field has not had a parameter yet.
    fresh: bool,
    /// Parts begun.
    begun: usize,
}

impl Path {
    fn enter(&mut self) {
        self.fresh |= self.depth == 0;
        self.depth += 1;
    }

    fn exit(&mut self) {
        self.depth -= 1;
    }

    /// Number of the part that the next parameter belongs to, and whether it is its first.
    fn part(&mut self) -> (usize, bool) {
        let first = std::mem::take(&mut self.fresh);
        self.begun += usize::from(first);
        (self.begun - 1, first)
    }
}

/// Collects the parameters of each part as rows, with their gradients where there are any.
struct RowCollector {
    gradients: GradientsParams,
    path: Path,
    parts: Vec<PartRows>,
}

impl RowCollector {
    fn of<M: Module>(network: &M, gradients: GradientsParams) -> Vec<PartRows> {
        let mut collector = Self { gradients, path: Path::default(), parts: Vec::new() };
        network.visit(&mut collector);
        collector.parts
    }
}

impl ModuleVisitor for RowCollector {
    fn enter_module(&mut self, _name: &str, _container_type: &str) {
        self.path.enter();
    }

    fn exit_module(&mut self, _name: &str, _container_type: &str) {
        self.path.exit();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let (part, first) = self.path.part();
        if first {
            self.parts.push(Vec::new());
        }
        let value = param.val();
        let count = value.shape().num_elements();
        let gradient = self.gradients.remove::<D>(param.id).map(|g| g.reshape([count]));
        self.parts[part].push((value.reshape([count]), gradient));
    }
}

/// Gives each parameter its share of its part's row; parts that were not trained stay as they are.
struct Spread {
    parts: Vec<Option<Tensor<1>>>,
    path: Path,
    at: usize,
}

impl ModuleMapper for Spread {
    fn enter_module(&mut self, _name: &str, _container_type: &str) {
        self.path.enter();
    }

    fn exit_module(&mut self, _name: &str, _container_type: &str) {
        self.path.exit();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (part, first) = self.path.part();
        if first {
            self.at = 0;
        }
        let Some(Some(row)) = self.parts.get(part) else { return param };
        let (id, tensor, mapper) = param.consume();
        let (dims, count) = (tensor.dims(), tensor.shape().num_elements());
        let value = row.clone().narrow(0, self.at, count).reshape(dims);
        self.at += count;
        Param::from_mapped_value(id, value, mapper)
    }
}

#[cfg(test)]
mod tests {
    use burn::nn::{Linear, LinearConfig};
    use burn::optim::AdamWConfig;
    use srrf_model::init;
    use srrf_model::weights::parameters;

    use super::*;

    #[derive(Module, Debug)]
    struct Net {
        first: Linear,
        others: Vec<Linear>,
        untrained: Linear,
    }

    fn net() -> Net {
        let linear = |i, o| LinearConfig::new(i, o).init(&Device::flex());
        let net =
            Net { first: linear(3, 5), others: vec![linear(5, 7), linear(7, 2)], untrained: linear(2, 2) };
        init::seeded(net, 11).valid()
    }

    /// The gradients of a loss that wants every output to be `aim`.
    fn gradients(net: &Net, aim: f64) -> GradientsParams {
        let net = net.clone().train();
        let x = Tensor::<2>::from_floats([[0.3, -0.7, 1.1], [0.9, 0.2, -0.4]], &Device::flex().autodiff());
        let x = net.others.iter().fold(net.first.forward(x), |x, layer| layer.forward(x));
        GradientsParams::from_grads((x - aim).square().mean().backward(), &net)
    }

    #[test]
    fn rows_give_the_steps_of_the_parameters_one_by_one() {
        let optimizer = || AdamWConfig::new().with_weight_decay(0.1).init();
        let (mut plain, mut alone) = (net(), optimizer());
        let mut rows = net();
        let mut updater = Updater::new(optimizer(), &rows);
        for aim in [0.0, 1.0, -2.0, 0.5] {
            let given = gradients(&plain, aim);
            plain = alone.step(1e-2, plain.train(), given).valid();
            let given = RowGradients::new(gradients(&rows, aim), &rows);
            rows = updater.step(1e-2, rows, given);
        }
        assert_eq!(parameters(&plain).unwrap(), parameters(&rows).unwrap());
        let (start, moved) = (parameters(&net()).unwrap(), parameters(&rows).unwrap());
        for (name, value) in &start {
            assert_eq!(moved[name] == *value, name.starts_with("untrained"), "{name}");
        }
    }

    #[test]
    fn means_norms_and_scales_are_over_all_parameters() {
        let net = net();
        let of = |aim| RowGradients::new(gradients(&net, aim), &net);
        let (a, b) = (of(0.0), of(3.0));
        assert_eq!((a.0.iter().flatten().count(), a.0.len()), (2, 3), "the last part has none");
        let mut mean = RowGradients::sum([a, b]);
        mean.scale(0.5);
        let norm = mean.norm().unwrap();
        // The loss is quadratic, so its gradient at the mean of two aims is the mean of the gradients.
        assert!(norm > 1e-3 && (norm - of(1.5).norm().unwrap()).abs() < 1e-5 * norm);
        mean.scale(0.5);
        assert!((mean.norm().unwrap() - 0.5 * norm).abs() < 1e-6 * norm);
    }
}
