//! [`Registrar`]: the way from two clouds to an [`Outcome`], one statement a stage.

use std::time::Instant;

use nalgebra::Matrix3;
use rayon::prelude::*;
use srrf_classical::{FpfhCloud, FpfhRansac, FpfhRansacConfig, Icp, IcpConfig};
use srrf_cloud::{CloudError, PointCloud, Register, RegisterError, Registration, Rigid, Skeletons, Solid};
use srrf_model::CopyError;
use srrf_refine::{Ranking, RefineError, RefineTarget};

use crate::frame::{Centred, from_input, to_input};
use crate::network::{Network, thinned};
use crate::options::{Method, Options, RotationRange};
use crate::outcome::{CoarsePose, Outcome, PointCounts, StageTime};
use crate::probability::{Features, Logistic};
use crate::search::{Found, Search, Start};
use crate::starts::{cube_rotations, turned};

/// With this probability after a round of starts, no other one is made.
const SURE: f64 = 0.9;
/// Poses of FPFH with RANSAC that are starts of the first round.
const FIRST: usize = 4;
/// Poses that FPFH with RANSAC gives for each of its radii where there is doubt.
const WIDE: usize = 48;
/// Radii of the features that are tried then, in voxels, beside the default one: on crops and uneven clouds each finds poses that
/// the others miss (`docs/scans.md`).
const WIDE_RADII: [f64; 2] = [8.0, 12.0];

/// With [`RotationRange::Within45`], poses that are turned by more than this against the given one are no starts: 45 degrees about
/// each of three axes come to 86 at most.
const WITHIN_DEG: f64 = 90.0;

/// Why clouds could not be registered.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The options, the weights or the device cannot be used.
    #[error("{0}")]
    Setup(String),
    /// The source cannot be used.
    #[error("source: {0}")]
    Source(#[source] CloudError),
    /// The target cannot be used.
    #[error("target: {0}")]
    Target(#[source] CloudError),
    /// The device did not give its numbers.
    #[error(transparent)]
    Device(#[from] CopyError),
    /// No method found a pose.
    #[error("no pose found: {0}")]
    NoPose(String),
    /// The refinement could not run.
    #[error("refinement: {0}")]
    Refine(#[source] RefineError),
}

/// Registers pairs with one set of options; holds the network. Share it between threads.
#[derive(Debug)]
pub struct Registrar {
    options: Options,
    network: Option<Network>,
    calibration: Logistic,
}

/// A target made ready, to register many sources to it.
#[derive(Debug)]
pub struct Target {
    centred: Centred,
    thin: PointCloud,
    refine: RefineTarget,
    points: usize,
    seconds: f64,
}

impl Registrar {
    /// Loads what the options need.
    ///
    /// # Errors
    /// [`Error::Setup`] for unknown weights or devices, and settings that make no sense.
    pub fn new(options: Options) -> Result<Self, Error> {
        if let Some(config) = &options.refine {
            config.validate().map_err(Error::Refine)?;
        }
        let network = match options.method {
            Method::Auto | Method::Srrf => {
                Some(Network::load(options.weights.as_deref(), &options.device).map_err(Error::Setup)?)
            }
            _ => None,
        };
        Ok(Self { options, network, calibration: Logistic::embedded().map_err(Error::Setup)? })
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
        let begun = Instant::now();
        let target = Solid::new(target).map_err(Error::Target)?;
        let centred = Centred::new(&target).map_err(Error::Target)?;
        let thin = thinned(&centred.cloud);
        let config = self.options.refine.unwrap_or_default();
        let refine =
            RefineTarget::new(centred.solid().map_err(Error::Target)?, &config).map_err(Error::Refine)?;
        Ok(Target { centred, thin, refine, points: target.len(), seconds: begun.elapsed().as_secs_f64() })
    }

    /// Registers `source` to `target`: `target ~ R source + t`.
    ///
    /// # Errors
    /// [`Error`] for clouds that determine no rotation, and where no pose is found.
    pub fn register(&self, source: &PointCloud, target: &PointCloud) -> Result<Outcome, Error> {
        Solid::new(source).map_err(Error::Source)?;
        self.register_to(source, &self.prepare(target)?)
    }

    /// Registers `source` to a prepared target.
    ///
    /// # Errors
    /// As [`Registrar::register`].
    pub fn register_to(&self, source: &PointCloud, target: &Target) -> Result<Outcome, Error> {
        self.register_from(source, target, &self.options.given.unwrap_or_else(Rigid::identity))
    }

    /// Registers `source` to a prepared target with a first guess of its own, in place of [`Options::given`].
    ///
    /// # Errors
    /// As [`Registrar::register`].
    pub fn register_from(
        &self,
        source: &PointCloud,
        target: &Target,
        given: &Rigid,
    ) -> Result<Outcome, Error> {
        let mut clock = Clock::new();
        clock.times.push(StageTime { stage: "prepare target", seconds: target.seconds });
        let source = Solid::new(source).map_err(Error::Source)?;
        let centred = Centred::new(&source).map_err(Error::Source)?;
        let thin = thinned(&centred.cloud);
        let given = from_input(given, &centred, &target.centred);
        let refine = target.refine.source(centred.solid().map_err(Error::Source)?).map_err(Error::Refine)?;
        let mut search = Search::new(&target.refine, refine, self.options.refine.is_some());
        clock.lap("prepare source");

        // The first round: a look of the network, FPFH with RANSAC, the given pose.
        let mut warnings = Vec::new();
        let mut network = None;
        let mut starts: Vec<Start> = Vec::new();
        if let Some(net) = &self.network {
            let centre_to_centre = turned(given.rotation);
            match net.look_from(&thin, &target.thin, &centre_to_centre) {
                Ok(found) => {
                    starts.extend(poses_of(&found, "network"));
                    network = Some(self.coarse(&found, &centred, target));
                }
                Err(e) => warnings.push(format!("The network found no pose: {e}.")),
            }
            clock.lap("network");
        }
        let mut doubtful: Vec<Start> = Vec::new();
        let mut no_global = None;
        let wider = || -> Vec<Start> {
            // What they do not find, the other starts have to do without.
            WIDE_RADII.into_iter().flat_map(|r| self.global(&centred, target, r, &given)).flatten().collect()
        };
        match self.options.method {
            Method::Auto | Method::FpfhRansac => {
                let radius = FpfhRansacConfig::default().feature_voxels;
                match self.global(&centred, target, radius, &given) {
                    Ok(mut poses) => {
                        doubtful = poses.split_off(FIRST.min(poses.len()));
                        starts.extend(poses);
                    }
                    Err(e) => no_global = Some(format!("FPFH with RANSAC found no pose: {e}.")),
                }
                clock.lap("fpfh-ransac");
            }
            Method::Icp => {
                let found = icp(&centred.cloud, &target.centred.cloud, &given)
                    .map_err(|e| Error::NoPose(e.to_string()))?;
                starts.push(("icp".to_owned(), found));
                clock.lap("icp");
            }
            Method::Srrf | Method::Given => {}
        }
        if matches!(self.options.method, Method::Given | Method::Auto) {
            starts.push(("given".to_owned(), given));
        }
        let mut wider_left = matches!(self.options.method, Method::Auto | Method::FpfhRansac);
        if wider_left && starts.is_empty() {
            starts = wider();
            (wider_left, no_global) = (false, no_global.filter(|_| starts.is_empty()));
            clock.lap("fpfh-ransac, wider");
        }
        if starts.is_empty() {
            warnings.extend(no_global);
            return Err(Error::NoPose(warnings.join(" ")));
        }
        let (mut best, mut probability) = self.best_with(&mut search, &starts)?;
        clock.lap("refine");

        // The second round, where the first left doubt: less likely poses of FPFH with RANSAC, and wider features.
        if wider_left && probability < SURE {
            doubtful.extend(wider());
            no_global = no_global.filter(|_| doubtful.is_empty());
            clock.lap("fpfh-ransac, wider");
            (best, probability) = self.best_with(&mut search, &doubtful)?;
            clock.lap("refine, wider");
        }

        // The third, where doubt remains: the network from all around.
        if let Some(net) = &self.network
            && self.options.rotation == RotationRange::Any
            && probability < SURE
        {
            let found = all_around(net, &thin, &target.thin, &given);
            clock.lap("network, 23 orientations");
            (best, probability) = self.best_with(&mut search, &found)?;
            clock.lap("refine again");
        }

        warnings.extend(no_global);
        let abstain = probability < self.options.abstain_below;
        if abstain {
            warnings.push(format!(
                "The pose is right with a probability of {:.0}% only: check it, give a first guess, or crop both \
                 clouds to what they share.",
                100.0 * probability
            ));
        }
        Ok(Outcome {
            target_from_source: to_input(&best.pose, &centred, &target.centred),
            probability,
            abstain,
            method: self.options.method,
            start: best.start,
            network,
            refinement: best.refinement,
            evidence: best.evidence,
            features: best.features,
            points: PointCounts { source: source.len(), target: target.points },
            times: clock.times,
            seed: self.options.seed,
            weights: self.network.as_ref().map(|n| (n.name.clone(), n.sha256.clone())),
            warnings,
        })
    }

    /// The calibrated probability. It was fitted on [`Method::Auto`] with refinement and starts ranked by planes; for other methods,
    /// whose few starts give no rivals to compare with, other ranks, and poses without refinement, it is kept below the square
    /// of the fitness, which only errs on the side of doubt.
    fn probability(&self, features: &Features) -> f64 {
        let fitted = self.calibration.probability(features);
        let ranking = self.options.refine.map(|config| config.ranking);
        let known = self.options.method == Method::Auto && ranking == Some(Ranking::Planes);
        if known { fitted } else { fitted.min(features.fitness().powi(2)) }
    }

    /// The best start after one more round, refined, and its probability.
    fn best_with(&self, search: &mut Search<'_>, starts: &[Start]) -> Result<(Found, f64), Error> {
        search.add(starts).map_err(Error::Refine)?;
        let best = search.best().map_err(Error::Refine)?;
        let probability = self.probability(&best.features);
        Ok((best, probability))
    }

    /// What RANSAC found with features of this radius (in voxels), best first, as far as the options allow such turns against the
    /// given pose.
    fn global(
        &self,
        source: &Centred,
        target: &Target,
        radius: f64,
        given: &Rigid,
    ) -> Result<Vec<Start>, RegisterError> {
        let (source, target) = FpfhCloud::pair(
            source.solid().map_err(RegisterError::Source)?,
            target.centred.solid().map_err(RegisterError::Target)?,
        )?;
        let config = FpfhRansacConfig {
            seed: self.options.seed,
            feature_voxels: radius,
            hypotheses: WIDE,
            ..FpfhRansacConfig::default()
        };
        let found = FpfhRansac::new(config).hypotheses(&source, &target)?;
        let poses = match self.options.rotation {
            RotationRange::Any => found.poses,
            RotationRange::Within45 => within(found.poses, given)?,
        };
        Ok(poses.into_iter().map(|pose| ("fpfh-ransac".to_owned(), pose)).collect())
    }

    fn coarse(&self, found: &Registration, source: &Centred, target: &Target) -> CoarsePose {
        let input = |pose: &Rigid| to_input(pose, source, &target.centred);
        let mut branches = found.branches.clone();
        for branch in &mut branches {
            branch.target_from_source = input(&branch.target_from_source);
        }
        let gamma = |name: &str| branches.iter().find(|b| b.name == name).map_or(0.0, |b| b.inlier_ratio);
        let (dense, skeleton) = (gamma("dense"), gamma("skeleton"));
        let lambda = if dense + skeleton > 0.0 { dense / (dense + skeleton) } else { 0.5 };
        let shift =
            |p: &mut [f64; 3], centre: &nalgebra::Vector3<f64>| (0..3).for_each(|c| p[c] += centre[c]);
        let mut skeletons = found.skeletons.clone();
        if let Some(Skeletons { source: ours, target: theirs }) = &mut skeletons {
            ours.points.iter_mut().for_each(|p| shift(p, &source.centre));
            theirs.points.iter_mut().for_each(|p| shift(p, &target.centred.centre));
        }
        let mut matches = found.matches.clone();
        for m in &mut matches {
            shift(&mut m.source, &source.centre);
            shift(&mut m.target, &target.centred.centre);
        }
        let target_from_source = input(&found.target_from_source);
        CoarsePose { target_from_source, branches, lambda, skeletons, matches }
    }
}

/// The poses that are turned by at most [`WITHIN_DEG`] against the given one.
fn within(poses: Vec<Rigid>, given: &Rigid) -> Result<Vec<Rigid>, RegisterError> {
    let count = poses.len();
    let kept: Vec<Rigid> = poses.into_iter().filter(|p| p.angle_to_deg(given) <= WITHIN_DEG).collect();
    if kept.is_empty() {
        return Err(RegisterError::NoPose(format!(
            "each of {count} poses is turned by more than {WITHIN_DEG} degrees against the given one; the rotation range \
             45 excludes them, 180 does not"
        )));
    }
    Ok(kept)
}

/// The fused pose of the network and those of its branches.
fn poses_of(found: &Registration, name: &str) -> Vec<Start> {
    let mut poses = vec![(format!("{name} fused"), found.target_from_source)];
    poses.extend(found.branches.iter().map(|b| (format!("{name} {}", b.name), b.target_from_source)));
    poses
}

/// What the network sees of the source in the other 23 orientations of a cube.
fn all_around(net: &Network, source: &PointCloud, target: &PointCloud, given: &Rigid) -> Vec<Start> {
    let look = |(i, rotation): (usize, &Matrix3<f64>)| {
        let start = turned(given.rotation * rotation);
        let found = net.glance_from(source, target, &start).ok()?;
        Some((format!("network, orientation {}", i + 1), found.target_from_source))
    };
    cube_rotations()[1..].par_iter().enumerate().filter_map(look).collect()
}

/// ICP, point to point, from a given pose.
fn icp(source: &PointCloud, target: &PointCloud, given: &Rigid) -> Result<Rigid, RegisterError> {
    let found = Icp::new(IcpConfig::default()).register(&source.transformed(given), target)?;
    Ok(found.target_from_source.compose(given))
}

/// Times of the stages.
struct Clock {
    last: Instant,
    times: Vec<StageTime>,
}

impl Clock {
    fn new() -> Self {
        Self { last: Instant::now(), times: Vec::new() }
    }

    fn lap(&mut self, stage: &'static str) {
        self.times.push(StageTime { stage, seconds: self.last.elapsed().as_secs_f64() });
        self.last = Instant::now();
    }
}

#[cfg(test)]
mod tests {
    use srrf_cloud::EulerXyz;

    use super::*;

    #[test]
    fn poses_beyond_the_range_are_left_out_and_none_left_is_an_error() {
        let about_z = |degrees| turned(EulerXyz::from_deg([0.0, 0.0, degrees]).to_matrix());
        let given = about_z(30.0);
        let poses = vec![about_z(160.0), about_z(119.0), about_z(-59.0), about_z(-61.0)];
        assert_eq!(within(poses, &given).unwrap(), [about_z(119.0), about_z(-59.0)]);
        let said = within(vec![about_z(160.0), about_z(-61.0)], &given).unwrap_err().to_string();
        assert!(said.contains("each of 2 poses") && said.contains("180"), "{said}");
    }
}
