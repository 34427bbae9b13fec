//! What the plain run and `tables` have in common.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::methods::registry;

/// More about `--data`.
pub(crate) const TEST_SPLIT: &str = "The test split is used. Without data, built-in shapes are made";

/// More about `--weights`.
pub(crate) const OF_BASELINES: &str =
    "METHOD=FILE for those of a learned baseline. May be given more than once";

/// Weights by method: `METHOD=PATH`, or a path alone for srrf.
pub(crate) fn weights_by_method(weights: &[String]) -> BTreeMap<String, PathBuf> {
    let split = |text: &String| match text.split_once('=') {
        Some((method, path)) if registry().iter().any(|m| m.name == method) => {
            (method.to_owned(), path.into())
        }
        _ => ("srrf".to_owned(), text.into()),
    };
    weights.iter().map(split).collect()
}
