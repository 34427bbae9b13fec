//! Group norm on the rows of several clouds.

use burn::module::{Module, Param};
use burn::tensor::{Device, Tensor};

use crate::fast::group_norm_relu;

/// Group norm (Wu and He 2018) over the channels of a group and all points of a cloud: what batch norm
/// does, without statistics that other clouds or earlier steps have a part in.
#[derive(Module, Debug)]
pub struct GroupNorm {
    gamma: Param<Tensor<1>>,
    beta: Param<Tensor<1>>,
    groups: usize,
}

impl GroupNorm {
    /// `channels` in `groups` groups, or in as many as divide them, if fewer.
    pub fn new(channels: usize, groups: usize, device: &Device) -> Self {
        let groups = (1..=groups.min(channels).max(1)).rev().find(|g| channels.is_multiple_of(*g));
        Self {
            gamma: Param::from_tensor(Tensor::ones([channels], device)),
            beta: Param::from_tensor(Tensor::zeros([channels], device)),
            groups: groups.unwrap_or(1),
        }
    }

    /// The norm, then ReLU. `clouds` is how many clouds the rows belong to, in turn.
    ///
    /// # Shapes
    /// - `x` and output: `[clouds * n, channels]`
    pub fn relu(&self, x: Tensor<2>, clouds: usize) -> Tensor<2> {
        group_norm_relu(x, self.gamma.val(), self.beta.val(), clouds, self.groups)
    }
}
