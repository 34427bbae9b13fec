//! Where starts come from: [`Proposals`], one implementation a file.
//!
//! A new source of starts is one file here, named below and in one line of [`SOURCES`]. Its poses are
//! [`Start::Own`] and its time is [`Stage::Own`], until it deserves names that results keep.

mod given;
mod global;
mod icp;
mod network;
mod parts;
mod range;

use std::fmt;
use std::sync::Arc;

use srrf_cloud::Rigid;

use crate::coarse::CoarsePose;
use crate::network::LazyNetwork;
use crate::options::Options;
use crate::stage::Stage;
use crate::start::Start;
use crate::target::PreparedPair;
use crate::warning::Warning;

/// All sources, each where its options ask for it; those of one round in this order.
const SOURCES: &[Make] = &[
    given::guided,
    network::at_once,
    global::narrow,
    icp::from_first_guess,
    given::first_guess,
    network::from_first_guess,
    global::graph,
    parts::point_pairs,
    global::wide,
    global::fine,
    network::all_around,
];

/// Makes a source, where the options ask for it.
type Make = fn(&Options, Option<&Arc<LazyNetwork>>) -> Option<Box<dyn Proposals>>;

/// A source of starts.
pub(crate) trait Proposals: fmt::Debug + Send + Sync {
    /// When it is asked.
    fn round(&self) -> Round;

    /// Whether it is asked for such a pair.
    fn is_for(&self, _: &PreparedPair) -> bool {
        true
    }

    /// What its time is reported as; none for what takes no time.
    fn stage(&self) -> Option<Stage>;

    /// Looks for starts. Finding none is no error: others may.
    fn propose(&self, pair: &PreparedPair) -> Proposed;
}

/// A round of starts. Each later one is made only where those before it leave doubt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Round {
    /// The first guess that was given.
    Guided,
    /// What is found fast.
    Cheap,
    /// The compatibility graph of matches.
    Graph,
    /// The votes of pairs of points.
    PointPairs,
    /// The network from the first guess.
    Network,
    /// Less likely poses, and wider features.
    Wide,
    /// The network from all around; for large clouds, many more points.
    AllAround,
}

impl Round {
    const ALL: [Self; 7] = [
        Self::Guided,
        Self::Cheap,
        Self::Graph,
        Self::PointPairs,
        Self::Network,
        Self::Wide,
        Self::AllAround,
    ];

    /// What the time of ranking and refining after this round is reported as, where it is not the first.
    pub fn refining(self) -> Stage {
        match self {
            Self::Guided => Stage::Refine,
            Self::Cheap => Stage::RefineGlobal,
            Self::Graph => Stage::RefineGraph,
            Self::PointPairs => Stage::RefinePointPairs,
            Self::Network => Stage::RefineNetwork,
            Self::Wide => Stage::RefineWider,
            Self::AllAround => Stage::RefineAgain,
        }
    }
}

/// The sources of each round that has any, in the order of the rounds.
pub(crate) fn rounds(
    options: &Options,
    network: Option<&Arc<LazyNetwork>>,
) -> Vec<(Round, Vec<Box<dyn Proposals>>)> {
    let mut sources: Vec<Box<dyn Proposals>> =
        SOURCES.iter().filter_map(|make| make(options, network)).collect();
    let rounds = Round::ALL.map(|round| {
        let (of_round, others) = sources.drain(..).partition(|source| source.round() == round);
        sources = others;
        (round, of_round)
    });
    rounds.into_iter().filter(|(_, sources)| !sources.is_empty()).collect()
}

/// A pose between the centred clouds, to start from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Proposal {
    pub start: Start,
    pub pose: Rigid,
}

/// What a source found.
#[derive(Debug, Default)]
pub(crate) struct Proposed {
    /// Starts, best first.
    pub starts: Vec<Proposal>,
    /// Less likely ones, for the next round.
    pub spare: Vec<Proposal>,
    /// What the network found, in input coordinates.
    pub network: Option<CoarsePose>,
    /// Why there are no starts, where a user should know.
    pub warning: Option<Warning>,
}

impl Proposed {
    fn starts(starts: Vec<Proposal>) -> Self {
        Self { starts, ..Self::default() }
    }

    fn warning(warning: Warning) -> Self {
        Self { warning: Some(warning), ..Self::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Method, RotationRange};

    #[test]
    fn each_method_has_its_rounds() {
        let network = Arc::new(LazyNetwork::new(None, "flex").unwrap());
        let stages = |method, rotation, network| -> Vec<Vec<Option<Stage>>> {
            let options = Options { method, rotation, ..Options::default() };
            let rounds = rounds(&options, network);
            rounds.iter().map(|(_, sources)| sources.iter().map(|s| s.stage()).collect()).collect()
        };
        let cheap = vec![Some(Stage::Network), Some(Stage::FpfhRansac), None];
        let (guided, later) = (vec![None], vec![Some(Stage::Network)]);
        let (wide, around) = (vec![Some(Stage::FpfhRansacWider)], vec![Some(Stage::NetworkAllAround)]);
        let (any, within) = (RotationRange::Any, RotationRange::Within45);
        let (graph, fine) = (vec![Some(Stage::FpfhGraph)], Some(Stage::FpfhGraphFiner));
        let around = [vec![fine], around].concat();
        let pairs = vec![Some(Stage::PointPairs)];
        let auto = [guided, cheap, graph.clone(), pairs, later, wide.clone(), around.clone()];
        assert_eq!(stages(Method::Auto, any, Some(&network)), auto);
        let within = stages(Method::Auto, within, Some(&network));
        assert_eq!((&within[..6], &within[6]), (&auto[..6], &vec![fine]));
        assert_eq!(
            stages(Method::Srrf, any, Some(&network)),
            [vec![Some(Stage::Network)], vec![Some(Stage::NetworkAllAround)]]
        );
        assert_eq!(
            stages(Method::FpfhRansac, any, None),
            [vec![Some(Stage::FpfhRansac)], graph, wide, vec![fine]]
        );
        assert_eq!(stages(Method::Icp, any, None), [vec![Some(Stage::Icp)]]);
        assert_eq!(stages(Method::Given, any, None), [vec![None]]);
    }
}
