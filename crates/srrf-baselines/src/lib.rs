//! Classical registration methods behind the [`Register`](srrf_cloud::Register) seam: one module
//! each.
//!
//! - [`Identity`]: moves nothing; the chance level.
//! - [`Icp`]: iterative closest point, point to point.

mod icp;
mod identity;

pub use icp::{Icp, IcpConfig};
pub use identity::Identity;
