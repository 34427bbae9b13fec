//! [`Registrar`]: the way from two clouds to an [`Outcome`], one statement a stage.

use std::sync::Arc;

use srrf_cloud::{PointCloud, Solid};
use srrf_refine::Scatter;

use crate::clock::StageClock;
use crate::error::Error;
use crate::event::Event;
use crate::judge::{Judge, Judgement, is_sure};
use crate::network::LazyNetwork;
use crate::options::{Method, Options};
use crate::outcome::{Outcome, PointCounts};
use crate::poses::CandidatePose;
use crate::proposals::{Proposals, Round, rounds};
use crate::request::{Request, RequestTarget};
use crate::search::{Best, Search};
use crate::stage::{Stage, StageTime};
use crate::target::{PreparedPair, Target};
use crate::undetermined::Undetermined;
use crate::warning::Warning;

/// With so much probability, an answer that two estimators agree on is left as it is: of such, wider searches hardly change one.
const FAIR: f64 = 0.65;

/// Registers pairs with one set of options; holds the network, loaded when first asked. Share it between threads.
#[derive(Debug)]
pub struct Registrar {
    options: Options,
    network: Option<Arc<LazyNetwork>>,
    /// Where starts come from, round by round.
    rounds: Vec<(Round, Vec<Box<dyn Proposals>>)>,
    judge: Judge,
}

impl Registrar {
    /// Loads what the options need.
    ///
    /// # Errors
    /// [`Error::Weights`] and [`Error::Device`] for those that cannot be used, [`Error::Refine`] for settings that make no sense.
    pub fn new(options: Options) -> Result<Self, Error> {
        if let Some(config) = &options.refine {
            config.validate().map_err(Error::Refine)?;
        }
        let network = match options.method {
            Method::Auto | Method::Srrf => {
                Some(Arc::new(LazyNetwork::new(options.weights.as_deref(), &options.device)?))
            }
            Method::FpfhRansac | Method::Icp | Method::Given => None,
        };
        let rounds = rounds(&options, network.as_ref());
        let judge = Judge::new(&options).map_err(Error::Calibration)?;
        Ok(Self { options, network, rounds, judge })
    }

    /// The options.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Makes a target ready for many sources.
    ///
    /// # Errors
    /// [`Error::Target`] for a cloud that determines no rotation.
    pub fn prepare(&self, target: &PointCloud) -> Result<Target, Error> {
        Target::new(target, &self.options)
    }

    /// Lays the source of a request on its target: `target ~ R source + t`.
    ///
    /// Starts come in rounds, the cheapest evidence first: a first guess that was given, features, the network, wide searches. Each
    /// round is ranked, its best start refined and judged, and the first answer that is sure, or that two estimators agree on, ends
    /// the search.
    ///
    /// # Errors
    /// [`Error`] for clouds that determine no rotation, for clouds that seem to be in different units of length
    /// ([`Error::Scale`]), and where no pose is found.
    pub fn register(&self, request: &Request<'_>) -> Result<Outcome, Error> {
        let (pair, clock) = self.prepare_pair(request)?;
        let tried = if self.options.check_scale { self.doubt_scale(request, &pair)? } else { None };
        let mut outcome = self.rounds(request, &pair, clock, Round::AllAround)?;
        if let Some(tried) = tried
            && tried.is_told(outcome.abstain)
        {
            outcome.abstain |= tried.ambiguous;
            outcome.warnings.push(Warning::Scale(tried.doubt));
        }
        Ok(outcome)
    }

    /// As [`register`](Self::register), without a question about the scale.
    pub(crate) fn register_as_it_is(&self, request: &Request<'_>) -> Result<Outcome, Error> {
        let (pair, clock) = self.prepare_pair(request)?;
        self.rounds(request, &pair, clock, Round::AllAround)
    }

    /// What the cheap sources find.
    pub(crate) fn first_round(&self, request: &Request<'_>) -> Result<Outcome, Error> {
        let (pair, clock) = self.prepare_pair(request)?;
        self.rounds(request, &pair, clock, Round::Cheap)
    }

    /// The rounds up to `last`.
    fn rounds(
        &self,
        request: &Request<'_>,
        pair: &PreparedPair,
        clock: StageClock<'_>,
        last: Round,
    ) -> Result<Outcome, Error> {
        let mut search = Search::new(pair, self.options.refine.is_some(), clock);
        let mut answer = None;
        for (number, (round, sources)) in (1..).zip(&self.rounds) {
            if *round > last {
                break;
            }
            if request.is_stopped() {
                return Err(Error::Stopped);
            }
            request.observed.tell(Event::Round { number, of: self.rounds.len() });
            if !search.propose(*round, sources).map_err(Error::Refine)? {
                continue;
            }
            let Some(best) = search.best(round.refining()).map_err(Error::Refine)? else { continue };
            let judgement = self.judge.judge(&best.features);
            let corroborated = search.is_corroborated(&best);
            answer = Some((best, judgement));
            let (probability, sure) = (judgement.probability, is_sure(judgement.probability));
            request.observed.tell(Event::Judged { round: number, probability, sure });
            if sure || *round >= Round::Graph && probability.get() >= FAIR && corroborated {
                break;
            }
        }
        match answer {
            Some((best, judgement)) => Ok(self.outcome(pair, search, best, judgement)),
            None => Err(Error::NoPose(search.no_pose())),
        }
    }

    /// Checks, centres, thins and indexes both clouds; the target only if it is not ready yet.
    fn prepare_pair<'a>(&self, request: &Request<'a>) -> Result<(PreparedPair, StageClock<'a>), Error> {
        Solid::new(request.source).map_err(Error::Source)?;
        request.observed.tell(Event::Began(Stage::PrepareTarget));
        let target = match request.target {
            RequestTarget::Cloud(cloud) => self.prepare(cloud)?,
            RequestTarget::Prepared(target) => target.clone(),
        };
        let prepared = StageTime { stage: Stage::PrepareTarget, seconds: target.0.seconds };
        request.observed.tell(Event::Ended(prepared));
        let mut clock = StageClock::after(vec![prepared], request.observed);
        clock.begin(Stage::PrepareSource);
        let pair = PreparedPair::new(request.source, target, request.initial.as_ref(), &self.options)?;
        clock.lap(Stage::PrepareSource);
        Ok((pair, clock))
    }

    fn outcome(&self, pair: &PreparedPair, search: Search<'_>, best: Best, judgement: Judgement) -> Outcome {
        let mut learned = search.finish();
        let asked = |t: &StageTime| matches!(t.stage, Stage::Network | Stage::NetworkAllAround);
        let network = self.network.as_ref().filter(|_| learned.times.iter().any(asked));
        let weights = network.and_then(|network| Some(network.get().ok()?.weights.clone()));
        let Judgement { probability, abstain, alone } = judgement;
        learned.warnings.extend(abstain.then_some(Warning::Doubtful { probability }));
        let target_from_source = pair.frame.undo_pose(&best.pose);
        let answer = CandidatePose { target_from_source, probability };
        let poses = CandidatePose::all(answer, &best.alternatives, |pose| pair.frame.undo_pose(pose));
        let spread = best.assessment.spread;
        let centre = pair.frame.undo_target(&spread.centre.into()).into();
        let spread = Scatter { centre, ..spread };
        Outcome {
            target_from_source,
            scale: None,
            surfaces: [None; 2],
            probability,
            probability_of_fit: alone,
            abstain,
            method: self.options.method,
            start: best.start,
            tried: learned.tried,
            network: learned.network,
            refinement: best.refinement,
            evidence: best.evidence,
            features: best.features,
            poses,
            undetermined: Undetermined::of(&best.assessment, pair),
            spread,
            points: PointCounts { source: pair.source.count, target: pair.target_side().count },
            times: learned.times,
            seed: self.options.seed,
            weights,
            warnings: learned.warnings,
        }
    }
}
