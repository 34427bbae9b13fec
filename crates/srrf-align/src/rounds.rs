//! Which pairs are tried, round by round: what spans the scans first, then what joins components, then what closes loops.

use std::collections::BTreeMap;
use std::time::Instant;

use srrf_cloud::Rigid;

use crate::consensus::{Consensus, EdgeVerdict, HALF, along_tree, group_of};
use crate::graph::GraphEdge;
use crate::likeness::{LikelyPair, digests, likely_pairs};
use crate::near::overlapping;
use crate::options::{AlignError, AlignOptions, AlignProgress, AlignStage, PairReason};
use crate::pair::{RegisterPairs, Scans};
use crate::pool::{Candidate, PairPool, Workplace};
use crate::se3::shift;
use crate::seen::consensus_of;
use crate::surface::ScanSurface;
use crate::trees::{Union, components};

/// First guesses overlap from this share of the points on.
const GUESSED_OVERLAP: f64 = 0.1;
/// Loops are closed between scans that share this much in the map so far.
const LOOP_OVERLAP: f64 = 0.25;
/// ...and in one that is not confirmed.
const MAYBE_OVERLAP: f64 = 0.25;
/// Pairs of each scan in the first round, besides those of the spanning tree.
const FIRST: usize = 3;
const MOST_JOIN_ROUNDS: usize = 8;
const LOOP_ROUNDS: usize = 2;
/// Pairs that close loops, a scan and round.
const LOOPS_PER_SCAN: usize = 2;
/// A scan that so many agreeing pairs hold asks for no more loops.
const HELD_WELL: usize = 3;
/// Pairs less alike than this share of the median of those that hold are not tried to join components.
const LIKENESS_FLOOR: f64 = 0.03;

/// A choice of pairs.
pub struct Rounds<'a, 'b, S: Scans + ?Sized, R: RegisterPairs> {
    pub options: &'a AlignOptions,
    pub place: &'a Workplace<'b, S, R>,
    pub pool: PairPool,
    /// Pairs whose descriptors were compared.
    pub compared: usize,
    /// The rounds, with the number of pairs of each.
    pub sizes: Vec<(PairReason, usize)>,
    /// Wall time of registering.
    pub pair_seconds: f64,
}

type Failed<S, R> = AlignError<<S as Scans>::Error, <R as RegisterPairs>::Error>;

impl<S: Scans + ?Sized, R: RegisterPairs> Rounds<'_, '_, S, R> {
    fn surfaces(&self) -> &[ScanSurface] {
        self.place.surfaces
    }

    /// Tries all rounds.
    ///
    /// # Errors
    /// [`AlignError`] for scans that cannot be read or used.
    pub fn run(&mut self) -> Result<Consensus, Failed<S, R>> {
        let found = self.chosen()?;
        let kept: Vec<Candidate> = self
            .place
            .store
            .pairs()
            .into_iter()
            .map(|(a, b)| self.candidate(a, b, PairReason::Kept))
            .filter(|c| !self.pool.has(c.scans.0, c.scans.1))
            .collect();
        if kept.is_empty() {
            return Ok(found);
        }
        self.try_pairs(PairReason::Kept, kept)?;
        Ok(self.consensus())
    }

    /// The pairs that are chosen, round by round.
    fn chosen(&mut self) -> Result<Consensus, Failed<S, R>> {
        let n = self.surfaces().len();
        let some_unknown = (0..n).any(|i| self.options.initial.get(i).copied().flatten().is_none());
        let every = self.options.all_pairs == usize::MAX || (some_unknown && !self.options.sequence);
        if n <= self.options.all_pairs && every {
            let by_walls: BTreeMap<(usize, usize), LikelyPair> =
                if self.surfaces().iter().filter(|s| s.is_walled()).count() < 2 {
                    BTreeMap::new()
                } else {
                    self.alike()?.into_iter().map(|pair| (pair.scans, pair)).collect()
                };
            let pairs = (0..n).flat_map(|b| (0..b).map(move |a| (a, b)));
            let all = pairs
                .map(|(a, b)| match by_walls.get(&(a, b)).filter(|_| self.walled(a, b)) {
                    Some(pair) => self.likely(pair, PairReason::All),
                    None => self.candidate(a, b, PairReason::All),
                })
                .collect();
            self.try_pairs(PairReason::All, all)?;
            return Ok(self.consensus());
        }
        if self.options.sequence {
            let steps = (1..n).map(|i| self.candidate(i - 1, i, PairReason::Sequence)).collect();
            self.try_pairs(PairReason::Sequence, steps)?;
        }
        let guessed = self.guessed();
        if !guessed.is_empty() {
            self.try_pairs(PairReason::Guess, guessed)?;
        }
        let begun = !self.pool.tried.is_empty();
        let mut found = self.consensus();
        if !begun || found.components.len() > 1 {
            let alike = self.alike()?;
            self.compared = alike.len();
            if !begun {
                let first = self.first_round(&alike);
                self.try_pairs(PairReason::Alike, first)?;
                found = self.consensus();
            }
            for _ in 0..MOST_JOIN_ROUNDS {
                // Where nothing joins without a loop, loops come first: they know where to look.
                if found.look_alike {
                    let closing = self.closing(&found);
                    if !closing.is_empty() {
                        self.try_pairs(PairReason::Loop, closing)?;
                        found = self.consensus();
                    }
                }
                let joining = self.joining(&alike, &found);
                if joining.is_empty() {
                    break;
                }
                self.try_pairs(PairReason::Join, joining)?;
                found = self.consensus();
            }
        }
        for _ in 0..LOOP_ROUNDS {
            let closing = self.closing(&found);
            if closing.is_empty() {
                break;
            }
            self.try_pairs(PairReason::Loop, closing)?;
            found = self.consensus();
        }
        Ok(found)
    }

    /// All pairs that look alike, the most alike first.
    fn alike(&self) -> Result<Vec<LikelyPair>, Failed<S, R>> {
        let total = self.surfaces().len();
        (self.place.progress)(AlignProgress { stage: AlignStage::Candidates, done: 0, total });
        let digests =
            digests(self.surfaces()).map_err(|(number, source)| AlignError::Cloud { number, source })?;
        Ok(likely_pairs(self.surfaces(), &digests))
    }

    fn try_pairs(&mut self, reason: PairReason, mut pairs: Vec<Candidate>) -> Result<(), Failed<S, R>> {
        pairs.retain(|c| c.scans.0.max(c.scans.1) >= self.options.settled || self.kept(c.scans));
        pairs.retain(|c| !self.pool.has(c.scans.0, c.scans.1));
        self.sizes.push((reason, pairs.len()));
        let begun = Instant::now();
        let added = self.pool.add(&pairs, self.place);
        self.pair_seconds += begun.elapsed().as_secs_f64();
        added
    }

    fn kept(&self, (a, b): (usize, usize)) -> bool {
        self.place.store.find(a, b).or_else(|| self.place.store.find(b, a)).is_some()
    }

    fn consensus(&self) -> Consensus {
        (self.place.progress)(AlignProgress { stage: AlignStage::Graph, done: 0, total: 1 });
        consensus_of(self.surfaces(), &self.pool)
    }

    fn candidate(&self, a: usize, b: usize, reason: PairReason) -> Candidate {
        let guess = |i: usize| self.options.initial.get(i).copied().flatten();
        let relative = guess(a).zip(guess(b)).map(|(a, b)| b.inverse().compose(&a));
        Candidate {
            scans: (a.min(b), a.max(b)),
            reason,
            guess: if a < b { relative } else { relative.map(|g| g.inverse()) },
            only_there: false,
        }
    }

    /// A pair that looks alike, from the pose in which it does where the user gives no other.
    fn likely(&self, pair: &LikelyPair, reason: PairReason) -> Candidate {
        let (a, b) = pair.scans;
        let surfaces = self.surfaces();
        let seen = pair
            .pose
            .map(|pose| shift(&surfaces[b].centre).compose(&pose).compose(&shift(&-surfaces[a].centre)));
        let candidate = self.candidate(a, b, reason);
        let only_there = candidate.guess.is_none() && self.walled(a, b);
        Candidate { guess: candidate.guess.or(seen), only_there, ..candidate }
    }

    /// Whether the walls of two scans say all poses in which they may lie on each other.
    fn walled(&self, a: usize, b: usize) -> bool {
        self.surfaces()[a].is_walled() && self.surfaces()[b].is_walled()
    }

    /// Pairs whose first guesses overlap.
    fn guessed(&self) -> Vec<Candidate> {
        let guesses: Vec<Option<Rigid>> = self
            .surfaces()
            .iter()
            .enumerate()
            .map(|(i, s)| {
                self.options.initial.get(i).copied().flatten().map(|g| g.compose(&shift(&s.centre)))
            })
            .collect();
        let known: Vec<usize> = (0..guesses.len()).filter(|i| guesses[*i].is_some()).collect();
        let poses: Vec<Rigid> = guesses.iter().map(|g| g.unwrap_or_else(Rigid::identity)).collect();
        let pairs = overlapping(self.surfaces(), &poses, &known, GUESSED_OVERLAP);
        limited(&pairs, self.options.pairs_per_scan)
            .into_iter()
            .map(|(a, b)| self.candidate(a, b, PairReason::Guess))
            .collect()
    }

    /// A spanning tree of the pairs most alike, and the best few of each scan.
    fn first_round(&self, alike: &[LikelyPair]) -> Vec<Candidate> {
        let n = self.surfaces().len();
        let mut union = Union::new(n);
        let mut count = vec![0; n];
        let mut chosen = Vec::new();
        for pair in alike {
            let (a, b) = pair.scans;
            let spans = union.join(a, b);
            if spans || count[a] < FIRST || count[b] < FIRST {
                count[a] += 1;
                count[b] += 1;
                chosen.push(self.likely(pair, PairReason::Alike));
            }
        }
        chosen
    }

    /// For each scan outside the largest component, the most alike scan of another component.
    fn joining(&self, alike: &[LikelyPair], found: &Consensus) -> Vec<Candidate> {
        if found.components.len() < 2 {
            return Vec::new();
        }
        let n = self.surfaces().len();
        let group = group_of(n, &found.components);
        let of: BTreeMap<(usize, usize), f64> = alike.iter().map(|p| (p.scans, p.value)).collect();
        let mut holding: Vec<f64> = self
            .pool
            .tried
            .iter()
            .zip(&found.verdicts)
            .filter(|(_, v)| **v == EdgeVerdict::Holds)
            .filter_map(|(t, _)| of.get(&(t.source.min(t.target), t.source.max(t.target))).copied())
            .collect();
        holding.sort_by(f64::total_cmp);
        let floor = holding.get(holding.len() / 2).map_or(0.0, |median| LIKENESS_FLOOR * median);
        let mut tried = vec![0; n];
        for pair in &self.pool.tried {
            tried[pair.source] += 1;
            tried[pair.target] += 1;
        }
        let mut given = vec![0; n];
        let mut chosen = Vec::new();
        for pair in alike.iter().filter(|p| p.value >= floor) {
            let (a, b) = pair.scans;
            if group[a] == group[b] || self.pool.has(a, b) {
                continue;
            }
            // A scan of the largest component asks for nothing.
            let asks = |i: usize| group[i] > 0 && given[i] < 1 && tried[i] < self.options.pairs_per_scan;
            if asks(a) || asks(b) {
                given[a] += usize::from(group[a] > 0);
                given[b] += usize::from(group[b] > 0);
                chosen.push(self.likely(pair, PairReason::Join));
            }
        }
        chosen
    }

    /// Pairs that overlap in the map so far and were not tried, from the guess that it gives; also in what the likely pairs would make
    /// a map if a loop confirmed them.
    fn closing(&self, found: &Consensus) -> Vec<Candidate> {
        let edges: Vec<GraphEdge> = self.pool.tried.iter().map(|t| t.edge.clone()).collect();
        let likely: Vec<f64> = found.posterior.iter().map(|p| if *p >= HALF { *p } else { 0.0 }).collect();
        let kept: Vec<bool> = likely.iter().map(|p| *p > 0.0).collect();
        let n = self.surfaces().len();
        let mut held = vec![0; n];
        for (edge, verdict) in edges.iter().zip(&found.verdicts) {
            let holds = usize::from(*verdict == EdgeVerdict::Holds);
            held[edge.source] += holds;
            held[edge.target] += holds;
        }
        let maybe = (components(n, &edges, &kept), along_tree(n, &edges, &likely), MAYBE_OVERLAP);
        let sure = (found.components.clone(), found.poses.clone(), LOOP_OVERLAP);
        let mut pairs: Vec<(usize, usize, f64, Rigid)> = Vec::new();
        for (groups, poses, least) in [sure, maybe] {
            for group in &groups {
                for (a, b, share) in overlapping(self.surfaces(), &poses, group, least) {
                    let asks = held[a] < HELD_WELL || held[b] < HELD_WELL;
                    if asks && !self.pool.has(a, b) && pairs.iter().all(|p| (p.0, p.1) != (a, b)) {
                        let input = |i: usize| poses[i].compose(&shift(&-self.surfaces()[i].centre));
                        pairs.push((a, b, share, input(b).inverse().compose(&input(a))));
                    }
                }
            }
        }
        pairs.sort_by(|x, y| y.2.total_cmp(&x.2).then((x.0, x.1).cmp(&(y.0, y.1))));
        let shares: Vec<(usize, usize, f64)> = pairs.iter().map(|p| (p.0, p.1, p.2)).collect();
        let chosen = limited(&shares, LOOPS_PER_SCAN);
        pairs
            .into_iter()
            .filter(|p| chosen.contains(&(p.0, p.1)))
            .map(|(a, b, _, guess)| Candidate {
                scans: (a, b),
                reason: PairReason::Loop,
                guess: Some(guess),
                only_there: self.walled(a, b),
            })
            .collect()
    }
}

/// In this order, those of which one scan has fewer than `most` so far.
fn limited(pairs: &[(usize, usize, f64)], most: usize) -> Vec<(usize, usize)> {
    let mut count: BTreeMap<usize, usize> = BTreeMap::new();
    let mut chosen = Vec::new();
    for &(a, b, _) in pairs {
        let few = [a, b].iter().any(|i| count.get(i).copied().unwrap_or(0) < most);
        if few {
            *count.entry(a).or_default() += 1;
            *count.entry(b).or_default() += 1;
            chosen.push((a, b));
        }
    }
    chosen
}
