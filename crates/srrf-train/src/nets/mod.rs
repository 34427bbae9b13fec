//! The networks that can be trained, one file a kind, and the one place that finds a network by the name of its method.

pub mod baseline;
pub mod srrf;
