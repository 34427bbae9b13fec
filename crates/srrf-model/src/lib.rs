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
pub mod geometry;
mod inference;
pub mod init;
mod integration;
mod layout;
mod loss;
mod matching;
mod memory;
mod norm;
mod pfi;
mod prior;
mod procrustes;
mod register;
mod sem;
mod sem_loss;
mod sfe;
mod sizes;
mod srrf;
mod timing;
pub mod weights;

pub use batch::{HostPairs, PairBatch, PairFrame};
pub use branch::{Branch, BranchConfig, BranchOutput};
pub use device::{
    DeviceError, NAMES as DEVICE_NAMES, built_in as built_in_devices, device, devices, is_accelerator,
    kind as device_kind,
};
pub use inference::{InferenceConfig, Matches};
pub use integration::{BranchPose, Fusion, InlierTest, IntegrationConfig};
pub use layout::{BranchLayout, Neighbourhood, SemLayout, SrrfLayout};
pub use loss::{correspondence_loss, matching_loss, registration_loss};
pub use matching::{MatchingConfig, Scaled, SoftMatches, SoftMatching, sinkhorn, soft_matches, standardised};
pub use memory::keep_freed_memory;
pub use norm::GroupNorm;
pub use pfi::{Pfi, PfiConfig};
pub use prior::PositionPrior;
pub use procrustes::{nearest_rotation, procrustes, transform, weighted_procrustes};
pub use register::{SrrfRegister, subsample};
pub use sem::{LevelConfig, Sem, SemConfig, Skeleton, nearest_distance};
pub use sem_loss::{SkeletonLoss, SkeletonLossConfig, chamfer, skeleton_loss, spread};
pub use sfe::{Sfe, SfeConfig};
pub use sizes::{NetworkConfig, WrongSize};
pub use srrf::{BranchKind, Srrf, SrrfConfig, SrrfOutput};
