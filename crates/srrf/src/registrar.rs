//! [`Registrar`]: the way from two clouds to an [`Outcome`], one statement a stage.

use std::sync::Arc;

use srrf_cloud::{PointCloud, Rigid, Solid};

use crate::error::Error;
use crate::judge::{Judge, Judgement};
use crate::network::Network;
use crate::options::{Method, Options};
use crate::outcome::{Outcome, PointCounts};
use crate::proposals::{Proposals, Round, rounds};
use crate::request::{Request, RequestTarget};
use crate::search::{Best, Search};
use crate::stage::{Stage, StageClock, StageTime};
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
    /// [`Error`] for clouds that determine no rotation, and where no pose is found.
    pub fn register(&self, request: &Request<'_>) -> Result<Outcome, Error> {
        let (pair, clock) = self.prepare_pair(request)?;
        let mut search = Search::new(&pair, self.options.refine.is_some(), clock);
        let mut answer = None;
        for (round, sources) in &self.rounds {
            if request.is_stopped() {
                return Err(Error::Stopped);
            }
            search.propose(sources).map_err(Error::Refine)?;
            let Some(best) = search.best(round.refining()).map_err(Error::Refine)? else { continue };
            let judgement = self.judge.judge(&best.features);
            answer = Some((best, judgement));
            if judgement.is_sure() {
                break;
            }
        }
        match answer {
            Some((best, judgement)) => Ok(self.outcome(&pair, search, best, judgement)),
            None => Err(Error::NoPose(search.no_pose())),
        }
    }

    /// Checks, centres, thins and indexes both clouds; the target only if it is not ready yet.
    fn prepare_pair(&self, request: &Request<'_>) -> Result<(PreparedPair, StageClock), Error> {
        Solid::new(request.source).map_err(Error::Source)?;
        let target = match request.target {
            RequestTarget::Cloud(cloud) => self.prepare(cloud)?,
            RequestTarget::Prepared(target) => target.clone(),
        };
        let prepared = StageTime { stage: Stage::PrepareTarget, seconds: target.0.seconds };
        let mut clock = StageClock::after(vec![prepared]);
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
