//! Registers two point clouds of any size, unit and place, and says whether it worked.
//!
//! ```
//! use srrf_cloud::{EulerXyz, PointCloud, Rigid};
//! use srrf_corrupt::{shapes::ProceduralShapes, datasets::ShapeSource};
//! use rand::{SeedableRng, rngs::ChaCha8Rng};
//!
//! let shapes = ProceduralShapes::new(7, 3, None)?;
//! let source = shapes.sample(1, 2000, &mut ChaCha8Rng::seed_from_u64(1))?;
//! let motion = Rigid { rotation: EulerXyz::from_deg([20.0, -15.0, 30.0]).to_matrix(), ..Rigid::identity() };
//! let target = source.transformed(&motion);
//!
//! let found = srrf::register(&source, &target)?;
//! assert!(found.target_from_source.angle_to_deg(&motion) < 0.1);
//! assert!(!found.abstain);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Registrar`] holds the options and the network, and serves many pairs; [`Registrar::prepare`] makes
//! a target ready for many sources. A [`Request`] says what is to be registered, and holds a first guess if there is one.
//!
//! Coordinates go in and come out in `f64`, in the unit and the frame of the input. Inside, both clouds
//! are centred, so that map coordinates keep their last millimetre.

// The program's own modules speak of the library by its name, as any program does.
extern crate self as srrf;

mod align;
mod answer;
mod benchmark;
mod calibration;
#[doc(hidden)]
pub mod cli;
mod clock;
mod coarse;
mod error;
mod event;
mod features;
mod judge;
mod network;
mod options;
mod outcome;
mod poses;
mod probability;
mod proposals;
mod registrar;
mod request;
mod scale;
mod search;
mod skeleton;
mod stage;
mod start;
mod surface;
mod target;
mod undetermined;
mod warning;

pub use align::align;
pub use answer::{Answer, AnswerOrError, AnswerVersion, NoAnswer, RunKeys, answer_schema};
pub use calibration::{Calibration, CalibrationError, Logistic};
pub use coarse::CoarsePose;
pub use error::{Error, NoPose};
pub use event::{Event, Observed, Observer};
pub use features::Features;
pub use judge::{Judge, Judgement, ceiling};
pub use network::WeightsId;
pub use options::{Method, Options, OptionsError, RotationRange};
pub use outcome::{Outcome, PointCounts, TriedStart};
pub use poses::CandidatePose;
pub use probability::Probability;
pub use registrar::Registrar;
pub use request::{Request, RequestTarget};
pub use scale::{AppliedScale, CloudSize, ScaleDoubt, ScaleOrigin};
pub use skeleton::{FoundSkeleton, skeleton};
pub use srrf_align::Map;
pub use stage::{Stage, StageTime};
pub use start::Start;
pub use surface::{Counterpart, DrawnSurface, MeshedCloud, SurfaceDraw, SurfacePlan, draw_pair};
pub use target::Target;
pub use undetermined::Undetermined;
pub use warning::Warning;

use std::sync::OnceLock;

use srrf_cloud::PointCloud;

/// Registers `source` to `target` with the default options: `target ~ R source + t`.
///
/// The network is loaded on the first call and kept.
///
/// # Errors
/// [`Error`] for clouds that determine no rotation (fewer than three points, all on one line), and where
/// no pose is found.
pub fn register(source: &PointCloud, target: &PointCloud) -> Result<Outcome, Error> {
    static DEFAULT: OnceLock<Registrar> = OnceLock::new();
    let registrar = match DEFAULT.get() {
        Some(registrar) => registrar,
        None => {
            let loaded = Registrar::new(Options::default())?;
            DEFAULT.get_or_init(|| loaded)
        }
    };
    registrar.register(&Request::new(source, target))
}

/// The README's example compiles.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
