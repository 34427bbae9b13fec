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

mod dcp;
mod dgcnn;
mod equi_gspr;
mod learned;
mod panet;
mod pointnetlk;
mod pre_norm;
mod rgm;
mod se3;

pub use dcp::{Dcp, DcpConfig, DcpLosses, DcpVersion};
pub use equi_gspr::{EquiGspr, EquiGsprConfig, EquiGsprLosses, PutativeMatches};
pub use learned::{LearnedConfig, LearnedRegister, Lesson, Pose, embedded};
pub use panet::{Panet, PanetConfig, PanetLosses};
pub use pointnetlk::{LkJacobian, PointNetLk, PointNetLkConfig, PointNetLkLosses};
pub use rgm::{Rgm, RgmConfig, RgmLosses};
