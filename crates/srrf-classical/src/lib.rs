//! Classical registration methods behind the [`Register`](srrf_cloud::Register) seam: one module each.
//!
//! - [`Identity`]: moves nothing; the chance level.
//! - [`Icp`]: iterative closest point, point to point.
//! - [`IcpPlane`], [`IcpTrimmed`], [`IcpRobust`]: its variants with planes, with the nearest matches only, with
//!   a robust kernel.
//! - [`FpfhRansac`], [`Fgr`]: global methods, which need no start, with refinement behind them.
//!
//! [`GraphConsensus`] and [`RansacConsensus`] find poses in any [`Correspondences`], whatever made them.
//!
//! [`PpfModel`] finds a part in a scene by the features of its pairs of points.
//!
//! Their parts, [`fpfh`](mod@fpfh) and [`nearest_descriptors`], serve other methods as well.

mod compatibility;
mod consensus;
mod correspond;
mod fgr;
pub mod fpfh;
mod fpfh_cloud;
mod fpfh_ransac;
mod graph_consensus;
mod icp;
mod icp_loop;
mod icp_plane;
mod icp_robust;
mod icp_trimmed;
mod identity;
mod memo;
mod ppf;
mod ransac;
mod synthetic;

pub use consensus::{Correspondences, CorrespondencesError, SupportedPose};
pub use correspond::nearest_descriptors;
pub use fgr::{Fgr, FgrConfig};
pub use fpfh_cloud::FpfhCloud;
pub use fpfh_ransac::{FpfhRansac, FpfhRansacConfig, Hypotheses};
pub use graph_consensus::GraphConsensus;
pub use icp::{Icp, IcpConfig};
pub use icp_plane::{IcpPlane, IcpPlaneConfig};
pub use icp_robust::{IcpRobust, IcpRobustConfig};
pub use icp_trimmed::{IcpTrimmed, IcpTrimmedConfig};
pub use identity::Identity;
pub use ppf::{PpfConfig, PpfModel, VotedPose};
pub use ransac::RansacConsensus;
pub use synthetic::synthetic;
