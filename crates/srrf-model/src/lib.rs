//! The SRRF network: skeleton extraction, structural features, feature interaction, soft matching,
//! a differentiable SVD, and the fusion of both branches, as Burn modules.
//!
//! The modules name no backend: the device picks it at run time. [`Srrf::forward`] reads as the
//! paper's figure 2; each stage is one file.
//!
//! Clouds enter in network units (see [`PairBatch`]). For registration in any unit, use
//! [`SrrfRegister`].

pub mod attention;
mod batch;
mod branch;
mod confidence;
pub mod defaults;
mod device;
pub mod embedded;
pub mod fast;
mod inference;
pub mod init;
mod integration;
pub mod losses;
mod matching;
mod memory;
mod norm;
pub mod ops;
mod pfi;
mod prior;
mod procrustes;
pub mod ranges;
mod register;
mod sem;
mod sfe;
mod sizes;
mod srrf;
mod timing;
mod training_batch;
pub mod weights;

pub use batch::{HostPairs, PairBatch, network_frame};
pub use branch::{BranchConfig, BranchLayout, BranchOutput, RegistrationBranch};
pub use device::{
    DeviceError, NAMES as DEVICE_NAMES, built_in as built_in_devices, device, devices, is_accelerator,
    kind as device_kind,
};
pub use inference::{InferenceConfig, Matches};
pub use integration::{BranchRatios, CommonRatios, Fusion, IntegrationRule, McNemar, PosedMatches};
pub use losses::{
    SkeletonLoss, SkeletonLossConfig, chamfer, correspondence_loss, matching_loss, registration_loss,
    skeleton_loss, spread,
};
pub use matching::{MatchingConfig, Scaled, SoftMatches, SoftMatching, sinkhorn, soft_matches, standardised};
pub use memory::keep_freed_memory;
pub use norm::GroupNorm;
pub use ops::{CopyError, nearest_distance};
pub use pfi::{Pfi, PfiConfig};
pub use prior::PositionPrior;
pub use procrustes::{nearest_rotation, procrustes, transform, weighted_procrustes};
pub use register::{SrrfRegister, subsample};
pub use sem::{LevelConfig, Sem, SemConfig, SemLayout, SkeletonBatch};
pub use sfe::{Neighbourhood, Sfe, SfeConfig};
pub use sizes::{NetworkConfig, WrongSize};
pub use srrf::{NetworkBranch, Srrf, SrrfConfig, SrrfLayout, SrrfOutput};
pub use training_batch::TrainingBatch;
