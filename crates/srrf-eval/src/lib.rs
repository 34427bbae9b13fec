//! Scores registration methods on corrupted pairs: one scorer for every method.

mod chamfer;
mod metrics;

pub use chamfer::CleanShape;
pub use metrics::{MetricError, PairError, RECALL_ROTATION_DEG, RECALL_TRANSLATION, Scores};
