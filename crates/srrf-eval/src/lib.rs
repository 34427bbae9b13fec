//! Scores registration methods on corrupted pairs: one scorer for every method.
//!
//! A run goes through these stages, each a module:
//!
//! 1. pairs come from shapes ([`SynthesizedPairs`]) or from a file ([`PairFile`]); both are a
//!    [`PairSource`];
//! 2. [`Run`] gives them to the methods of a [`MethodSet`], chosen from the [`registry`], and keeps every answer;
//! 3. every answer becomes a [`PoseError`], and many become [`Scores`];
//! 4. [`Summary`] has them per corruption, severity and method;
//! 5. [`report`] writes tables, curves and `results.json`; [`tables`] runs many experiments and makes the
//!    whole report of the paper's tables and figures.
//!
//! A method of your own goes the same way: [`MethodSet::with`], see `examples/own_method.rs`. A new learned baseline is one file
//! and one line in `srrf-baselines`, a new classical method one line in the [`registry`].

mod answers;
mod cache;
mod certainty;
mod chamfer;
mod cli;
pub mod data;
mod error;
mod kept;
mod method_set;
mod methods;
mod metrics;
mod pair_file;
mod pairs;
mod protocol;
mod quantities;
pub mod report;
mod rows;
mod run;
mod summary;
pub mod tables;
mod transforms;

pub use answers::{Answer, PairRecord, RunOutcome};
pub use cache::Cache;
pub use certainty::{CertaintyBin, CertaintyScores, Claim};
pub use chamfer::{CleanShape, SkeletonAgreement};
pub use cli::{EvalCommand, EvalOptions, command};
pub use error::{EvalError, PairFault};
pub use method_set::{DefaultRows, MethodSet};
pub use methods::{
    MethodContext, MethodEntry, MethodFamily, ReadyMethod, SetupError, Shown, all_rows, registry,
};
pub use metrics::{
    MetricError, PoseError, RECALL_ROTATION_DEG, RECALL_TRANSLATION, RIGHT_RADIUS_SHARE, RIGHT_ROTATION_DEG,
    Scores, is_right,
};
pub use pair_file::{PairFile, export};
pub use pairs::{EvalPair, Group, PairSource};
pub use protocol::{CLEAN, Protocol, SynthesizedPairs};
pub use report::Meta;
pub use rows::{RowSource, TableRow};
pub use run::Run;
pub use summary::{SeverityKey, Summary, SummaryRow};
pub use tables::TablesOptions;
pub use transforms::Transforms;
