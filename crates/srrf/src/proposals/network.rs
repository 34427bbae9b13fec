//! The network: from the first guess, and from all around where nothing is known of the turn.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use srrf_cloud::{Registration, Rigid};

use super::{Proposal, Proposals, Proposed, Round};
use crate::coarse::CoarsePose;
use crate::network::{LazyNetwork, Network};
use crate::options::{Method, Options, RotationRange};
use crate::stage::Stage;
use crate::start::Start;
use crate::target::PreparedPair;
use crate::warning::Warning;

/// The fused pose and those of the branches, of one look from the first guess.
#[derive(Debug)]
struct NetworkFromFirstGuess {
    network: Arc<LazyNetwork>,
    round: Round,
    /// Which pairs it is for.
    pairs: AskedFor,
}

/// Which pairs a look is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum AskedFor {
    All,
    /// Of the size that the network was trained for.
    Small,
    /// Larger ones that it sees whole: there, features are cheaper and more often right. Of scans it sees too little.
    Medium,
}

/// The fused poses of a glance from each of the other 23 orientations of a cube.
#[derive(Debug)]
struct AllAround(Arc<LazyNetwork>);

/// At once, beside the other cheap sources: for small pairs, and where there is no other source.
pub(super) fn at_once(options: &Options, network: Option<&Arc<LazyNetwork>>) -> Option<Box<dyn Proposals>> {
    let pairs = if options.method == Method::Auto { AskedFor::Small } else { AskedFor::All };
    let network = network?.clone();
    Some(Box::new(NetworkFromFirstGuess { network, round: Round::Cheap, pairs }))
}

/// Where the cheap sources leave doubt.
pub(super) fn from_first_guess(
    options: &Options,
    network: Option<&Arc<LazyNetwork>>,
) -> Option<Box<dyn Proposals>> {
    let network = network.filter(|_| options.method == Method::Auto)?.clone();
    Some(Box::new(NetworkFromFirstGuess { network, round: Round::Network, pairs: AskedFor::Medium }))
}

pub(super) fn all_around(
    options: &Options,
    network: Option<&Arc<LazyNetwork>>,
) -> Option<Box<dyn Proposals>> {
    let network = network.filter(|_| options.rotation == RotationRange::Any)?;
    Some(Box::new(AllAround(network.clone())))
}

impl Proposals for NetworkFromFirstGuess {
    fn round(&self) -> Round {
        self.round
    }

    fn is_for(&self, pair: &PreparedPair) -> bool {
        match self.pairs {
            AskedFor::All => true,
            AskedFor::Small => pair.is_small(),
            AskedFor::Medium => pair.is_seen() && !pair.is_small(),
        }
    }

    fn stage(&self) -> Option<Stage> {
        Some(Stage::Network)
    }

    fn propose(&self, pair: &PreparedPair) -> Proposed {
        let centre_to_centre = turned(pair.initial.rotation);
        let look = |network: &Network| {
            network.look_from(pair.source.thin(), pair.target_side().thin(), &centre_to_centre)
        };
        match self.network.get().and_then(look) {
            Ok(found) => Proposed {
                starts: starts(&found),
                network: Some(CoarsePose::new(&found, pair)),
                ..Proposed::default()
            },
            Err(why) => Proposed::warning(Warning::no_pose(Method::Srrf, why)),
        }
    }
}

impl Proposals for AllAround {
    fn round(&self) -> Round {
        Round::AllAround
    }

    fn is_for(&self, pair: &PreparedPair) -> bool {
        pair.is_seen()
    }

    fn stage(&self) -> Option<Stage> {
        Some(Stage::NetworkAllAround)
    }

    fn propose(&self, pair: &PreparedPair) -> Proposed {
        let Ok(network) = self.0.get() else { return Proposed::default() };
        let look = |(i, rotation): (usize, &Matrix3<f64>)| {
            let from = turned(pair.initial.rotation * rotation);
            let found = network.glance_from(pair.source.thin(), pair.target_side().thin(), &from).ok()?;
            Some(Proposal { start: Start::Orientation(i + 1), pose: found.target_from_source })
        };
        Proposed::starts(cube_rotations()[1..].par_iter().enumerate().filter_map(look).collect())
    }
}

/// The fused pose and those of the branches.
fn starts(found: &Registration) -> Vec<Proposal> {
    let fused = Proposal { start: Start::NetworkFused, pose: found.target_from_source };
    let branches = found
        .branches
        .iter()
        .map(|b| Proposal { start: Start::NetworkBranch(b.kind), pose: b.target_from_source });
    std::iter::once(fused).chain(branches).collect()
}

/// The 24 rotations of a cube, the identity first: every rotation is within 62.8 degrees of one.
pub fn cube_rotations() -> Vec<Matrix3<f64>> {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let mut all = Vec::with_capacity(24);
    for first in 0..6 {
        for second in 0..6 {
            if first % 3 == second % 3 {
                continue;
            }
            let signed = |i: usize| axes[i % 3] * if i < 3 { 1.0 } else { -1.0 };
            let (x, y) = (signed(first), signed(second));
            all.push(Matrix3::from_columns(&[x, y, x.cross(&y)]));
        }
    }
    all
}

/// The pose that turns the source about its own centre, both clouds being centred.
pub fn turned(rotation: Matrix3<f64>) -> Rigid {
    Rigid { rotation, translation: Vector3::zeros() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twenty_four_different_rotations() {
        let all = cube_rotations();
        assert_eq!(all.len(), 24);
        assert_eq!(all[0], Matrix3::identity());
        for (i, a) in all.iter().enumerate() {
            assert!((a.determinant() - 1.0).abs() < 1e-12);
            assert!(all[..i].iter().all(|b| (a - b).norm() > 0.5));
        }
    }
}
