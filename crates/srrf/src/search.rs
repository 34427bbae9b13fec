//! [`Search`]: starts in rounds, the best of them refined.

use srrf_cloud::Rigid;
use srrf_refine::{
    Alternative, Assessment, Challengers, Evidence, RefineError, RefineTarget, Refinement, StartSupport,
    Verdict,
};

use crate::clock::StageClock;
use crate::coarse::CoarsePose;
use crate::error::NoPose;
use crate::features::{Features, Rivals};
use crate::outcome::TriedStart;
use crate::proposals::{Proposal, Proposals, Proposed, Round};
use crate::stage::{Stage, StageTime};
use crate::start::Start;
use crate::target::PreparedPair;
use crate::warning::Warning;

/// Of a round with more than twice so many starts, so many get a short run.
const SHORTLIST: usize = 16;

/// Poses of two sources that differ by less, and by less than this share of the target's radius, are one.
const ALIKE_DEG: f64 = 5.0;
const ALIKE: f64 = 0.05;
/// A start that is so near the end of another's full run would end there too.
const SAME_DEG: f64 = 1.0;
const SAME: f64 = 0.01;
/// Starts with so much of the best one's rank may fit as well in the end.
const RIVAL: f64 = 0.85;

/// What the starts so far came to.
#[derive(Debug, Clone)]
pub(crate) struct Best {
    /// Between the centred clouds.
    pub pose: Rigid,
    pub start: Start,
    pub refinement: Option<Refinement>,
    pub evidence: Evidence,
    pub assessment: Assessment,
    /// Other poses that may fit as well.
    pub alternatives: Vec<Alternative>,
    pub features: Features,
}

/// What was learned on the way.
#[derive(Debug)]
pub(crate) struct Learned {
    pub tried: Vec<TriedStart>,
    pub network: Option<CoarsePose>,
    pub warnings: Vec<Warning>,
    pub times: Vec<StageTime>,
}

/// The full run of a start, and what its end is compared with.
#[derive(Debug)]
struct FullRun {
    /// Number of the start.
    of: usize,
    refinement: Refinement,
    assessment: Assessment,
    challengers: Challengers,
}

/// The starts of one pair. Each gets one short run, whichever round it comes in, and the full run is made
/// anew only where a later round has a better start.
pub(crate) struct Search<'a> {
    pair: &'a PreparedPair,
    refine: bool,
    clock: StageClock<'a>,
    starts: Vec<Start>,
    /// One for each of `starts`.
    supports: Vec<StartSupport>,
    /// Less likely starts, for the wide round.
    spare: Vec<Proposal>,
    /// Full runs so far; that of the first round comes first.
    refined: Vec<FullRun>,
    network: Option<CoarsePose>,
    warnings: Vec<Warning>,
}

impl<'a> Search<'a> {
    /// Without starts. Where `refine` is false they are compared as they are. `clock` goes on with its times.
    pub fn new(pair: &'a PreparedPair, refine: bool, clock: StageClock<'a>) -> Self {
        Self {
            pair,
            refine,
            clock,
            starts: Vec::new(),
            supports: Vec::new(),
            spare: Vec::new(),
            refined: Vec::new(),
            network: None,
            warnings: Vec::new(),
        }
    }

    /// One more round: what these sources find, and in the wide round what was spare before. Whether there was anything to ask.
    pub fn propose(&mut self, round: Round, sources: &[Box<dyn Proposals>]) -> Result<bool, RefineError> {
        let mut proposals = if round == Round::Wide { std::mem::take(&mut self.spare) } else { Vec::new() };
        let mut asked = !proposals.is_empty();
        for source in sources.iter().filter(|source| source.is_for(self.pair)) {
            asked = true;
            if let Some(stage) = source.stage() {
                self.clock.begin(stage);
            }
            let Proposed { starts, spare, network, warning } = source.propose(self.pair);
            proposals.extend(starts);
            self.spare.extend(spare);
            self.network = network.or(self.network.take());
            self.warnings.extend(warning);
            if let Some(stage) = source.stage() {
                self.clock.lap(stage);
            }
        }
        self.add(&proposals)?;
        Ok(asked)
    }

    /// Ranks more starts: of many, those that a first look leaves.
    fn add(&mut self, proposals: &[Proposal]) -> Result<(), RefineError> {
        let (target, source) = (&self.pair.target.0.refine, &self.pair.refine);
        let all: Vec<Rigid> = proposals.iter().map(|p| p.pose).collect();
        let kept = if self.refine && !self.pair.is_small() && all.len() > 2 * SHORTLIST {
            target.screen(source, &all, SHORTLIST)?
        } else {
            (0..all.len()).collect()
        };
        let proposals: Vec<Proposal> = kept.into_iter().map(|i| proposals[i]).collect();
        let poses: Vec<Rigid> = proposals.iter().map(|p| p.pose).collect();
        // A shortlist of one moves nothing.
        let together = if self.refine { poses.len().max(1) } else { 1 };
        for some in poses.chunks(together) {
            self.supports.extend(target.shortlist(source, some)?);
        }
        self.starts.extend(proposals.iter().map(|p| p.start));
        let found = |method| self.starts.iter().any(|start| start.method() == method);
        self.warnings.retain(|w| !matches!(w, Warning::NoPose { method, .. } if found(*method)));
        Ok(())
    }

    /// The best start, refined; none without starts. Where the clouds look deformed in its pose, no support tells a start of a later
    /// round from those of the first, whose answer then stands: on bent clouds it is within 10 degrees more often. The time counts
    /// for `stage`, that of the first ranking for [`Stage::Refine`].
    pub fn best(&mut self, stage: Stage) -> Result<Option<Best>, RefineError> {
        let Some(best) = StartSupport::best(&self.supports) else { return Ok(None) };
        let stage = if self.clock.has(Stage::Refine) { stage } else { Stage::Refine };
        self.clock.begin(stage);
        let found = if self.refine { self.refined(best)? } else { self.as_given(best) };
        self.clock.lap(stage);
        Ok(Some(found))
    }

    fn as_given(&self, best: usize) -> Best {
        let pose = self.supports[best].given;
        let evidence = self.target().evidence(&self.pair.refine, &pose);
        let assessment = self.target().assess(&self.pair.refine, &pose);
        let rank = self.supports[best].rank;
        let challengers = self.target().challengers(&self.pair.refine, &pose);
        let alternatives = self.alternatives(&challengers, &assessment);
        let rivals = Rivals { starts: &self.rivals(), own: best, alternatives: &alternatives };
        let features = Features::new(&evidence, None, &assessment, &pose, rank, &rivals);
        Best {
            pose,
            start: self.starts[best],
            refinement: None,
            evidence,
            assessment,
            alternatives,
            features,
        }
    }

    fn refined(&mut self, best: usize) -> Result<Best, RefineError> {
        let known = self.refined.iter().position(|run| run.of == best).or_else(|| {
            // Of another start on its way to the same pose, the full run would end there too.
            let pose = &self.supports[best].target_from_source;
            let there = |run: &FullRun| self.alike(&run.refinement.target_from_source, pose, SAME_DEG, SAME);
            self.refined.iter().position(|run| !self.pair.is_small() && there(run))
        });
        let run = match known {
            Some(run) => run,
            None => {
                let refinement = self.target().finish(&self.pair.refine, &self.supports)?;
                let pose = &refinement.target_from_source;
                let assessment = self.target().assess(&self.pair.refine, pose);
                let challengers = self.target().challengers(&self.pair.refine, pose);
                self.refined.push(FullRun { of: best, refinement, assessment, challengers });
                self.refined.len() - 1
            }
        };
        let stands = if self.refined[run].refinement.verdict == Verdict::Deformed { 0 } else { run };
        let FullRun { of, refinement, assessment, challengers } = &self.refined[stands];
        let assessment = assessment.clone();
        let refined = Refinement { starts: self.supports.clone(), ..refinement.clone() };
        let (pose, start, evidence) =
            (refined.target_from_source, self.starts[refined.start], refined.evidence.clone());
        let rank = self.supports[*of].rank;
        let alternatives = self.alternatives(challengers, &assessment);
        let rivals = Rivals { starts: &self.rivals(), own: refined.start, alternatives: &alternatives };
        let features = Features::new(&evidence, Some(&refined), &assessment, &pose, rank, &rivals);
        Ok(Best { pose, start, refinement: Some(refined), evidence, assessment, alternatives, features })
    }

    /// Whether the graph of all matches and another source found this pose, each on its own. Small pairs, where every start is cheap,
    /// need more.
    pub fn is_corroborated(&self, best: &Best) -> bool {
        let near = |s: &StartSupport| self.alike(&s.target_from_source, &best.pose, ALIKE_DEG, ALIKE);
        let found = |by: fn(&Start) -> bool| {
            self.starts.iter().zip(&self.supports).any(|(start, s)| by(start) && near(s))
        };
        !self.pair.is_small()
            && found(|start| matches!(start, Start::FpfhGraph { .. }))
            && found(|start| matches!(start, Start::FpfhRansac { .. } | Start::NetworkFused))
    }

    /// Whether poses differ by less than an angle, and by less than a share of the target's radius.
    fn alike(&self, a: &Rigid, b: &Rigid, degrees: f64, share: f64) -> bool {
        let reach = share * self.pair.target_side().radius;
        a.angle_to_deg(b) < degrees && (a.translation - b.translation).norm() < reach
    }

    fn target(&self) -> &'a RefineTarget {
        &self.pair.target.0.refine
    }

    /// Other poses that may fit as well as an answer: what challenges it, and the best of the starts.
    fn alternatives(&self, challengers: &Challengers, assessment: &Assessment) -> Vec<Alternative> {
        let mut rivals = self.rivals();
        rivals.sort_by(|a, b| b.1.total_cmp(&a.1));
        let best = rivals.first().map_or(0.0, |(_, rank)| *rank);
        let close = rivals.into_iter().take_while(|(_, rank)| *rank >= RIVAL * best).map(|(pose, _)| pose);
        self.target().alternatives(&self.pair.refine, challengers, assessment, &close.collect::<Vec<_>>())
    }

    /// The poses of all starts with their ranks.
    fn rivals(&self) -> Vec<(Rigid, f64)> {
        self.supports.iter().map(|s| (s.target_from_source, s.rank)).collect()
    }

    /// Why there is no start.
    pub fn no_pose(self) -> NoPose {
        NoPose(self.warnings)
    }

    /// The end: what was learned on the way.
    pub fn finish(self) -> Learned {
        let tried = self.starts.iter().zip(&self.supports);
        Learned {
            tried: tried.map(|(&start, s)| TriedStart { start, support: s.support, rank: s.rank }).collect(),
            network: self.network,
            warnings: self.warnings,
            times: self.clock.into_times(),
        }
    }
}

#[cfg(test)]
mod tests {
    use srrf_cloud::EulerXyz;
    use srrf_corrupt::shapes::ProceduralShapes;
    use srrf_corrupt::{CorruptionKind, PairConfig, PairSynthesizer, PoseDraw, Severity, Stream};

    use super::*;
    use crate::Options;
    use crate::event::Observed;
    use crate::target::Target;

    /// How far the answers of two rounds are from each other, in degrees: the first has a start that is off, the second the truth.
    fn second_round_turns_by(kind: CorruptionKind) -> f64 {
        let shapes = ProceduralShapes::new(11, 9, None).unwrap();
        let synthesizer = PairSynthesizer::new(PairConfig::default()).unwrap();
        let corruption = Some((kind, Severity::ALL[3]));
        let pair =
            synthesizer.pair(&shapes, 1, corruption, PoseDraw::Seeded, Stream { seed: 5, item: 1 }).unwrap();
        let options = Options::default();
        let target = Target::new(&pair.target, &options).unwrap();
        let pair = PreparedPair::new(&pair.source, target, Some(&pair.target_from_source), &options).unwrap();
        let off = |start, degrees: [f64; 3]| {
            let by = Rigid { rotation: EulerXyz::from_deg(degrees).to_matrix(), ..Rigid::identity() };
            Proposal { start, pose: by.compose(&pair.initial) }
        };

        let mut search = Search::new(&pair, true, StageClock::after(Vec::new(), Observed::default()));
        assert!(search.best(Stage::Refine).unwrap().is_none());
        let far = [off(Start::Icp, [90.0, 60.0, 20.0]), off(Start::Given, [-70.0, 40.0, 110.0])];
        search.add(&far).unwrap();
        let first = search.best(Stage::Refine).unwrap().unwrap();
        let near = [off(Start::NetworkFused, [0.0; 3]), off(Start::Orientation(1), [1.0, 1.0, 1.0])];
        search.add(&near).unwrap();
        let second = search.best(Stage::RefineAgain).unwrap().unwrap();
        let starts = &second.refinement.as_ref().unwrap().starts;
        assert!(StartSupport::best(starts).unwrap() > 1 && starts.len() == 4, "the later starts are better");
        let learned = search.finish();
        let stages: Vec<Stage> = learned.times.iter().map(|t| t.stage).collect();
        assert_eq!(stages, [Stage::Refine, Stage::RefineAgain]);
        assert_eq!((learned.tried[3].start, learned.tried[3].rank), (Start::Orientation(1), starts[3].rank));
        first.pose.angle_to_deg(&second.pose)
    }

    #[test]
    fn later_rounds_win_where_the_clouds_are_rigid_and_not_where_they_are_bent() {
        let turned = second_round_turns_by(CorruptionKind::Gaussian);
        assert!(turned > 20.0, "{turned}");
        assert_eq!(second_round_turns_by(CorruptionKind::Distortion), 0.0);
    }
}
