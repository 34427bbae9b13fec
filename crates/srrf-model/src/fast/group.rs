//! Gathering the rows of neighbours without moving more than needed: `relu(table[j] - shift[i])`, and
//! the maximum over the neighbours.

use std::sync::Arc;

use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Flex, TensorMetadata};
use burn_flex::FlexTensor;

use super::kernels::{contiguous, tensor, values, vectorized};

/// Row numbers of the neighbours, `k` for each sample.
pub type Neighbours = Arc<[i64]>;

/// `relu(table[j] - shift[i])` for each neighbour `j` of each sample `i`: `[samples * k, width]`.
pub fn gather_relu(table: &FlexTensor, shift: &FlexTensor, neighbours: &[i64]) -> FlexTensor {
    let (table, shift) = (contiguous(table.clone()), contiguous(shift.clone()));
    let [samples, width] = [shift.shape()[0], shift.shape()[1]];
    let (table, shift) = (values(&table), values(&shift));
    let k = neighbours.len() / samples.max(1);
    let mut out = vec![0.0_f32; neighbours.len() * width];
    vectorized(
        #[inline(always)]
        || {
            let groups = out.chunks_exact_mut(k * width).zip(neighbours.chunks_exact(k));
            for ((out, js), shift) in groups.zip(shift.chunks_exact(width)) {
                for (out, &j) in out.chunks_exact_mut(width).zip(js) {
                    let row = &table[j as usize * width..][..width];
                    for ((o, &t), &s) in out.iter_mut().zip(row).zip(shift) {
                        let d = t - s;
                        *o = if d < 0.0 { 0.0 } else { d };
                    }
                }
            }
        },
    );
    tensor(out, [neighbours.len(), width])
}

/// The largest of each channel over the rows of each sample's neighbours, `[samples, width]`, and the
/// row it came from (the first of equals).
pub fn gather_max(table: &FlexTensor, neighbours: &[i64], k: usize) -> (FlexTensor, Vec<u32>) {
    let table = contiguous(table.clone());
    let width = table.shape()[1];
    let samples = neighbours.len() / k;
    let table = values(&table);
    let mut out = vec![f32::NEG_INFINITY; samples * width];
    let mut from = vec![0_u32; samples * width];
    vectorized(
        #[inline(always)]
        || {
            let groups = out.chunks_exact_mut(width).zip(from.chunks_exact_mut(width));
            for ((out, from), js) in groups.zip(neighbours.chunks_exact(k)) {
                from.fill(js[0] as u32);
                for &j in js {
                    let row = &table[j as usize * width..][..width];
                    for ((o, f), &t) in out.iter_mut().zip(from.iter_mut()).zip(row) {
                        // NaN wins, so that the training loop sees it.
                        let larger = t > *o || t.is_nan();
                        *o = if larger { t } else { *o };
                        *f = if larger { j as u32 } else { *f };
                    }
                }
            }
        },
    );
    (tensor(out, [samples, width]), from)
}

#[derive(Debug)]
struct GatherReluBackward;

/// What the backward pass of [`gather_relu`] needs.
#[derive(Debug, Clone)]
struct GatherReluState {
    output: FlexTensor,
    neighbours: Neighbours,
    table_rows: usize,
    samples: usize,
}

impl Backward<Flex, 2> for GatherReluBackward {
    type State = GatherReluState;

    fn backward(self, ops: Ops<Self::State, 2>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let GatherReluState { output, neighbours, table_rows, samples } = ops.state;
        let incoming = contiguous(gradients.consume::<Flex>(&ops.node));
        let width = output.shape()[1];
        let k = neighbours.len() / samples.max(1);
        let (output, incoming) = (values(&output), values(&incoming));
        let mut dtable = vec![0.0_f32; table_rows * width];
        let mut dshift = vec![0.0_f32; samples * width];
        vectorized(
            #[inline(always)]
            || {
                let rows = output.chunks_exact(width).zip(incoming.chunks_exact(width));
                for (i, ((o, g), &j)) in rows.zip(neighbours.iter()).enumerate() {
                    let dt = &mut dtable[j as usize * width..][..width];
                    let ds = &mut dshift[i / k * width..][..width];
                    for (((dt, ds), &o), &g) in dt.iter_mut().zip(ds).zip(o).zip(g) {
                        let through = if o > 0.0 { g } else { 0.0 };
                        *dt += through;
                        *ds -= through;
                    }
                }
            },
        );
        let [for_table, for_shift] = ops.parents;
        if let Some(node) = for_table {
            gradients.register::<Flex>(node.id, tensor(dtable, [table_rows, width]));
        }
        if let Some(node) = for_shift {
            gradients.register::<Flex>(node.id, tensor(dshift, [samples, width]));
        }
    }
}

pub fn tracked_gather_relu<C: CheckpointStrategy>(
    table: FloatTensor<Autodiff<Flex, C>>,
    shift: FloatTensor<Autodiff<Flex, C>>,
    neighbours: Neighbours,
) -> FloatTensor<Autodiff<Flex, C>> {
    let nodes = [table.node(), shift.node()];
    let output = gather_relu(table.primitive(), shift.primitive(), &neighbours);
    match GatherReluBackward.prepare::<C>(nodes).compute_bound().stateful() {
        OpsKind::Tracked(prep) => {
            let (table_rows, samples) = (table.primitive().shape()[0], shift.primitive().shape()[0]);
            prep.finish(GatherReluState { output: output.clone(), neighbours, table_rows, samples }, output)
        }
        OpsKind::UnTracked(prep) => prep.finish(output),
    }
}

#[derive(Debug)]
struct GatherMaxBackward;

impl Backward<Flex, 1> for GatherMaxBackward {
    /// The row that each maximum came from, and the number of rows of the table.
    type State = (Arc<[u32]>, usize);

    fn backward(self, ops: Ops<Self::State, 1>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let (from, table_rows) = ops.state;
        let incoming = contiguous(gradients.consume::<Flex>(&ops.node));
        let width = incoming.shape()[1];
        let [for_table] = ops.parents;
        let Some(node) = for_table else { return };
        let mut dtable = vec![0.0_f32; table_rows * width];
        for (i, (&row, &g)) in from.iter().zip(values(&incoming)).enumerate() {
            dtable[row as usize * width + i % width] += g;
        }
        gradients.register::<Flex>(node.id, tensor(dtable, [table_rows, width]));
    }
}

pub fn tracked_gather_max<C: CheckpointStrategy>(
    table: FloatTensor<Autodiff<Flex, C>>,
    neighbours: &[i64],
    k: usize,
) -> FloatTensor<Autodiff<Flex, C>> {
    let nodes = [table.node()];
    let (output, from) = gather_max(table.primitive(), neighbours, k);
    match GatherMaxBackward.prepare::<C>(nodes).compute_bound().stateful() {
        OpsKind::Tracked(prep) => prep.finish((from.into(), table.primitive().shape()[0]), output),
        OpsKind::UnTracked(prep) => prep.finish(output),
    }
}
