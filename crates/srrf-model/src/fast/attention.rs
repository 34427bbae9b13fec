//! Multi-head attention on rows: head `h` owns the channels `h d .. (h + 1) d`, so that no head is
//! ever moved in memory. The probabilities are kept for the backward pass.

use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Flex, TensorMetadata};
use burn_flex::FlexTensor;

use super::kernels::{Matrix, contiguous, dot, matmul, softmax_rows, tensor, values, vectorized};

/// Where the matrices of cloud `c` and head `h` lie.
#[derive(Debug, Clone, Copy)]
struct Heads {
    clouds: usize,
    heads: usize,
    /// Queries a cloud.
    n: usize,
    /// Keys a cloud.
    m: usize,
    width: usize,
}

impl Heads {
    fn new(queries: &FlexTensor, keys_values: &FlexTensor, clouds: usize, heads: usize) -> Self {
        let (q, kv) = (queries.shape(), keys_values.shape());
        Self { clouds, heads, n: q[0] / clouds, m: kv[0] / clouds, width: q[1] }
    }

    fn per_head(&self) -> usize {
        self.width / self.heads
    }

    fn scale(&self) -> f32 {
        1.0 / (self.per_head() as f32).sqrt()
    }

    fn all(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let heads = self.heads;
        (0..self.clouds).flat_map(move |c| (0..heads).map(move |h| (c, h)))
    }

    /// `[n, d]` in the queries, and in the output.
    fn queries(&self, c: usize, h: usize) -> Matrix {
        let d = self.per_head();
        Matrix::new(self.clouds * self.n, self.width).part(c * self.n, self.n, h * d, d)
    }

    /// `[m, d]` in the keys and values.
    fn keys(&self, c: usize, h: usize) -> Matrix {
        let d = self.per_head();
        Matrix::new(self.clouds * self.m, 2 * self.width).part(c * self.m, self.m, h * d, d)
    }

    /// `[m, d]` in the keys and values.
    fn values(&self, c: usize, h: usize) -> Matrix {
        self.keys(c, h + self.heads)
    }

    /// `[n, m]` in the probabilities.
    fn probabilities(&self, c: usize, h: usize) -> Matrix {
        let first = (c * self.heads + h) * self.n;
        Matrix::new(self.clouds * self.heads * self.n, self.m).part(first, self.n, 0, self.m)
    }
}

/// The output and the probabilities, `[clouds, heads, n, m]`.
pub fn forward(
    queries: &FlexTensor,
    keys_values: &FlexTensor,
    clouds: usize,
    heads: usize,
) -> (FlexTensor, Vec<f32>) {
    let (queries, keys_values) = (contiguous(queries.clone()), contiguous(keys_values.clone()));
    let at = Heads::new(&queries, &keys_values, clouds, heads);
    let (q, kv) = (values(&queries), values(&keys_values));
    let mut p = vec![0.0_f32; clouds * heads * at.n * at.m];
    let mut out = vec![0.0_f32; clouds * at.n * at.width];
    for (c, h) in at.all() {
        let part = at.probabilities(c, h);
        matmul((&mut p, part), false, at.scale(), (q, at.queries(c, h)), (kv, at.keys(c, h).t()));
        softmax_rows(&mut p[part.start..part.start + at.n * at.m], at.m);
        matmul((&mut out, at.queries(c, h)), false, 1.0, (&p, part), (kv, at.values(c, h)));
    }
    (tensor(out, [clouds * at.n, at.width]), p)
}

#[derive(Debug)]
struct AttentionBackward;

/// What the backward pass needs.
#[derive(Debug, Clone)]
struct State {
    queries: FlexTensor,
    keys_values: FlexTensor,
    probabilities: FlexTensor,
    clouds: usize,
    heads: usize,
}

impl Backward<Flex, 2> for AttentionBackward {
    type State = State;

    fn backward(self, ops: Ops<State, 2>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let State { queries, keys_values, probabilities, clouds, heads } = ops.state;
        let (queries, keys_values) = (contiguous(queries), contiguous(keys_values));
        let at = Heads::new(&queries, &keys_values, clouds, heads);
        let incoming = contiguous(gradients.consume::<Flex>(&ops.node));
        let [for_queries, for_keys_values] = ops.parents;
        let (q, kv, p, g) =
            (values(&queries), values(&keys_values), values(&probabilities), values(&incoming));

        let mut dq = vec![0.0_f32; clouds * at.n * at.width];
        let mut dkv = vec![0.0_f32; clouds * at.m * 2 * at.width];
        let mut ds = vec![0.0_f32; at.n * at.m];
        let whole = Matrix::new(at.n, at.m);
        for (c, h) in at.all() {
            let part = at.probabilities(c, h);
            // O = P V: dV = P^T dO, dP = dO V^T.
            matmul((&mut dkv, at.values(c, h)), false, 1.0, (p, part.t()), (g, at.queries(c, h)));
            matmul((&mut ds, whole), false, 1.0, (g, at.queries(c, h)), (kv, at.values(c, h).t()));
            // P = softmax(S): dS = P o (dP - <dP, P>).
            through_softmax(&mut ds, &p[part.start..part.start + at.n * at.m], at.m);
            // S = scale Q K^T.
            matmul((&mut dq, at.queries(c, h)), false, at.scale(), (&ds, whole), (kv, at.keys(c, h)));
            matmul((&mut dkv, at.keys(c, h)), false, at.scale(), (&ds, whole.t()), (q, at.queries(c, h)));
        }
        if let Some(node) = for_queries {
            gradients.register::<Flex>(node.id, tensor(dq, [clouds * at.n, at.width]));
        }
        if let Some(node) = for_keys_values {
            gradients.register::<Flex>(node.id, tensor(dkv, [clouds * at.m, 2 * at.width]));
        }
    }
}

/// Turns the gradient of the probabilities into that of the scores, row by row.
fn through_softmax(gradient: &mut [f32], probabilities: &[f32], columns: usize) {
    vectorized(
        #[inline(always)]
        || {
            for (g, p) in gradient.chunks_exact_mut(columns).zip(probabilities.chunks_exact(columns)) {
                let mean = dot(g, p);
                for (g, p) in g.iter_mut().zip(p) {
                    *g = p * (*g - mean);
                }
            }
        },
    );
}

pub fn tracked<C: CheckpointStrategy>(
    queries: FloatTensor<Autodiff<Flex, C>>,
    keys_values: FloatTensor<Autodiff<Flex, C>>,
    clouds: usize,
    heads: usize,
) -> FloatTensor<Autodiff<Flex, C>> {
    let nodes = [queries.node(), keys_values.node()];
    let (output, probabilities) = forward(queries.primitive(), keys_values.primitive(), clouds, heads);
    match AttentionBackward.prepare::<C>(nodes).compute_bound().stateful() {
        OpsKind::Tracked(prep) => {
            let count = probabilities.len();
            let state = State {
                queries: queries.primitive().clone(),
                keys_values: keys_values.primitive().clone(),
                probabilities: tensor(probabilities, [count]),
                clouds,
                heads,
            };
            prep.finish(state, output)
        }
        OpsKind::UnTracked(prep) => prep.finish(output),
    }
}
