//! Iterative closest point from the first guess.

use std::sync::Arc;

use srrf_classical::{Icp, IcpConfig};
use srrf_cloud::Register;

use super::{Proposal, Proposals, Proposed, Round};
use crate::network::LazyNetwork;
use crate::options::{Method, Options};
use crate::stage::Stage;
use crate::start::Start;
use crate::target::PreparedPair;
use crate::warning::Warning;

/// ICP, point to point.
#[derive(Debug)]
struct IcpFromFirstGuess;

pub(super) fn from_first_guess(
    options: &Options,
    _: Option<&Arc<LazyNetwork>>,
) -> Option<Box<dyn Proposals>> {
    (options.method == Method::Icp).then(|| Box::new(IcpFromFirstGuess) as _)
}

impl Proposals for IcpFromFirstGuess {
    fn round(&self) -> Round {
        Round::Cheap
    }

    fn stage(&self) -> Option<Stage> {
        Some(Stage::Icp)
    }

    fn propose(&self, pair: &PreparedPair) -> Proposed {
        let moved = pair.source.centred.cloud().transformed(&pair.initial);
        match Icp::new(IcpConfig::default()).register(&moved, &pair.target_side().centred.cloud()) {
            Ok(found) => {
                let pose = found.target_from_source.compose(&pair.initial);
                Proposed::starts(vec![Proposal { start: Start::Icp, pose }])
            }
            Err(why) => Proposed::warning(Warning::no_pose(Method::Icp, why)),
        }
    }
}
