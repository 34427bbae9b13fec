//! Group norm and the ReLU behind it, on the rows of several clouds.

use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Flex, TensorMetadata};
use burn_flex::FlexTensor;

use super::kernels::{contiguous, tensor, values, vectorized};

/// Added to the variance: the default of PyTorch and of Burn.
pub const EPSILON: f64 = 1e-5;

/// The output, and mean and inverse deviation of each group of each cloud, channel by channel.
pub fn forward(
    x: &FlexTensor,
    gamma: &FlexTensor,
    beta: &FlexTensor,
    clouds: usize,
    groups: usize,
) -> (FlexTensor, Vec<f32>, Vec<f32>) {
    let [x, gamma, beta] = [x, gamma, beta].map(|t| contiguous(t.clone()));
    let [rows, channels] = [x.shape()[0], x.shape()[1]];
    let per_cloud = rows / clouds.max(1);
    let count = per_cloud * channels / groups;
    let (x, gamma, beta) = (values(&x), values(&gamma), values(&beta));
    let mut out = vec![0.0_f32; rows * channels];
    let (mut means, mut inverses) = (vec![0.0_f32; clouds * channels], vec![0.0_f32; clouds * channels]);
    vectorized(
        #[inline(always)]
        || {
            let chunks = x.chunks_exact(per_cloud * channels).zip(out.chunks_exact_mut(per_cloud * channels));
            let stored = means.chunks_exact_mut(channels).zip(inverses.chunks_exact_mut(channels));
            for ((x, out), (mean, inverse)) in chunks.zip(stored) {
                for row in x.chunks_exact(channels) {
                    mean.iter_mut().zip(row).for_each(|(m, x)| *m += x);
                }
                group_mean(mean, groups, count);
                for row in x.chunks_exact(channels) {
                    for ((v, m), x) in inverse.iter_mut().zip(mean.iter()).zip(row) {
                        *v += (x - m) * (x - m);
                    }
                }
                group_mean(inverse, groups, count);
                inverse.iter_mut().for_each(|v| *v = 1.0 / (*v + EPSILON as f32).sqrt());
                for (row, out) in x.chunks_exact(channels).zip(out.chunks_exact_mut(channels)) {
                    let constants = mean.iter().zip(inverse.iter()).zip(gamma).zip(beta);
                    for ((o, x), (((m, s), g), b)) in out.iter_mut().zip(row).zip(constants) {
                        let y = (x - m) * s * g + b;
                        *o = if y < 0.0 { 0.0 } else { y }; // NaN stays, for the training loop to see
                    }
                }
            }
        },
    );
    (tensor(out, [rows, channels]), means, inverses)
}

/// Replaces the sums of the channels of each group by the mean over the group's `count` numbers.
#[inline(always)]
fn group_mean(sums: &mut [f32], groups: usize, count: usize) {
    let width = sums.len() / groups;
    for group in sums.chunks_exact_mut(width) {
        let mean = group.iter().sum::<f32>() / count as f32;
        group.fill(mean);
    }
}

#[derive(Debug)]
struct GroupNormBackward;

/// What the backward pass needs.
#[derive(Debug, Clone)]
struct State {
    x: FlexTensor,
    output: FlexTensor,
    gamma: FlexTensor,
    means: Vec<f32>,
    inverses: Vec<f32>,
    groups: usize,
}

impl Backward<Flex, 3> for GroupNormBackward {
    type State = State;

    fn backward(self, ops: Ops<State, 3>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let State { x, output, gamma, means, inverses, groups } = ops.state;
        let incoming = contiguous(gradients.consume::<Flex>(&ops.node));
        let [x, output, gamma] = [x, output, gamma].map(contiguous);
        let [rows, channels] = [x.shape()[0], x.shape()[1]];
        let clouds = means.len() / channels;
        let per_cloud = rows / clouds.max(1);
        let count = per_cloud * channels / groups;
        let [for_x, for_gamma, for_beta] = ops.parents;
        let (x, output, gamma, incoming) = (values(&x), values(&output), values(&gamma), values(&incoming));

        let mut dx = vec![0.0_f32; rows * channels];
        let (mut dgamma, mut dbeta) = (vec![0.0_f32; channels], vec![0.0_f32; channels]);
        vectorized(
            #[inline(always)]
            || {
                let size = per_cloud * channels;
                for cloud in 0..clouds {
                    let part = cloud * size..(cloud + 1) * size;
                    let (x, output, incoming) =
                        (&x[part.clone()], &output[part.clone()], &incoming[part.clone()]);
                    let dx = &mut dx[part];
                    let mean = &means[cloud * channels..][..channels];
                    let inverse = &inverses[cloud * channels..][..channels];
                    // Sums over the rows of g and of g * normal, by channel.
                    let (mut sum, mut slope) = (vec![0.0_f32; channels], vec![0.0_f32; channels]);
                    let all = x.chunks_exact(channels).zip(output.chunks_exact(channels));
                    let all = all.zip(incoming.chunks_exact(channels)).zip(dx.chunks_exact_mut(channels));
                    for (((x, o), g), d) in all {
                        for c in 0..channels {
                            let g = if o[c] > 0.0 { g[c] } else { 0.0 };
                            let normal = (x[c] - mean[c]) * inverse[c];
                            d[c] = g;
                            sum[c] += g;
                            slope[c] += g * normal;
                        }
                    }
                    for c in 0..channels {
                        dgamma[c] += slope[c];
                        dbeta[c] += sum[c];
                        sum[c] *= gamma[c];
                        slope[c] *= gamma[c];
                    }
                    group_mean(&mut sum, groups, count);
                    group_mean(&mut slope, groups, count);
                    for (x, d) in x.chunks_exact(channels).zip(dx.chunks_exact_mut(channels)) {
                        for c in 0..channels {
                            let normal = (x[c] - mean[c]) * inverse[c];
                            d[c] = (d[c] * gamma[c] - sum[c] - normal * slope[c]) * inverse[c];
                        }
                    }
                }
            },
        );
        if let Some(node) = for_x {
            gradients.register::<Flex>(node.id, tensor(dx, [rows, channels]));
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
    x: FloatTensor<Autodiff<Flex, C>>,
    gamma: FloatTensor<Autodiff<Flex, C>>,
    beta: FloatTensor<Autodiff<Flex, C>>,
    clouds: usize,
    groups: usize,
) -> FloatTensor<Autodiff<Flex, C>> {
    let nodes = [x.node(), gamma.node(), beta.node()];
    let (output, means, inverses) =
        forward(x.primitive(), gamma.primitive(), beta.primitive(), clouds, groups);
    match GroupNormBackward.prepare::<C>(nodes).compute_bound().stateful() {
        OpsKind::Tracked(prep) => {
            let state = State {
                x: x.primitive().clone(),
                output: output.clone(),
                gamma: gamma.primitive().clone(),
                means,
                inverses,
                groups,
            };
            prep.finish(state, output)
        }
        OpsKind::UnTracked(prep) => prep.finish(output),
    }
}
