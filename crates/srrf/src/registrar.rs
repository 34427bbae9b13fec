//! [`Registrar`]: the way from two clouds to an [`Outcome`], one statement a stage.

use std::sync::Arc;

use srrf_cloud::{PointCloud, Rigid, Solid};

use crate::clock::StageClock;
use crate::error::Error;
use crate::event::Event;
use crate::judge::{Judge, Judgement};
use crate::network::Network;
use crate::options::{Method, Options};
use crate::outcome::{Outcome, PointCounts};
use crate::proposals::{Proposals, Round, rounds};
use crate::request::{Request, RequestTarget};
use crate::search::{Best, Search};
use crate::stage::{Stage, StageTime};
use crate::target::{PreparedPair, Target};
use crate::warning::Warning;

/// Registers pairs with one set of options; holds the network. Share it between threads.
#[derive(Debug)]
pub struct Registrar {
    options: Options,
    network: Option<Arc<Network>>,
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
                Some(Arc::new(Network::load(options.weights.as_deref(), &options.device)?))
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
    /// Starts come in rounds, the cheap ones first. Each round is ranked, its best start refined and judged, and the first answer
    /// that is sure ends the search.
    ///
    /// # Errors
    /// [`Error`] for clouds that determine no rotation, for clouds that seem to be in different units of length
    /// ([`Error::Scale`]), and where no pose is found.
    pub fn register(&self, request: &Request<'_>) -> Result<Outcome, Error> {
        let (pair, clock) = self.prepare_pair(request)?;
        let tried = if self.options.check_scale { self.doubt_scale(request, &pair)? } else { None };
        let mut outcome = self.rounds(request, &pair, clock, self.rounds.len())?;
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
        self.rounds(request, &pair, clock, self.rounds.len())
    }

    /// What the first round finds.
    pub(crate) fn first_round(&self, request: &Request<'_>) -> Result<Outcome, Error> {
        let (pair, clock) = self.prepare_pair(request)?;
        self.rounds(request, &pair, clock, 1)
    }

    /// At most so many rounds.
    fn rounds(
        &self,
        request: &Request<'_>,
        pair: &PreparedPair,
        clock: StageClock<'_>,
        most: usize,
    ) -> Result<Outcome, Error> {
        let mut search = Search::new(pair, self.options.refine.is_some(), clock);
        let mut answer = None;
        for (number, (round, sources)) in (1..).zip(&self.rounds).take(most) {
            if request.is_stopped() {
                return Err(Error::Stopped);
            }
            request.observed.tell(Event::Round { number, of: self.rounds.len() });
            search.propose(sources).map_err(Error::Refine)?;
            let Some(best) = search.best(round.refining()).map_err(Error::Refine)? else { continue };
            let judgement = self.judge.judge(&best.features);
            answer = Some((best, judgement));
            let (probability, sure) = (judgement.probability, judgement.is_sure());
            request.observed.tell(Event::Judged { round: number, probability, sure });
            if sure {
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
        let initial = request.initial.unwrap_or_else(Rigid::identity);
        let pair = PreparedPair::new(request.source, target, &initial, &self.options)?;
        clock.lap(Stage::PrepareSource);
        Ok((pair, clock))
    }

    fn outcome(&self, pair: &PreparedPair, search: Search<'_>, best: Best, judgement: Judgement) -> Outcome {
        let mut learned = search.finish();
        let Judgement { probability, abstain } = judgement;
        learned.warnings.extend(abstain.then_some(Warning::Doubtful { probability }));
        Outcome {
            target_from_source: pair.frame.undo_pose(&best.pose),
            scale: None,
            probability,
            abstain,
            method: self.options.method,
            start: best.start,
            tried: learned.tried,
            network: learned.network,
            refinement: best.refinement,
            evidence: best.evidence,
            features: best.features,
            points: PointCounts {
                source: pair.source.centred.cloud().len(),
                target: pair.target_side().centred.cloud().len(),
            },
            times: learned.times,
            seed: self.options.seed,
            weights: self.network.as_ref().map(|network| network.weights.clone()),
            warnings: learned.warnings,
        }
    }
}
