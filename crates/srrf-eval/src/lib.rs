//! Scores registration methods on corrupted pairs: one scorer for every method.
//!
//! A run goes through these stages, each a module:
//!
//! 1. pairs come from shapes ([`SynthesizedPairs`]) or from a file ([`PairFile`]); both are a
//!    [`PairSource`];
//! 2. [`Run`] gives them to the methods of the registry ([`METHODS`]) and keeps every answer;
//! 3. every answer becomes a [`PairError`], and many become [`Scores`];
//! 4. [`Summary`] has them per corruption, severity and method;
//! 5. [`report`] writes tables, curves and `results.json`; [`tables`] runs many experiments and makes the
//!    whole report of the paper's tables and figures.
//!
//! A new method is one entry in [`METHODS`].

mod arrays;
mod cache;
mod chamfer;
mod cli;
mod curves;
pub mod data;
mod error;
mod found;
mod methods;
mod metrics;
mod npz_writer;
mod pair_file;
mod pairs;
mod quantities;
pub mod report;
mod run;
mod summary;
mod synthesized;
mod table;
pub mod tables;
mod transforms;

pub use arrays::{Array, ArrayError};
pub use cache::Cache;
pub use chamfer::{CleanShape, SkeletonAgreement};
pub use cli::{Command, Options, command};
pub use error::EvalError;
pub use methods::{METHODS, Method, MethodContext, MethodEntry, ORACLE, Selection, all_rows, select};
pub use metrics::{
    MetricError, PairError, RECALL_ROTATION_DEG, RECALL_TRANSLATION, RIGHT_RADIUS_SHARE, RIGHT_ROTATION_DEG,
    Scores, is_right,
};
pub use npz_writer::NpzWriter;
pub use pair_file::{PairFile, export};
pub use pairs::{EvalPair, Group, PairSource};
pub use report::Meta;
pub use run::{Answer, Outcome, PairRecord, Run};
pub use summary::{SeverityKey, Summary, SummaryRow};
pub use synthesized::{CLEAN, Protocol, SynthesizedPairs};
pub use tables::TablesOptions;
pub use transforms::Transforms;
