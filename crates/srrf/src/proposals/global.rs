//! FPFH with RANSAC: at first its likely poses, then the compatibility graph of all matches, then the less likely poses, and features
//! of wider radii.

use std::sync::Arc;

use srrf_classical::{FpfhRansac, FpfhRansacConfig};
use srrf_cloud::RegisterError;

use super::range::in_range;
use super::{Proposal, Proposals, Proposed, Round};
use crate::network::LazyNetwork;
use crate::options::{Method, Options, RotationRange};
use crate::stage::Stage;
use crate::start::Start;
use crate::target::PreparedPair;
use crate::warning::Warning;

/// Poses that are starts of the first round.
const LIKELY: usize = 4;
/// Poses that each radius of the features gives.
const POSES: usize = 48;
/// Poses that each radius gives by the graph.
const GRAPH_POSES: usize = 8;
/// Radii of the features whose matches make a graph, in voxels.
const GRAPH_RADII: [f64; 1] = [5.0];
/// Points where all else left doubt: what overlaps little has few matches among 3,000.
const FINE_POINTS: usize = 8000;
/// Radii of the features that are tried where there is doubt, in voxels, beside the default one: on crops and uneven clouds each
/// finds poses that the others miss.
const WIDE_RADII: [f64; 2] = [8.0, 12.0];

/// What looks for poses in the matches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Estimator {
    Ransac,
    Graph,
    FineGraph,
}

/// Features of one radius.
#[derive(Debug, Clone, Copy)]
struct Global {
    rotation: RotationRange,
    seed: u64,
}

/// Features of the default radius: the likely poses are starts, the others are spare.
#[derive(Debug)]
struct Narrow(Global);

/// The compatibility graph of the matches of [`GRAPH_RADII`], the unlikely ones among them.
#[derive(Debug)]
struct Graph(Global);

/// The same with [`FINE_POINTS`].
#[derive(Debug)]
struct Fine(Global);

/// Features of the radii [`WIDE_RADII`].
#[derive(Debug)]
struct Wide(Global);

pub(super) fn narrow(options: &Options, _: Option<&Arc<LazyNetwork>>) -> Option<Box<dyn Proposals>> {
    Global::asked(options).map(|global| Box::new(Narrow(global)) as _)
}

pub(super) fn graph(options: &Options, _: Option<&Arc<LazyNetwork>>) -> Option<Box<dyn Proposals>> {
    Global::asked(options).map(|global| Box::new(Graph(global)) as _)
}

pub(super) fn fine(options: &Options, _: Option<&Arc<LazyNetwork>>) -> Option<Box<dyn Proposals>> {
    Global::asked(options).map(|global| Box::new(Fine(global)) as _)
}

pub(super) fn wide(options: &Options, _: Option<&Arc<LazyNetwork>>) -> Option<Box<dyn Proposals>> {
    Global::asked(options).map(|global| Box::new(Wide(global)) as _)
}

impl Proposals for Narrow {
    fn round(&self) -> Round {
        Round::Cheap
    }

    fn stage(&self) -> Option<Stage> {
        Some(Stage::FpfhRansac)
    }

    fn propose(&self, pair: &PreparedPair) -> Proposed {
        match self.0.search(pair, FpfhRansacConfig::default().feature_voxels, Estimator::Ransac) {
            Ok(mut starts) => {
                let spare = starts.split_off(LIKELY.min(starts.len()));
                Proposed { starts, spare, ..Proposed::default() }
            }
            Err(why) => Proposed::warning(Warning::no_pose(Method::FpfhRansac, why)),
        }
    }
}

impl Proposals for Graph {
    fn round(&self) -> Round {
        Round::Graph
    }

    fn stage(&self) -> Option<Stage> {
        Some(Stage::FpfhGraph)
    }

    /// What it does not find, the other starts have to do without.
    fn propose(&self, pair: &PreparedPair) -> Proposed {
        let found =
            GRAPH_RADII.into_iter().filter_map(|radius| self.0.search(pair, radius, Estimator::Graph).ok());
        Proposed::starts(found.flatten().collect())
    }
}

impl Proposals for Fine {
    fn round(&self) -> Round {
        Round::AllAround
    }

    fn is_for(&self, pair: &PreparedPair) -> bool {
        !pair.is_seen()
    }

    fn stage(&self) -> Option<Stage> {
        Some(Stage::FpfhGraphFiner)
    }

    fn propose(&self, pair: &PreparedPair) -> Proposed {
        let radius = FpfhRansacConfig::default().feature_voxels;
        Proposed::starts(self.0.search(pair, radius, Estimator::FineGraph).unwrap_or_default())
    }
}

impl Proposals for Wide {
    fn round(&self) -> Round {
        Round::Wide
    }

    fn stage(&self) -> Option<Stage> {
        Some(Stage::FpfhRansacWider)
    }

    /// What they do not find, the other starts have to do without.
    fn propose(&self, pair: &PreparedPair) -> Proposed {
        let found =
            WIDE_RADII.into_iter().filter_map(|radius| self.0.search(pair, radius, Estimator::Ransac).ok());
        Proposed::starts(found.flatten().collect())
    }
}

impl Global {
    fn asked(options: &Options) -> Option<Self> {
        let asked = matches!(options.method, Method::Auto | Method::FpfhRansac);
        asked.then_some(Self { rotation: options.rotation, seed: options.seed })
    }

    /// What an estimator finds with features of this radius (in voxels), best first, as far as the options allow such turns against the
    /// first guess.
    fn search(
        &self,
        pair: &PreparedPair,
        feature_voxels: f64,
        by: Estimator,
    ) -> Result<Vec<Proposal>, RegisterError> {
        let config = FpfhRansacConfig {
            seed: self.seed,
            feature_voxels,
            points: if by == Estimator::FineGraph { FINE_POINTS } else { FpfhRansacConfig::default().points },
            hypotheses: if by == Estimator::Ransac { POSES } else { GRAPH_POSES },
            ..FpfhRansacConfig::default()
        };
        let source = pair.source.features().map_err(RegisterError::Source)?;
        let target = pair.target_side().features().map_err(RegisterError::Target)?;
        let method = FpfhRansac::new(config);
        let found = match by {
            Estimator::Ransac => method.hypotheses(source, target)?,
            Estimator::Graph | Estimator::FineGraph => method.graph_hypotheses(source, target)?,
        };
        let poses = in_range(self.rotation, found.poses, &pair.initial)?;
        let start = match by {
            Estimator::Ransac => Start::FpfhRansac { feature_voxels },
            Estimator::Graph | Estimator::FineGraph => Start::FpfhGraph { feature_voxels },
        };
        Ok(poses.into_iter().map(|pose| Proposal { start, pose }).collect())
    }
}
