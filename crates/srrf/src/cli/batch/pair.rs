//! [`ListedPair`]: a pair to register, and the names of what is said of it.

use serde_json::{Map, Value};

/// One pair of the list.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedPair {
    /// What it is known by: its `id`, or its files.
    pub id: String,
    /// The source as written.
    pub source: String,
    /// The target as written.
    pub target: String,
    /// The file of the first guess as written, if there is one.
    pub initial: Option<String>,
    /// The other columns, by name.
    pub columns: Map<String, Value>,
}

/// A row of a table, and where it stands: `line 3`, `row 2`.
pub type Record = (String, Map<String, Value>);

/// The columns of results, in their order; those of the list follow.
pub const COLUMNS: [&str; 14] = [
    "id",
    "source",
    "target",
    "initial",
    "target_from_source",
    "probability",
    "abstain",
    "evidence",
    "start",
    "points_source",
    "points_target",
    "seconds",
    "error",
    "answer",
];
