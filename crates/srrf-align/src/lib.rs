//! Many scans into one frame, and what may be trusted of it.
//!
//! [`align`] takes scans by number ([`Scans`]) and a method that registers two of them ([`RegisterPairs`]), and gives a [`Map`]:
//!
//! 1. Pairs that may overlap are chosen by descriptors, first guesses or order, and registered: the edges.
//! 2. Loops of edges say which contradict each other, by belief propagation.
//! 3. A pose graph with a truncated loss gives poses; scans that nothing joins are components of their own.
//! 4. All poses are refined at once on the points, and get a covariance.
//!
//! It knows no network and no file: the crate `srrf` brings both.

mod align;
mod belief;
mod consensus;
mod evenness;
mod graph;
mod implied;
mod joint;
mod layout;
mod likeness;
mod loops;
mod map;
mod near;
mod options;
mod overlay;
mod pair;
mod placed;
mod pool;
mod rounds;
mod se3;
mod seen;
mod sight;
mod sparse;
mod surface;
mod trees;
mod truncated;
mod trust;
mod upright;
mod verify;

pub use align::align;
pub use consensus::EdgeVerdict;
pub use graph::{GraphEdge, Optimised, optimise};
pub use map::{Map, MapEdge, OpenMotion, PairChoice, PlacedScan, WorstLoop};
pub use options::{AlignError, AlignOptions, AlignProgress, AlignStage, PairReason};
pub use pair::{NoStore, OtherPose, PairAnswer, PairStore, RegisterPairs, Scans};
