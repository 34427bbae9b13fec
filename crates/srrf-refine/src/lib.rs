//! Local refinement of rigid poses between corrupted point clouds.
//!
//! A registration network, or a global method, gives a pose that is a few degrees off. [`refine`]
//! takes such poses and gives the exact one, with [`Evidence`] for it, and says when exactness
//! makes no sense because the clouds are deformed ([`Verdict`]). [`Refined`] puts it behind any
//! [`srrf_cloud::Register`]. A [`RefineTarget`] is prepared once and serves many sources.
//!
//! ```
//! use srrf_cloud::{EulerXyz, Rigid};
//! use srrf_corrupt::{shapes::ProceduralShapes, datasets::ShapeSource};
//! use srrf_corrupt::{CorruptionKind, PairConfig, PairSynthesizer, PoseDraw, Severity, Stream};
//! use srrf_refine::{RefineConfig, refine};
//!
//! let shapes = ProceduralShapes::new(7, 3, None)?;
//! let pairs = PairSynthesizer::new(PairConfig::default())?;
//! let cutout = Some((CorruptionKind::Cutout, Severity::try_from(3)?));
//! let pair = pairs.pair(&shapes, 0, cutout, PoseDraw::Seeded, Stream { seed: 1, item: 0 })?;
//! let off = Rigid { rotation: EulerXyz::from_deg([3.0, -2.0, 4.0]).to_matrix(), ..Rigid::identity() };
//! let start = pair.target_from_source.compose(&off);
//! let found = refine(&pair.source, &pair.target, &[start], &RefineConfig::default())?;
//! assert!(found.kept && found.target_from_source.angle_to_deg(&pair.target_from_source) < 0.1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod affine;
mod alternatives;
mod assess;
mod chance;
mod config;
mod deformation;
mod elsewhere;
mod evidence;
mod freedom;
mod matching;
mod orientations;
mod prepared;
mod probe;
mod refine;
mod register;
mod robust;
mod scatter;
mod soft;
mod solve;
mod symmetry;
mod target;
mod twist;
mod verdict;

pub use affine::AffineFit;
pub use alternatives::{Alternative, Challengers};
pub use assess::Assessment;
pub use chance::Chance;
pub use config::{Deformed, Metric, Ranking, RefineConfig, RefineError};
pub use deformation::ResidualStructure;
pub use evidence::Evidence;
pub use freedom::{FreeMotion, Freedom};
pub use refine::{Refinement, StartSupport};
pub use register::Refined;
pub use scatter::Scatter;
pub use solve::{Match, NormalEquations};
pub use target::{RefineSource, RefineTarget, refine};
pub use twist::{MotionKind, Twist};
pub use verdict::Verdict;
