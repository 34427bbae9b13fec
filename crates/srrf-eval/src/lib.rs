//! Scores registration methods on corrupted pairs: one scorer for every method.

mod arrays;
mod chamfer;
mod error;
mod methods;
mod metrics;
mod output;
mod pair_file;
mod pairs;
mod transforms;

pub use arrays::{Array, ArrayError};
pub use chamfer::CleanShape;
pub use error::EvalError;
pub use methods::{METHODS, Method, MethodContext, MethodEntry, ORACLE, Selection, all_rows, select};
pub use metrics::{MetricError, PairError, RECALL_ROTATION_DEG, RECALL_TRANSLATION, Scores};
pub use pair_file::{PairFile, export};
pub use pairs::{EvalPair, Group, PairSource};
pub use transforms::Transforms;
