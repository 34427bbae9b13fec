//! The first guess as a start.

use std::sync::Arc;

use super::{Proposal, Proposals, Proposed, Round};
use crate::network::LazyNetwork;
use crate::options::{Method, Options};
use crate::stage::Stage;
use crate::start::Start;
use crate::target::PreparedPair;

/// The first guess as it is; the identity, if there is none.
#[derive(Debug)]
struct FirstGuess {
    /// Whether one that was given has had its round.
    guided_before: bool,
}

/// The first guess that was given, on its own.
#[derive(Debug)]
struct Guided;

/// Where a first guess was given, it is tried before all else: a good one needs no search.
pub(super) fn guided(options: &Options, _: Option<&Arc<LazyNetwork>>) -> Option<Box<dyn Proposals>> {
    (options.method == Method::Auto).then(|| Box::new(Guided) as _)
}

pub(super) fn first_guess(options: &Options, _: Option<&Arc<LazyNetwork>>) -> Option<Box<dyn Proposals>> {
    matches!(options.method, Method::Given | Method::Auto)
        .then(|| Box::new(FirstGuess { guided_before: options.method == Method::Auto }) as _)
}

impl Proposals for Guided {
    fn round(&self) -> Round {
        Round::Guided
    }

    fn is_for(&self, pair: &PreparedPair) -> bool {
        pair.guided
    }

    fn stage(&self) -> Option<Stage> {
        None
    }

    fn propose(&self, pair: &PreparedPair) -> Proposed {
        Proposed::starts(vec![Proposal { start: Start::Given, pose: pair.initial }])
    }
}

impl Proposals for FirstGuess {
    fn round(&self) -> Round {
        Round::Cheap
    }

    fn is_for(&self, pair: &PreparedPair) -> bool {
        !(self.guided_before && pair.guided)
    }

    fn stage(&self) -> Option<Stage> {
        None
    }

    fn propose(&self, pair: &PreparedPair) -> Proposed {
        Proposed::starts(vec![Proposal { start: Start::Given, pose: pair.initial }])
    }
}
