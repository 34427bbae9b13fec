//! `act(x W + b)`.

use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Flex, TensorMetadata};
use burn_flex::FlexTensor;

use super::kernels::{Matrix, add_rows, contiguous, exp, matmul, tensor, values, vectorized};

/// What follows a linear layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activation {
    /// Nothing.
    None,
    /// `max(x, 0)`.
    Relu,
    /// `1 / (1 + e^-x)`.
    Sigmoid,
}

pub fn forward(x: &FlexTensor, weight: &FlexTensor, bias: &FlexTensor, activation: Activation) -> FlexTensor {
    let (x, weight, bias) = (contiguous(x.clone()), contiguous(weight.clone()), contiguous(bias.clone()));
    let [rows, inputs, outputs] = sizes(&x, &weight);
    let mut out = vec![0.0_f32; rows * outputs];
    matmul(
        (&mut out, Matrix::new(rows, outputs)),
        false,
        1.0,
        (values(&x), Matrix::new(rows, inputs)),
        (values(&weight), Matrix::new(inputs, outputs)),
    );
    let bias = values(&bias);
    vectorized(
        #[inline(always)]
        || {
            for row in out.chunks_exact_mut(outputs) {
                match activation {
                    Activation::None => row.iter_mut().zip(bias).for_each(|(o, b)| *o += b),
                    Activation::Relu => row.iter_mut().zip(bias).for_each(|(o, b)| *o = relu(*o + b)),
                    Activation::Sigmoid => {
                        row.iter_mut().zip(bias).for_each(|(o, b)| *o = 1.0 / (1.0 + exp(-(*o + b))));
                    }
                }
            }
        },
    );
    tensor(out, [rows, outputs])
}

/// `max(x, 0)`, and NaN for NaN, as the training loop has to see it.
#[inline(always)]
fn relu(x: f32) -> f32 {
    if x < 0.0 { 0.0 } else { x }
}

fn sizes(x: &FlexTensor, weight: &FlexTensor) -> [usize; 3] {
    let (x, weight) = (x.shape(), weight.shape());
    [x[0], weight[0], weight[1]]
}

#[derive(Debug)]
struct LinearBackward;

/// What the backward pass needs.
#[derive(Debug, Clone)]
struct State {
    x: FlexTensor,
    weight: FlexTensor,
    /// The output, where there is an activation to differentiate.
    output: Option<FlexTensor>,
    activation: Activation,
}

impl Backward<Flex, 3> for LinearBackward {
    type State = State;

    fn backward(self, ops: Ops<State, 3>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let State { x, weight, output, activation } = ops.state;
        let (x, weight) = (contiguous(x), contiguous(weight));
        let [rows, inputs, outputs] = sizes(&x, &weight);
        let [for_x, for_weight, for_bias] = ops.parents;
        let incoming = contiguous(gradients.consume::<Flex>(&ops.node));
        let incoming = match &output {
            Some(output) => tensor(through(values(output), values(&incoming), activation), [rows, outputs]),
            None => incoming,
        };
        let g = (values(&incoming), Matrix::new(rows, outputs));

        if let Some(node) = for_x {
            let mut dx = vec![0.0_f32; rows * inputs];
            let w = (values(&weight), Matrix::new(inputs, outputs).t());
            matmul((&mut dx, Matrix::new(rows, inputs)), false, 1.0, g, w);
            gradients.register::<Flex>(node.id, tensor(dx, [rows, inputs]));
        }
        if let Some(node) = for_weight {
            let mut dw = vec![0.0_f32; inputs * outputs];
            let x = (values(&x), Matrix::new(rows, inputs).t());
            matmul((&mut dw, Matrix::new(inputs, outputs)), false, 1.0, x, g);
            gradients.register::<Flex>(node.id, tensor(dw, [inputs, outputs]));
        }
        if let Some(node) = for_bias {
            let mut db = vec![0.0_f32; outputs];
            add_rows(&mut db, g.0, outputs);
            gradients.register::<Flex>(node.id, tensor(db, [outputs]));
        }
    }
}

/// The gradient before the activation, from the one after it.
fn through(output: &[f32], gradient: &[f32], activation: Activation) -> Vec<f32> {
    vectorized(
        #[inline(always)]
        || {
            let pairs = output.iter().zip(gradient);
            match activation {
                Activation::None => gradient.to_vec(),
                Activation::Relu => pairs.map(|(&o, &g)| if o > 0.0 { g } else { 0.0 }).collect(),
                Activation::Sigmoid => pairs.map(|(&o, &g)| g * o * (1.0 - o)).collect(),
            }
        },
    )
}

pub fn tracked<C: CheckpointStrategy>(
    x: FloatTensor<Autodiff<Flex, C>>,
    weight: FloatTensor<Autodiff<Flex, C>>,
    bias: FloatTensor<Autodiff<Flex, C>>,
    activation: Activation,
) -> FloatTensor<Autodiff<Flex, C>> {
    let nodes = [x.node(), weight.node(), bias.node()];
    let output = forward(x.primitive(), weight.primitive(), bias.primitive(), activation);
    match LinearBackward.prepare::<C>(nodes).compute_bound().stateful() {
        OpsKind::Tracked(prep) => {
            let state = State {
                x: x.primitive().clone(),
                weight: weight.primitive().clone(),
                output: (activation != Activation::None).then(|| output.clone()),
                activation,
            };
            prep.finish(state, output)
        }
        OpsKind::UnTracked(prep) => prep.finish(output),
    }
}
