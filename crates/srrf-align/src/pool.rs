//! Pairs that were tried, and the registering of more of them.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use srrf_cloud::Rigid;

use crate::consensus::HALF;
use crate::graph::GraphEdge;
use crate::options::{AlignError, AlignProgress, AlignStage, PairReason};
use crate::overlay::Overlay;
use crate::pair::{OtherPose, PairAnswer, PairStore, RegisterPairs, Scans};
use crate::se3::displacement;
use crate::surface::ScanSurface;
use crate::trust::Sight;

/// Points that share less than this with the other scan are no overlap.
const LEAST_OVERLAP: f64 = 0.02;

/// Poses that differ by less than so many tolerances are of one place.
const SAME_PLACE: f64 = 3.0;

/// A pair to try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// The scans, the lower number first.
    pub scans: (usize, usize),
    /// Why.
    pub reason: PairReason,
    /// A first guess of the first scan's pose in the second's frame: `second_from_first`, input coordinates.
    pub guess: Option<Rigid>,
    /// Whether the pair is there or nowhere: all other poses were asked.
    pub only_there: bool,
}

/// A pair that was tried.
#[derive(Debug, Clone)]
pub struct TriedPair {
    /// The scan that moves.
    pub source: usize,
    /// The scan that it is laid on.
    pub target: usize,
    /// Why it was tried.
    pub reason: PairReason,
    /// What the registration says.
    pub answer: PairAnswer,
    /// How the scans lie on each other then.
    pub overlay: Option<Overlay>,
    /// The edge between the centred scans; without a pose it says nothing.
    pub edge: GraphEdge,
    /// Probability by the registration, without the other poses that scanners saw through; 0 where the points do not lie on each other.
    pub prior: f64,
    /// Whether others are as likely, so that a loop of such pairs closes as well in a wrong way as in the right one.
    pub tied: bool,
}

/// Pairs with their places in a list.
type Numbered = Vec<(usize, TriedPair)>;

/// All that were tried.
#[derive(Debug, Default)]
pub struct PairPool {
    /// In the order of the rounds.
    pub tried: Vec<TriedPair>,
    known: BTreeSet<(usize, usize)>,
}

/// What registering needs.
pub struct Workplace<'a, S: Scans + ?Sized, R: RegisterPairs> {
    /// The scans.
    pub scans: &'a S,
    /// The method.
    pub method: &'a R,
    /// Pairs that are done.
    pub store: &'a dyn PairStore,
    /// Who wants to know.
    pub progress: &'a (dyn Fn(AlignProgress) + Sync),
    /// The scans made ready.
    pub surfaces: &'a [ScanSurface],
    /// Targets that are ready at once.
    pub at_once: usize,
}

impl PairPool {
    /// Whether a pair was tried.
    pub fn has(&self, a: usize, b: usize) -> bool {
        self.known.contains(&(a.min(b), a.max(b)))
    }

    /// Registers those that were not tried. The answer does not depend on the number of threads.
    ///
    /// # Errors
    /// [`AlignError`] of the first pair, in the order of `candidates`, that cannot be registered.
    pub fn add<S: Scans + ?Sized, R: RegisterPairs>(
        &mut self,
        candidates: &[Candidate],
        place: &Workplace<'_, S, R>,
    ) -> Result<(), AlignError<S::Error, R::Error>> {
        let mut todo: Vec<Candidate> = Vec::new();
        for c in candidates {
            if self.known.insert(c.scans) {
                todo.push(*c);
            }
        }
        let before = self.tried.len();
        let total = before + todo.len();
        let done = AtomicUsize::new(before);
        let tick = || {
            let done = 1 + done.fetch_add(1, Ordering::Relaxed);
            (place.progress)(AlignProgress { stage: AlignStage::Pairs, done, total });
        };
        let stars = stars(&todo);
        let mut answers: Vec<Option<TriedPair>> = vec![None; todo.len()];
        for some in stars.chunks(place.at_once.max(1)) {
            let found: Vec<Numbered> =
                some.par_iter().map(|star| place.star(star, &todo, &tick)).collect::<Result<_, _>>()?;
            found.into_iter().flatten().for_each(|(at, pair)| answers[at] = Some(pair));
        }
        self.tried.extend(answers.into_iter().flatten());
        Ok(())
    }
}

/// Pairs by a common target: (target, places in the list). Again and again the scan with the most pairs, the lowest of equals.
fn stars(todo: &[Candidate]) -> Vec<(usize, Vec<usize>)> {
    let mut of: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    for (at, c) in todo.iter().enumerate() {
        of.entry(c.scans.0).or_default().insert(at);
        of.entry(c.scans.1).or_default().insert(at);
    }
    let mut stars = Vec::new();
    while let Some(target) =
        of.iter().max_by(|a, b| a.1.len().cmp(&b.1.len()).then(b.0.cmp(a.0))).map(|(t, _)| *t)
    {
        let Some(places) = of.remove(&target).filter(|p| !p.is_empty()) else { break };
        for at in &places {
            if let Some(rest) = of.get_mut(&other(&todo[*at], target)) {
                rest.remove(at);
            }
        }
        stars.push((target, places.into_iter().collect()));
    }
    stars
}

/// The scan of a pair that is not this one.
fn other(pair: &Candidate, this: usize) -> usize {
    if pair.scans.0 == this { pair.scans.1 } else { pair.scans.0 }
}

impl<S: Scans + ?Sized, R: RegisterPairs> Workplace<'_, S, R> {
    /// All sources of one target.
    fn star(
        &self,
        (target, places): &(usize, Vec<usize>),
        todo: &[Candidate],
        tick: &(impl Fn() + Sync),
    ) -> Result<Numbered, AlignError<S::Error, R::Error>> {
        let read =
            |number: usize| self.scans.cloud(number).map_err(|source| AlignError::Scan { number, source });
        let kept: Vec<Option<PairAnswer>> =
            places.iter().map(|at| self.kept(other(&todo[*at], *target), *target)).collect();
        let ready = if kept.iter().all(Option::is_some) {
            None
        } else {
            let wrong = |source| AlignError::Register { number: *target, source };
            Some(self.method.prepare(&*read(*target)?).map_err(wrong)?)
        };
        places
            .par_iter()
            .zip(&kept)
            .map(|(&at, kept)| {
                let c = &todo[at];
                let source = other(c, *target);
                // The guess is of the first scan in the second's frame.
                let guess = c.guess.map(|g| if source == c.scans.0 { g } else { g.inverse() });
                let answer = match (kept, &ready) {
                    (Some(answer), _) => answer.clone(),
                    (None, None) => PairAnswer::NOTHING,
                    (None, Some(ready)) => {
                        let scan = read(source)?;
                        let answer = match guess.filter(|_| c.only_there) {
                            Some(guess) => self.method.refine(&scan, ready, guess),
                            None => self.method.register(&scan, ready, guess),
                        };
                        let answer =
                            answer.map_err(|e| AlignError::Register { number: source, source: e })?;
                        self.store.keep(source, *target, &answer);
                        answer
                    }
                };
                tick();
                let by_walls = guess.filter(|_| c.only_there);
                Ok((at, self.judged(source, *target, c.reason, answer, by_walls)))
            })
            .collect()
    }

    /// The answer of a pair in the store, in either order.
    fn kept(&self, source: usize, target: usize) -> Option<PairAnswer> {
        self.store
            .find(source, target)
            .or_else(|| self.store.find(target, source).map(|answer| answer.inverse()))
    }

    /// What is made of an answer. Where it is at the pose by which the walls of both lie on each other, the better of the two stands:
    /// points alone may come to lie on the other side of a wall.
    fn judged(
        &self,
        source: usize,
        target: usize,
        reason: PairReason,
        mut answer: PairAnswer,
        by_walls: Option<Rigid>,
    ) -> TriedPair {
        let (moving, fixed) = (&self.surfaces[source], &self.surfaces[target]);
        let mut centred = answer.target_from_source.map(|pose| fixed.centred(moving, &pose));
        let mut overlay = centred.map(|pose| fixed.overlay(moving, &pose));
        if let (Some(walls), Some(pose), Some(found)) = (by_walls, &centred, &overlay) {
            let there = fixed.centred(moving, &walls);
            let off = pose.inverse().compose(&there);
            let near = displacement(&off, moving.radius) <= SAME_PLACE * fixed.tolerance(moving);
            let other = near.then(|| fixed.overlay(moving, &there)).filter(|other| other.is_better(found));
            if other.is_some() {
                (answer.target_from_source, centred, overlay) = (Some(walls), Some(there), other);
            }
        }
        let stands = centred.is_none_or(|pose| fixed.stands(moving, &pose));
        let lies = stands
            && overlay.as_ref().is_some_and(|o| o.overlap_source.max(o.overlap_target) >= LEAST_OVERLAP);
        let edge = GraphEdge {
            source,
            target,
            target_from_source: centred.unwrap_or_else(Rigid::identity),
            information: overlay.as_ref().map_or_else(nalgebra::Matrix6::identity, |o| o.information),
        };
        let seen_through = |other: &Rigid| {
            let there = fixed.centred(moving, other);
            fixed.stands(moving, &there).then(|| fixed.seen_through(moving, &there, usize::MAX)).flatten()
        };
        let (prior, tied) =
            if lies { among_others(&answer, overlay.as_ref(), seen_through) } else { (0.0, false) };
        TriedPair { source, target, reason, answer, overlay, edge, prior, tied }
    }
}

/// The probability of a pair among the other poses that fit as well, and whether those are as likely. Where scanners saw through what is there
/// in another pose, or it does not stand, it counts so much less: `seen_through` is the share that they saw through; none where it does not
/// stand.
fn among_others(
    answer: &PairAnswer,
    overlay: Option<&Overlay>,
    seen_through: impl Fn(&Rigid) -> Option<f64>,
) -> (f64, bool) {
    let fit = answer.probability_of_fit;
    let Some(here) = overlay.and_then(|o| o.seen_through) else {
        return (answer.probability, answer.abstain && fit >= HALF);
    };
    let sight = Sight::usual();
    let left = |other: &OtherPose| {
        let there = seen_through(&other.target_from_source)?;
        Some(other.probability * (sight.log_ratio(there) - sight.log_ratio(here)).exp())
    };
    let others: f64 = answer.others.iter().filter_map(left).sum();
    let share = if others > 0.0 { answer.probability / (answer.probability + others) } else { 1.0 };
    // As a registration has it: of poses that fit as well the best one is right twice as often as its weight says.
    let best = 2.0 * share / (1.0 + share);
    (fit.min(best), share < HALF)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_targets_serve_all_pairs() {
        let pairs = [(0, 1), (1, 2), (1, 3), (3, 4), (0, 4)];
        let todo =
            pairs.map(|scans| Candidate { scans, reason: PairReason::All, guess: None, only_there: false });
        let stars = stars(&todo);
        assert_eq!(stars, [(1, vec![0, 1, 2]), (4, vec![3, 4])]);
    }
}
