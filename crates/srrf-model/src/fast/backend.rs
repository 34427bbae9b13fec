//! The custom operations as an extension of Burn's backends.

use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Backend, Flex, backend_extension};

use super::group::Neighbours;
use super::linear::Activation;
use super::{add_norm, attention, group, group_norm, linear};

/// Operations that flex and LibTorch have on top of Burn's own.
#[backend_extension(Flex, LibTorch: cfg(feature = "libtorch"), Autodiff)]
pub trait FastOps: Backend {
    /// `act(x W + b)`.
    fn fast_linear(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        activation: Activation,
    ) -> FloatTensor<Self>;

    /// Multi-head attention.
    fn fast_attention(
        queries: FloatTensor<Self>,
        keys_values: FloatTensor<Self>,
        clouds: usize,
        heads: usize,
    ) -> FloatTensor<Self>;

    /// `LN(a + b)`.
    fn fast_add_norm(
        a: FloatTensor<Self>,
        b: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
    ) -> FloatTensor<Self>;

    /// Group norm, then ReLU.
    fn fast_group_norm_relu(
        x: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
        clouds: usize,
        groups: usize,
    ) -> FloatTensor<Self>;

    /// `relu(table[j] - shift[i])` for each neighbour `j` of each sample `i`.
    fn fast_gather_relu(
        table: FloatTensor<Self>,
        shift: FloatTensor<Self>,
        neighbours: Neighbours,
    ) -> FloatTensor<Self>;

    /// The largest of each channel over the neighbours of each sample.
    fn fast_gather_max(table: FloatTensor<Self>, neighbours: Neighbours, k: usize) -> FloatTensor<Self>;
}

impl FastOps for Flex {
    fn fast_linear(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        activation: Activation,
    ) -> FloatTensor<Self> {
        linear::forward(&x, &weight, &bias, activation)
    }

    fn fast_attention(
        queries: FloatTensor<Self>,
        keys_values: FloatTensor<Self>,
        clouds: usize,
        heads: usize,
    ) -> FloatTensor<Self> {
        attention::forward(&queries, &keys_values, clouds, heads).0
    }

    fn fast_add_norm(
        a: FloatTensor<Self>,
        b: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
    ) -> FloatTensor<Self> {
        add_norm::forward(&a, &b, &gamma, &beta).0
    }

    fn fast_group_norm_relu(
        x: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
        clouds: usize,
        groups: usize,
    ) -> FloatTensor<Self> {
        group_norm::forward(&x, &gamma, &beta, clouds, groups).0
    }

    fn fast_gather_relu(
        table: FloatTensor<Self>,
        shift: FloatTensor<Self>,
        neighbours: Neighbours,
    ) -> FloatTensor<Self> {
        group::gather_relu(&table, &shift, &neighbours)
    }

    fn fast_gather_max(table: FloatTensor<Self>, neighbours: Neighbours, k: usize) -> FloatTensor<Self> {
        group::gather_max(&table, &neighbours, k).0
    }
}

impl<C: CheckpointStrategy> FastOps for Autodiff<Flex, C> {
    fn fast_linear(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        activation: Activation,
    ) -> FloatTensor<Self> {
        linear::tracked::<C>(x, weight, bias, activation)
    }

    fn fast_attention(
        queries: FloatTensor<Self>,
        keys_values: FloatTensor<Self>,
        clouds: usize,
        heads: usize,
    ) -> FloatTensor<Self> {
        attention::tracked::<C>(queries, keys_values, clouds, heads)
    }

    fn fast_add_norm(
        a: FloatTensor<Self>,
        b: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
    ) -> FloatTensor<Self> {
        add_norm::tracked::<C>(a, b, gamma, beta)
    }

    fn fast_group_norm_relu(
        x: FloatTensor<Self>,
        gamma: FloatTensor<Self>,
        beta: FloatTensor<Self>,
        clouds: usize,
        groups: usize,
    ) -> FloatTensor<Self> {
        group_norm::tracked::<C>(x, gamma, beta, clouds, groups)
    }

    fn fast_gather_relu(
        table: FloatTensor<Self>,
        shift: FloatTensor<Self>,
        neighbours: Neighbours,
    ) -> FloatTensor<Self> {
        group::tracked_gather_relu::<C>(table, shift, neighbours)
    }

    fn fast_gather_max(table: FloatTensor<Self>, neighbours: Neighbours, k: usize) -> FloatTensor<Self> {
        group::tracked_gather_max::<C>(table, &neighbours, k)
    }
}
