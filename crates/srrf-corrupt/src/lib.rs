//! The paper's twelve point-cloud corruptions at five severities, and the registration pairs
//! made with them.
//!
//! Every corruption works in the *canonical frame*: a cloud centred on its mean with radius 1
//! ([`srrf_cloud::PointCloud::to_unit_sphere`]). Each has a file of its own in [`corruptions`], with its numbers
//! and their sources; where the paper's text and the reference code differ, [`Variants`] names both and
//! defaults to the text.
//!
//! ```
//! use srrf_corrupt::{shapes::ProceduralShapes, datasets::ShapeSource};
//! use srrf_corrupt::{CorruptionKind, PairConfig, PairSynthesizer, PoseDraw, Severity, Stream, oracle_pose};
//!
//! let shapes = ProceduralShapes::new(7, 3, None)?;
//! let synthesizer = PairSynthesizer::new(PairConfig::default())?;
//! let corruption = Some((CorruptionKind::Cutout, Severity::try_from(3)?));
//! let pair = synthesizer.pair(&shapes, 0, corruption, PoseDraw::Seeded, Stream { seed: 1, item: 0 })?;
//! assert_eq!((pair.source.len(), pair.target.len()), (1024, 1024));
//! // Cutouts leave the other points exact, so that perfect correspondences give the exact pose.
//! let oracle = oracle_pose(&pair).ok_or("nothing in common")?;
//! assert!(oracle.angle_to_deg(&pair.target_from_source) < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod building;
mod card;
pub mod cli;
mod corruption;
pub mod corruptions;
pub mod crop;
pub mod datasets;
mod kind;
mod mixture;
mod normalize;
mod pairs;
mod severity;
pub mod shapes;
pub mod solids;
mod variants;
pub mod views;

pub use card::{Card, Family, REFERENCE_POINTS, Strength};
pub use corruption::{CorruptError, Corrupted, Corruption, check_points};
pub use corruptions::CorruptionKind;
pub use datasets::Label;
pub use kind::{UnknownCorruption, corruption};
pub use mixture::Mixture;
pub use normalize::{BoxFrame, box_normalize};
pub use pairs::{
    Bases, Corrupt, InvalidConfig, Normalize, Pair, PairConfig, PairError, PairSynthesizer, PoseDraw,
    Purpose, RotationRange, Sampling, Stream, dcp_test_pose, oracle_pose,
};
pub use severity::{Severity, SeverityOutOfRange, Stepped};
pub use variants::{DensityInc, InvalidVariant, Variants};
