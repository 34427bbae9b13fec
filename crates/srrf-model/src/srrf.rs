//! The pipeline: the paper's figure 2, one statement a stage.

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use serde::{Deserialize, Serialize};

use crate::branch::{Branch, BranchConfig, BranchOutput};
use crate::integration::{Fusion, IntegrationConfig};
use crate::sem::{Sem, SemConfig, Skeleton};

/// Sizes of the whole network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SrrfConfig {
    /// The skeleton extraction module.
    pub sem: SemConfig,
    /// The branch on the corrupted clouds, superscript c in the paper.
    pub dense: BranchConfig,
    /// The branch on the skeletons, superscript s.
    pub skeleton: BranchConfig,
    /// The transformation integration.
    pub integration: IntegrationConfig,
}

impl SrrfConfig {
    /// A new network; see [`crate::init::seeded`] for weights that do not depend on the backend.
    pub fn init(&self, device: &Device) -> Srrf {
        Srrf {
            sem: self.sem.init(device),
            dense: self.dense.init(device),
            skeleton: self.skeleton.init(device),
        }
    }
}

/// The network.
#[derive(Module, Debug)]
pub struct Srrf {
    /// Skeleton extraction.
    pub sem: Sem,
    /// The branch on the corrupted clouds.
    pub dense: Branch,
    /// The branch on the skeletons.
    pub skeleton: Branch,
}

/// Everything that a reader may want to see.
#[derive(Debug, Clone)]
pub struct SrrfOutput {
    /// Skeletons `X^s`.
    pub source_skeleton: Skeleton,
    /// Skeletons `Y^s`.
    pub target_skeleton: Skeleton,
    /// `{R_c, t_c}` and its soft matches.
    pub dense: BranchOutput,
    /// `{R_s, t_s}` and its soft matches.
    pub skeleton: BranchOutput,
    /// `{R, t}`, the inlier ratios and lambda.
    pub fused: Fusion,
}

impl Srrf {
    /// Registers a batch of pairs of centred clouds (see [`crate::PairBatch`]). `phase` in [0, 1)
    /// chooses which points carry tokens; 0.5 at inference.
    ///
    /// # Shapes
    /// - `source`, `target`: `[batch, points, 3]`
    pub fn forward(
        &self,
        integration: &IntegrationConfig,
        source: Tensor<3>,
        target: Tensor<3>,
        phase: f32,
    ) -> SrrfOutput {
        // (1) Skeletal extraction, Eq. (5) and (6).
        let source_skeleton = self.sem.forward(source.clone());
        let target_skeleton = self.sem.forward(target.clone());
        // The gradient stop between SEM and registration.
        let (source_stopped, target_stopped) =
            (source_skeleton.detached_points(), target_skeleton.detached_points());
        // (2, 3) Features, interaction, matching and SVD: {R_s, t_s} and {R_c, t_c}.
        let skeleton = self.skeleton.forward(source_stopped, target_stopped, phase);
        let dense = self.dense.forward(source.clone(), target.clone(), phase);
        // (4) Integration: {R, t} = lambda {R_c, t_c} + (1 - lambda) {R_s, t_s}.
        let fused = integration.fuse(dense.pose(), skeleton.pose(), &source, &target);
        SrrfOutput { source_skeleton, target_skeleton, dense, skeleton, fused }
    }
}
