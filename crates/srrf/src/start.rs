//! [`Start`]: where a pose comes from.

use std::fmt;

use serde::{Serialize, Serializer};
use srrf_cloud::BranchKind;

use crate::options::Method;

/// Where a pose that the refinement starts from comes from. [`fmt::Display`] gives the name in results, such as `network fused`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// The fused pose of the network.
    NetworkFused,
    /// The pose of one branch of the network: `dense` or `skeleton`.
    NetworkBranch(BranchKind),
    /// The network, with the source turned to this orientation of a cube, 1 to 23.
    Orientation(usize),
    /// FPFH with RANSAC.
    FpfhRansac {
        /// Radius of the features, in voxels.
        feature_voxels: f64,
    },
    /// The compatibility graph of FPFH matches.
    FpfhGraph {
        /// Radius of the features, in voxels.
        feature_voxels: f64,
    },
    /// The votes of pairs of points.
    PointPairs,
    /// Iterative closest point from the first guess.
    Icp,
    /// The first guess itself.
    Given,
    /// A source of starts of one's own, by its name.
    Own(&'static str),
}

impl Start {
    /// The method that finds such starts.
    pub fn method(self) -> Method {
        match self {
            Self::NetworkFused | Self::NetworkBranch(_) | Self::Orientation(_) => Method::Srrf,
            Self::FpfhRansac { .. } | Self::FpfhGraph { .. } => Method::FpfhRansac,
            Self::Icp => Method::Icp,
            Self::Given => Method::Given,
            Self::PointPairs | Self::Own(_) => Method::Auto,
        }
    }
}

impl fmt::Display for Start {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NetworkFused => f.write_str("network fused"),
            Self::NetworkBranch(name) => write!(f, "network {name}"),
            Self::Orientation(number) => write!(f, "network, orientation {number}"),
            Self::FpfhRansac { .. } => f.write_str("fpfh-ransac"),
            Self::FpfhGraph { .. } => f.write_str("fpfh-graph"),
            Self::PointPairs => f.write_str("point-pairs"),
            Self::Icp => f.write_str("icp"),
            Self::Given => f.write_str("given"),
            Self::Own(name) => f.write_str(name),
        }
    }
}

/// By its name.
impl Serialize for Start {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_results_stay() {
        let names = [
            (Start::NetworkFused, "network fused"),
            (Start::NetworkBranch(BranchKind::Skeleton), "network skeleton"),
            (Start::Orientation(7), "network, orientation 7"),
            (Start::FpfhRansac { feature_voxels: 8.0 }, "fpfh-ransac"),
            (Start::FpfhGraph { feature_voxels: 5.0 }, "fpfh-graph"),
            (Start::PointPairs, "point-pairs"),
            (Start::Icp, "icp"),
            (Start::Given, "given"),
            (Start::Own("compass"), "compass"),
        ];
        for (start, name) in names {
            assert_eq!((start.to_string(), serde_json::to_value(start).unwrap()), (name.into(), name.into()));
        }
    }
}
