//! The rows of the tables: what a row shows, and what fills it.

use std::borrow::Cow;
use std::fmt;

use serde::{Serialize, Serializer};

/// A row of the tables: whose poses it scores. Printed and serialised as its name.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TableRow {
    /// The answer of the method of this name.
    Method(Cow<'static, str>),
    /// One of several poses that a method finds on its way: method, branch. Called `<method>-<branch>`.
    Branch(Cow<'static, str>, Cow<'static, str>),
    /// A pose fitted to the true correspondences: the floor for any estimator that does least squares on matches.
    /// No method, since it needs to know the correspondences.
    Oracle,
    /// Transforms of another tool, from the file of this name.
    File(String),
}

/// What fills a row of a run; resolved once, before the first pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowSource {
    /// The answer of the method of this number, or of one of its branches.
    Answer {
        /// Number of the method in the run.
        method: usize,
        /// The branch; `None` for the answer itself.
        branch: Option<&'static str>,
        /// Whether the row is the method's own. Otherwise the method goes on from it, so that its time and how it
        /// ended are not the row's.
        own: bool,
    },
    /// A pose fitted to the true correspondences.
    Oracle,
    /// The file of transforms of this number in the run.
    File(usize),
}

impl TableRow {
    /// The row of no correspondences at all: no motion.
    pub const IDENTITY: Self = Self::method("identity");
    /// Iterative closest point.
    pub const ICP: Self = Self::method("icp");
    /// FPFH features with RANSAC.
    pub const FPFH_RANSAC: Self = Self::method("fpfh-ransac");
    /// Deep closest point.
    pub const DCP: Self = Self::method("dcp");
    /// Graph matching.
    pub const RGM: Self = Self::method("rgm");
    /// The dense branch of the network.
    pub const SRRF_DENSE: Self = Self::branch("srrf", "dense");
    /// The skeleton branch of the network.
    pub const SRRF_SKELETON: Self = Self::branch("srrf", "skeleton");
    /// The network: both branches, fused.
    pub const SRRF: Self = Self::method("srrf");
    /// The network and the refinement.
    pub const SRRF_REFINE: Self = Self::method("srrf+refine");
    /// The product: what `srrf register` answers, for any rotation.
    pub const SRRF_REGISTER: Self = Self::method("srrf-register");
    /// The product with `--rotation 45`.
    pub const SRRF_REGISTER_45: Self = Self::method("srrf-register-45");

    /// The rows of the network.
    pub const NETWORK: [Self; 3] = [Self::SRRF_DENSE, Self::SRRF_SKELETON, Self::SRRF];

    /// The row of a method.
    pub const fn method(name: &'static str) -> Self {
        Self::Method(Cow::Borrowed(name))
    }

    /// The row of a branch of a method.
    pub const fn branch(method: &'static str, branch: &'static str) -> Self {
        Self::Branch(Cow::Borrowed(method), Cow::Borrowed(branch))
    }
}

impl fmt::Display for TableRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Method(name) => f.write_str(name),
            Self::Branch(method, branch) => write!(f, "{method}-{branch}"),
            Self::Oracle => f.write_str("oracle"),
            Self::File(name) => f.write_str(name),
        }
    }
}

impl Serialize for TableRow {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_told_apart_by_what_they_show_and_print_their_names() {
        assert_eq!(TableRow::SRRF_DENSE.to_string(), "srrf-dense");
        assert_ne!(TableRow::SRRF_DENSE, TableRow::method("srrf-dense"));
        assert_eq!(TableRow::Method("icp".to_owned().into()), TableRow::ICP);
        assert_eq!(serde_json::to_value(TableRow::Oracle).unwrap(), "oracle");
        assert_ne!(TableRow::File("icp".into()), TableRow::ICP);
    }
}
