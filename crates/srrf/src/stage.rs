//! [`Stage`]: what a registration spends its time on.

use std::fmt;

use serde::{Serialize, Serializer};

/// A stage of a registration. [`fmt::Display`] gives the name in results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Reading the files and loading the network; of the program, not of the library.
    Open,
    /// Making the target ready: once for many sources.
    PrepareTarget,
    /// Making the source ready.
    PrepareSource,
    /// The network from the first guess.
    Network,
    /// FPFH with RANSAC.
    FpfhRansac,
    /// The compatibility graph of FPFH matches.
    FpfhGraph,
    /// The same with more points.
    FpfhGraphFiner,
    /// Ranking and refining after the graph.
    RefineGraph,
    /// The votes of pairs of points.
    PointPairs,
    /// Ranking and refining after those.
    RefinePointPairs,
    /// Iterative closest point.
    Icp,
    /// Ranking the starts and refining the best, the first time.
    Refine,
    /// Ranking and refining after the features, where a first guess left doubt.
    RefineGlobal,
    /// Ranking and refining after the network.
    RefineNetwork,
    /// FPFH with RANSAC, wider features.
    FpfhRansacWider,
    /// Ranking and refining after those.
    RefineWider,
    /// The network from all around.
    NetworkAllAround,
    /// Ranking and refining after that.
    RefineAgain,
    /// A source of starts of one's own, by its name.
    Own(&'static str),
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Open => "read files, load network",
            Self::PrepareTarget => "prepare target",
            Self::PrepareSource => "prepare source",
            Self::Network => "network",
            Self::FpfhRansac => "fpfh-ransac",
            Self::FpfhGraph => "fpfh-graph",
            Self::FpfhGraphFiner => "fpfh-graph, finer",
            Self::RefineGraph => "refine, graph",
            Self::PointPairs => "point-pairs",
            Self::RefinePointPairs => "refine, point pairs",
            Self::Icp => "icp",
            Self::Refine => "refine",
            Self::RefineGlobal => "refine, global",
            Self::RefineNetwork => "refine, network",
            Self::FpfhRansacWider => "fpfh-ransac, wider",
            Self::RefineWider => "refine, wider",
            Self::NetworkAllAround => "network, 23 orientations",
            Self::RefineAgain => "refine again",
            Self::Own(name) => name,
        })
    }
}

/// By its name.
impl Serialize for Stage {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Time that a stage took.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StageTime {
    /// The stage.
    pub stage: Stage,
    /// Its wall time.
    pub seconds: f64,
}
