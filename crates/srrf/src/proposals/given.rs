//! The first guess as a start.

use std::sync::Arc;

use super::{Proposal, Proposals, Proposed, Round};
use crate::network::Network;
use crate::options::{Method, Options};
use crate::stage::Stage;
use crate::start::Start;
use crate::target::PreparedPair;

/// The first guess as it is; the identity, if there is none.
#[derive(Debug)]
struct FirstGuess;

pub(super) fn first_guess(options: &Options, _: Option<&Arc<Network>>) -> Option<Box<dyn Proposals>> {
    matches!(options.method, Method::Given | Method::Auto).then(|| Box::new(FirstGuess) as _)
}

impl Proposals for FirstGuess {
    fn round(&self) -> Round {
        Round::Cheap
    }

    fn stage(&self) -> Option<Stage> {
        None
    }

    fn propose(&self, pair: &PreparedPair) -> Proposed {
        Proposed::starts(vec![Proposal { start: Start::Given, pose: pair.initial }])
    }
}
