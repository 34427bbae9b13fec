//! The learned methods that the paper compares, behind the [`Register`](srrf_cloud::Register) seam: one module each.
//!
//! Each is a [`LearnedConfig`] that `srrf-train` trains, and [`LearnedRegister`] runs:
//!
//! - [`PointNetLk`]: Lucas-Kanade on a PointNet's feature, with both Jacobians.
//! - [`Dcp`]: deep closest point, v1 and v2.
//! - [`Rgm`]: graph matching, with Sinkhorn in training and the Hungarian method at test.
//! - [`Panet`]: features at several scales, a pose by regression ("PANet-style").
//! - [`EquiGspr`]: equivariant graph layers on matches of FPFH ("Equi-GSPR-style").
//!
//! They see clouds as SRRF does ([`srrf_model::PairBatch`]: each centred, both divided by one scale) and
//! take their shared parts from `srrf-model`: neighbours, attention, soft matching, the SVD head. What
//! they have in common beyond that is in `dgcnn` and `pre_norm`.

#[macro_use]
mod list;
mod dgcnn;
mod learned;
mod pre_norm;
mod se3;

// A new baseline is a file beside this one, and a line here; in the order of the tables. Its trained weights and their
// card, where there are some, are `weights/NAME.safetensors` and `weights/NAME.md`.
learned_baselines! {
    pointnetlk::PointNetLkConfig, weights "pointnetlk";
    dcp::DcpConfig, weights "dcp";
    rgm::RgmConfig, weights "rgm";
    panet::PanetConfig, weights "panet";
    equi_gspr::EquiGsprConfig, weights "equi-gspr";
}

pub use learned::{LearnedConfig, LearnedRegister, Pose};
pub use list::{BaselineEntry, BaselineVisitor, embedded};
pub use srrf_model::embedded::TrainedWeights;
