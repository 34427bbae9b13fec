//! The paper's twelve point-cloud corruptions at five severities, and the registration pairs
//! made with them.
//!
//! Every corruption works in the *canonical frame*: a cloud centred on its mean with radius 1
//! ([`srrf_cloud::PointCloud::to_unit_sphere`]). All numbers, each with its source, are in
//! [`parameters`]; where the paper's text and the reference code differ, [`Variants`] names both
//! and defaults to the text.

mod corruption;
pub mod corruptions;
mod kind;
mod normalize;
mod pair;
pub mod parameters;
mod severity;
mod variants;

pub use corruption::{CorruptError, Corrupted, Corruption, corruption};
pub use kind::{CorruptionKind, UnknownCorruption};
pub use normalize::{BoxFrame, box_normalize};
pub use pair::{
    Bases, Corrupt, InvalidConfig, Label, Normalize, Pair, PairConfig, PairError, PairSynthesizer, PoseDraw,
    Purpose, RotationRange, Sampling, Stream, dcp_test_pose, oracle_pose,
};
pub use severity::{Severity, SeverityOutOfRange};
pub use variants::{DensityInc, InvalidVariant, Variants};
