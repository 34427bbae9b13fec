//! The custom operations on LibTorch as nodes of the graph, with their backward passes.

use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, LibTorch};
use burn_tch::TchTensor;
use tch::{Kind, Tensor};

use super::{
    add_norm, attention, by_head, by_row, gather_max, gather_relu, group_norm_relu, linear, mean_of_groups,
};
use crate::fast::backend::FastOps;
use crate::fast::group::Neighbours;
use crate::fast::linear::Activation;

type Tracked<C> = FloatTensor<Autodiff<LibTorch, C>>;

/// The gradient where a ReLU's output is above 0.
fn through_relu(gradient: &Tensor, output: &Tensor) -> Tensor {
    gradient.masked_fill(&output.le(0.0), 0.0)
}

/// The gradient of what was normalised, from that of the normal values: `mean` is over what was
/// normalised together.
fn through_norm(dn: &Tensor, normal: &Tensor, inverse: &Tensor, mean: impl Fn(&Tensor) -> Tensor) -> Tensor {
    let slope = mean(&(dn * normal));
    (dn - mean(dn) - normal * slope) * inverse
}

fn sum_rows(x: &Tensor) -> Tensor {
    x.sum_dim_intlist([0_i64].as_slice(), false, None::<Kind>)
}

#[derive(Debug)]
struct LinearBackward;

impl Backward<LibTorch, 3> for LinearBackward {
    /// Input, weight, output, activation.
    type State = (TchTensor, TchTensor, TchTensor, Activation);

    fn backward(self, ops: Ops<Self::State, 3>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let (x, weight, output, activation) = ops.state;
        let incoming = gradients.consume::<LibTorch>(&ops.node).tensor;
        let g = match activation {
            Activation::None => incoming,
            Activation::Relu => through_relu(&incoming, &output.tensor),
            Activation::Sigmoid => Tensor::sigmoid_backward(&incoming, &output.tensor),
        };
        let [for_x, for_weight, for_bias] = ops.parents;
        if let Some(node) = for_x {
            gradients.register::<LibTorch>(node.id, TchTensor::new(g.matmul(&weight.tensor.tr())));
        }
        if let Some(node) = for_weight {
            gradients.register::<LibTorch>(node.id, TchTensor::new(x.tensor.tr().matmul(&g)));
        }
        if let Some(node) = for_bias {
            gradients.register::<LibTorch>(node.id, TchTensor::new(sum_rows(&g)));
        }
    }
}

#[derive(Debug)]
struct AttentionBackward;

#[derive(Debug, Clone)]
struct AttentionState {
    queries: TchTensor,
    keys_values: TchTensor,
    probabilities: TchTensor,
    clouds: i64,
    heads: i64,
}

impl Backward<LibTorch, 2> for AttentionBackward {
    type State = AttentionState;

    fn backward(self, ops: Ops<Self::State, 2>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let AttentionState { queries, keys_values, probabilities, clouds, heads } = ops.state;
        let p = &probabilities.tensor;
        let q = by_head(&queries.tensor, clouds, heads);
        let scale = 1.0 / (q.size()[3] as f64).sqrt();
        let kv = by_head(&keys_values.tensor, clouds, 2 * heads);
        let (k, v) = (kv.narrow(1, 0, heads), kv.narrow(1, heads, heads));
        let g = by_head(&gradients.consume::<LibTorch>(&ops.node).tensor, clouds, heads);
        // O = P V: dV = P^T dO, dP = dO V^T. P = softmax(S). S = scale Q K^T.
        let dp = g.matmul(&v.transpose(2, 3));
        let ds = Tensor::internal_softmax_backward_data(&dp, p, -1, Kind::Float);
        let [for_queries, for_keys_values] = ops.parents;
        if let Some(node) = for_queries {
            gradients.register::<LibTorch>(node.id, TchTensor::new(by_row(&(ds.matmul(&k) * scale))));
        }
        if let Some(node) = for_keys_values {
            let dk = ds.transpose(2, 3).matmul(&(q * scale));
            let dv = p.transpose(2, 3).matmul(&g);
            gradients.register::<LibTorch>(node.id, TchTensor::new(by_row(&Tensor::cat(&[dk, dv], 1))));
        }
    }
}

#[derive(Debug)]
struct AddNormBackward;

impl Backward<LibTorch, 4> for AddNormBackward {
    /// Gamma, the normalised sum, the inverse deviations.
    type State = (TchTensor, TchTensor, TchTensor);

    fn backward(self, ops: Ops<Self::State, 4>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let (gamma, normal, inverse) = ops.state;
        let (normal, g) = (&normal.tensor, gradients.consume::<LibTorch>(&ops.node).tensor);
        let dn = &g * &gamma.tensor;
        let mean = |x: &Tensor| x.mean_dim([1_i64].as_slice(), true, None::<Kind>);
        let dx = TchTensor::new(through_norm(&dn, normal, &inverse.tensor, mean));
        let [for_a, for_b, for_gamma, for_beta] = ops.parents;
        for node in [for_a, for_b].into_iter().flatten() {
            gradients.register::<LibTorch>(node.id, dx.clone());
        }
        if let Some(node) = for_gamma {
            gradients.register::<LibTorch>(node.id, TchTensor::new(sum_rows(&(&g * normal))));
        }
        if let Some(node) = for_beta {
            gradients.register::<LibTorch>(node.id, TchTensor::new(sum_rows(&g)));
        }
    }
}

#[derive(Debug)]
struct GroupNormBackward;

#[derive(Debug, Clone)]
struct GroupNormState {
    gamma: TchTensor,
    output: TchTensor,
    normal: TchTensor,
    inverse: TchTensor,
}

impl Backward<LibTorch, 3> for GroupNormBackward {
    type State = GroupNormState;

    fn backward(self, ops: Ops<Self::State, 3>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let GroupNormState { gamma, output, normal, inverse } = ops.state;
        let g = through_relu(&gradients.consume::<LibTorch>(&ops.node).tensor, &output.tensor);
        let (normal, inverse) = (&normal.tensor, &inverse.tensor);
        let (rows, channels) = (normal.size()[0], normal.size()[1]);
        let [for_x, for_gamma, for_beta] = ops.parents;
        if let Some(node) = for_x {
            let (clouds, groups) = (inverse.size()[0], inverse.size()[2]);
            let grouped = [clouds, rows / clouds, groups, channels / groups];
            let (dn, n) = ((&g * &gamma.tensor).reshape(grouped), normal.reshape(grouped));
            let dx = through_norm(&dn, &n, inverse, mean_of_groups);
            gradients.register::<LibTorch>(node.id, TchTensor::new(dx.reshape([rows, channels])));
        }
        if let Some(node) = for_gamma {
            gradients.register::<LibTorch>(node.id, TchTensor::new(sum_rows(&(&g * normal))));
        }
        if let Some(node) = for_beta {
            gradients.register::<LibTorch>(node.id, TchTensor::new(sum_rows(&g)));
        }
    }
}

#[derive(Debug)]
struct GatherReluBackward;

impl Backward<LibTorch, 2> for GatherReluBackward {
    /// The output, the row numbers, rows of the table, samples.
    type State = (TchTensor, TchTensor, i64, i64);

    fn backward(self, ops: Ops<Self::State, 2>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let (output, rows, table_rows, samples) = ops.state;
        let g = through_relu(&gradients.consume::<LibTorch>(&ops.node).tensor, &output.tensor);
        let width = g.size()[1];
        let [for_table, for_shift] = ops.parents;
        if let Some(node) = for_table {
            let dtable = Tensor::zeros([table_rows, width], (g.kind(), g.device()));
            gradients.register::<LibTorch>(node.id, TchTensor::new(dtable.index_add(0, &rows.tensor, &g)));
        }
        if let Some(node) = for_shift {
            let sum =
                g.reshape([samples, -1, width]).sum_dim_intlist([1_i64].as_slice(), false, None::<Kind>);
            gradients.register::<LibTorch>(node.id, TchTensor::new(-sum));
        }
    }
}

#[derive(Debug)]
struct GatherMaxBackward;

impl Backward<LibTorch, 1> for GatherMaxBackward {
    /// The row that each maximum came from, rows of the table.
    type State = (TchTensor, i64);

    fn backward(self, ops: Ops<Self::State, 1>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let (from, table_rows) = ops.state;
        let g = gradients.consume::<LibTorch>(&ops.node).tensor;
        let [Some(node)] = ops.parents else { return };
        let dtable = Tensor::zeros([table_rows, g.size()[1]], (g.kind(), g.device()));
        gradients.register::<LibTorch>(node.id, TchTensor::new(dtable.scatter_add(0, &from.tensor, &g)));
    }
}

impl<C: CheckpointStrategy> FastOps for Autodiff<LibTorch, C> {
    fn fast_linear(
        x: Tracked<C>,
        weight: Tracked<C>,
        bias: Tracked<C>,
        activation: Activation,
    ) -> Tracked<C> {
        let nodes = [x.node(), weight.node(), bias.node()];
        let output = linear(x.primitive(), weight.primitive(), bias.primitive(), activation);
        match LinearBackward.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => {
                let state = (x.primitive().clone(), weight.primitive().clone(), output.clone(), activation);
                prep.finish(state, output)
            }
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }

    fn fast_attention(
        queries: Tracked<C>,
        keys_values: Tracked<C>,
        clouds: usize,
        heads: usize,
    ) -> Tracked<C> {
        let nodes = [queries.node(), keys_values.node()];
        let (clouds, heads) = (clouds as i64, heads as i64);
        let (output, p) = attention(queries.primitive(), keys_values.primitive(), clouds, heads);
        match AttentionBackward.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => {
                let (queries, keys_values) = (queries.primitive().clone(), keys_values.primitive().clone());
                let probabilities = TchTensor::new(p);
                prep.finish(AttentionState { queries, keys_values, probabilities, clouds, heads }, output)
            }
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }

    fn fast_add_norm(a: Tracked<C>, b: Tracked<C>, gamma: Tracked<C>, beta: Tracked<C>) -> Tracked<C> {
        let nodes = [a.node(), b.node(), gamma.node(), beta.node()];
        let (output, normal, inverse) =
            add_norm(a.primitive(), b.primitive(), gamma.primitive(), beta.primitive());
        match AddNormBackward.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => {
                let kept = (TchTensor::new(normal), TchTensor::new(inverse));
                prep.finish((gamma.primitive().clone(), kept.0, kept.1), output)
            }
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }

    fn fast_group_norm_relu(
        x: Tracked<C>,
        gamma: Tracked<C>,
        beta: Tracked<C>,
        clouds: usize,
        groups: usize,
    ) -> Tracked<C> {
        let nodes = [x.node(), gamma.node(), beta.node()];
        let (clouds, groups) = (clouds as i64, groups as i64);
        let (output, normal, inverse) =
            group_norm_relu(x.primitive(), gamma.primitive(), beta.primitive(), clouds, groups);
        match GroupNormBackward.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => {
                let (normal, inverse) = (TchTensor::new(normal), TchTensor::new(inverse));
                let gamma = gamma.primitive().clone();
                prep.finish(GroupNormState { gamma, output: output.clone(), normal, inverse }, output)
            }
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }

    fn fast_gather_relu(table: Tracked<C>, shift: Tracked<C>, neighbours: Neighbours) -> Tracked<C> {
        let nodes = [table.node(), shift.node()];
        let (output, rows) = gather_relu(table.primitive(), shift.primitive(), &neighbours);
        match GatherReluBackward.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => {
                let sizes = (table.primitive().tensor.size()[0], shift.primitive().tensor.size()[0]);
                prep.finish((output.clone(), TchTensor::new(rows), sizes.0, sizes.1), output)
            }
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }

    fn fast_gather_max(table: Tracked<C>, neighbours: Neighbours, k: usize) -> Tracked<C> {
        let nodes = [table.node()];
        let (output, from) = gather_max(table.primitive(), &neighbours, k);
        match GatherMaxBackward.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => {
                prep.finish((TchTensor::new(from), table.primitive().tensor.size()[0]), output)
            }
            OpsKind::UnTracked(prep) => prep.finish(output),
        }
    }
}
