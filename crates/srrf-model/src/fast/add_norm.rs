//! `LN(a + b)`: the residual and the layer norm of a post-norm transformer layer.

use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Flex, TensorMetadata};
use burn_flex::FlexTensor;

use super::kernels::{contiguous, dot, sum, tensor, values, vectorized};

/// Burn's default, which the network uses.
const EPSILON: f32 = 1e-5;

/// The output, the normalised sum and the inverse deviation of each row.
pub fn forward(
    a: &FlexTensor,
    b: &FlexTensor,
    gamma: &FlexTensor,
    beta: &FlexTensor,
) -> (FlexTensor, Vec<f32>, Vec<f32>) {
    let [a, b, gamma, beta] = [a, b, gamma, beta].map(|t| contiguous(t.clone()));
    let shape = a.shape();
    let (rows, channels) = (shape[0], shape[1]);
    let (gamma, beta) = (values(&gamma), values(&beta));
    let mut normal = vec![0.0_f32; rows * channels];
    let mut out = vec![0.0_f32; rows * channels];
    let mut inverse = vec![0.0_f32; rows];
    vectorized(
        #[inline(always)]
        || {
            let inputs = values(&a).chunks_exact(channels).zip(values(&b).chunks_exact(channels));
            let outputs = normal.chunks_exact_mut(channels).zip(out.chunks_exact_mut(channels));
            for (((a, b), (normal, out)), inverse) in inputs.zip(outputs).zip(&mut inverse) {
                for ((n, a), b) in normal.iter_mut().zip(a).zip(b) {
                    *n = a + b;
                }
                let mean = sum(normal) / channels as f32;
                for n in normal.iter_mut() {
                    *n -= mean;
                }
                *inverse = 1.0 / (dot(normal, normal) / channels as f32 + EPSILON).sqrt();
                for (((n, o), g), b) in normal.iter_mut().zip(out).zip(gamma).zip(beta) {
                    *n *= *inverse;
                    *o = *n * g + b;
                }
            }
        },
    );
    (tensor(out, [rows, channels]), normal, inverse)
}

#[derive(Debug)]
struct AddNormBackward;

/// What the backward pass needs.
#[derive(Debug, Clone)]
struct State {
    gamma: FlexTensor,
    normal: FlexTensor,
    inverse: Vec<f32>,
}

impl Backward<Flex, 4> for AddNormBackward {
    type State = State;

    fn backward(self, ops: Ops<State, 4>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let State { gamma, normal, inverse } = ops.state;
        let gamma = contiguous(gamma);
        let (rows, channels) = (inverse.len(), gamma.shape()[0]);
        let incoming = contiguous(gradients.consume::<Flex>(&ops.node));
        let [for_a, for_b, for_gamma, for_beta] = ops.parents;
        let (gamma, normal, incoming) = (values(&gamma), values(&normal), values(&incoming));

        let mut dx = vec![0.0_f32; rows * channels];
        let (mut dgamma, mut dbeta) = (vec![0.0_f32; channels], vec![0.0_f32; channels]);
        let share = 1.0 / channels as f32;
        vectorized(
            #[inline(always)]
            || {
                let inputs = normal.chunks_exact(channels).zip(incoming.chunks_exact(channels));
                for (((n, g), dx), inverse) in inputs.zip(dx.chunks_exact_mut(channels)).zip(&inverse) {
                    for ((((d, &n), &g), dg), db) in
                        dx.iter_mut().zip(n).zip(g).zip(dgamma.iter_mut()).zip(dbeta.iter_mut())
                    {
                        *d = g;
                        *dg += g * n;
                        *db += g;
                    }
                    for (d, gamma) in dx.iter_mut().zip(gamma) {
                        *d *= gamma;
                    }
                    let (mean, slope) = (sum(dx) * share, dot(dx, n) * share);
                    for (d, n) in dx.iter_mut().zip(n) {
                        *d = (*d - mean - n * slope) * inverse;
                    }
                }
            },
        );
        let dx = tensor(dx, [rows, channels]);
        for node in [for_a, for_b].into_iter().flatten() {
            gradients.register::<Flex>(node.id, dx.clone());
        }
        if let Some(node) = for_gamma {
            gradients.register::<Flex>(node.id, tensor(dgamma, [channels]));
        }
        if let Some(node) = for_beta {
            gradients.register::<Flex>(node.id, tensor(dbeta, [channels]));
        }
    }
}

pub fn tracked<C: CheckpointStrategy>(
    a: FloatTensor<Autodiff<Flex, C>>,
    b: FloatTensor<Autodiff<Flex, C>>,
    gamma: FloatTensor<Autodiff<Flex, C>>,
    beta: FloatTensor<Autodiff<Flex, C>>,
) -> FloatTensor<Autodiff<Flex, C>> {
    let nodes = [a.node(), b.node(), gamma.node(), beta.node()];
    let (output, normal, inverse) =
        forward(a.primitive(), b.primitive(), gamma.primitive(), beta.primitive());
    match AddNormBackward.prepare::<C>(nodes).compute_bound().stateful() {
        OpsKind::Tracked(prep) => {
            let shape = output.shape();
            let normal = tensor(normal, [shape[0], shape[1]]);
            prep.finish(State { gamma: gamma.primitive().clone(), normal, inverse }, output)
        }
        OpsKind::UnTracked(prep) => prep.finish(output),
    }
}
