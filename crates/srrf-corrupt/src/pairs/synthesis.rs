//! [`PairSynthesizer`]: corrupt, normalise, resample, pose, shuffle.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, seq::SliceRandom};
use srrf_cloud::{PointCloud, Rigid};

use super::config::{Corrupt, InvalidConfig, Normalize, PairConfig, Sampling};
use super::pair::{Bases, Pair, PairError};
use super::pose::{PoseDraw, dcp_test_pose, draw};
use super::stream::{Purpose, Stream};
use crate::corruption::{CorruptError, Corrupted, Corruption};
use crate::corruptions::CorruptionKind;
use crate::datasets::{Label, ShapeSource};
use crate::kind::corruption;
use crate::normalize::box_normalize;
use crate::severity::Severity;

/// What hits a cloud.
#[derive(Clone, Copy)]
struct Hit<'a> {
    corruption: &'a dyn Corruption,
    severity: Severity,
}

/// Makes registration pairs by one [`PairConfig`]. Cheap; share it between threads.
#[derive(Debug, Clone, PartialEq)]
pub struct PairSynthesizer {
    config: PairConfig,
}

impl PairSynthesizer {
    /// With a checked config.
    ///
    /// # Errors
    /// [`InvalidConfig`] names the number that makes no sense.
    pub fn new(config: PairConfig) -> Result<Self, InvalidConfig> {
        config.validate()?;
        Ok(Self { config })
    }

    /// The config.
    pub fn config(&self) -> &PairConfig {
        &self.config
    }

    /// Makes a pair from shape `index`. The same arguments give the same pair.
    ///
    /// Every step has random numbers of its own: with one `stream`, pairs of different
    /// corruptions show the same base points in the same pose.
    ///
    /// # Errors
    /// [`PairError`] when the shape cannot be read or corrupted.
    pub fn pair(
        &self,
        shapes: &dyn ShapeSource,
        index: usize,
        corruption: Option<(CorruptionKind, Severity)>,
        pose: PoseDraw,
        stream: Stream,
    ) -> Result<Pair, PairError> {
        let built = self.built(corruption);
        let hit = built.as_ref().map(|(corruption, severity)| (&**corruption, *severity));
        Ok(Pair { corruption, ..self.pair_with(shapes, index, hit, pose, stream)? })
    }

    /// As [`PairSynthesizer::pair`], with any [`Corruption`]: a [`Mixture`](crate::Mixture), or one that is not in
    /// the registry.
    ///
    /// # Errors
    /// [`PairError`] when the shape cannot be read or corrupted.
    pub fn pair_with(
        &self,
        shapes: &dyn ShapeSource,
        index: usize,
        corruption: Option<(&dyn Corruption, Severity)>,
        pose: PoseDraw,
        stream: Stream,
    ) -> Result<Pair, PairError> {
        let points = self.config.points;
        let count = corruption.map_or(points, |(corruption, _)| corruption.clean_points(points));
        let label = shapes.label(index);
        let mut rng = stream.rng(Purpose::Base);
        let hit = corruption.map(|(corruption, severity)| Hit { corruption, severity });
        match self.config.sampling {
            Sampling::Shared => {
                let base = shapes.sample(index, count, &mut rng)?;
                self.make(Bases::Shared(&base), label, hit, pose, stream)
            }
            Sampling::Independent => {
                let (source, target) = shapes.sample_two(index, count, &mut rng)?;
                self.make(Bases::Independent(&source, &target), label, hit, pose, stream)
            }
        }
    }

    /// Makes a pair from clouds at hand; `sampling` of the config plays no part.
    ///
    /// # Errors
    /// [`PairError`] when the cloud cannot be corrupted.
    pub fn pair_from_bases(
        &self,
        bases: Bases<'_>,
        label: Label,
        corruption: Option<(CorruptionKind, Severity)>,
        pose: PoseDraw,
        stream: Stream,
    ) -> Result<Pair, PairError> {
        let built = self.built(corruption);
        let hit = built
            .as_ref()
            .map(|(corruption, severity)| Hit { corruption: &**corruption, severity: *severity });
        Ok(Pair { corruption, ..self.make(bases, label, hit, pose, stream)? })
    }

    /// The corruption of that name, in the readings of the config.
    fn built(&self, named: Option<(CorruptionKind, Severity)>) -> Option<(Box<dyn Corruption>, Severity)> {
        named.map(|(kind, severity)| (corruption(kind, &self.config.variants), severity))
    }

    /// Corrupts, resamples, poses and shuffles.
    fn make(
        &self,
        bases: Bases<'_>,
        label: Label,
        corruption: Option<Hit<'_>>,
        pose: PoseDraw,
        stream: Stream,
    ) -> Result<Pair, PairError> {
        let config = &self.config;
        let (source_base, target_base, shared) = match bases {
            Bases::Shared(base) => (base, base, true),
            Bases::Independent(source, target) => (source, target, false),
        };
        let target_from_source = match pose {
            PoseDraw::Seeded => draw(config.rotation, config.translation, &mut stream.rng(Purpose::Pose)),
            PoseDraw::DcpTest(item) => dcp_test_pose(item),
            PoseDraw::Given(pose) => pose,
        };
        let side = |base: &PointCloud, hit: bool, pose: &Rigid, corrupting, resampling| {
            let hit = corruption.filter(|_| hit);
            let mut rng = stream.rng(corrupting);
            let cloud = self
                .corrupted(base, hit, &mut rng)
                .map_err(|source| PairError::Corrupt { id: label.id.clone(), source })?;
            let boxed = hit.is_some_and(|hit| hit.corruption.is_box_normalized());
            let mut cloud = resample(cloud, config.points, &mut stream.rng(resampling));
            cloud.points.iter_mut().for_each(|p| *p = pose.apply(p));
            if boxed && config.normalize == Normalize::AfterPose {
                box_normalize(&mut cloud.points);
            }
            let points = PointCloud::new(cloud.points)
                .map_err(|source| PairError::Cloud { id: label.id.clone(), source })?;
            Ok::<_, PairError>((points, (shared && config.keep_correspondence).then_some(cloud.origin)))
        };
        let (source, source_origin) = side(
            source_base,
            config.corrupt != Corrupt::Target,
            &Rigid::identity(),
            Purpose::SourceCorruption,
            Purpose::SourceResampling,
        )?;
        let (target, target_origin) = side(
            target_base,
            config.corrupt != Corrupt::Source,
            &target_from_source,
            Purpose::TargetCorruption,
            Purpose::TargetResampling,
        )?;
        let Label { id, class, symmetric } = label;
        Ok(Pair {
            source,
            target,
            target_from_source,
            source_origin,
            target_origin,
            corruption: None,
            id,
            class,
            symmetric,
        })
    }

    /// The base points corrupted, and normalised if that comes before the pose.
    fn corrupted(
        &self,
        base: &PointCloud,
        hit: Option<Hit<'_>>,
        rng: &mut ChaCha8Rng,
    ) -> Result<Corrupted, CorruptError> {
        let Some(Hit { corruption, severity }) = hit else {
            return Ok(Corrupted::moved(base.points().to_vec()));
        };
        let mut cloud = corruption.apply(base.points(), severity, rng)?;
        if corruption.is_box_normalized() && self.config.normalize == Normalize::Canonical {
            box_normalize(&mut cloud.points);
        }
        Ok(cloud)
    }
}

/// Exactly `count` points in random order: a random subset of more, or all of fewer and random
/// repeats of them.
fn resample(cloud: Corrupted, count: usize, rng: &mut ChaCha8Rng) -> Corrupted {
    let have = cloud.points.len();
    let mut chosen: Vec<usize> = (0..have).collect();
    // A shuffle puts a uniform random subset in front.
    chosen.shuffle(rng);
    chosen.truncate(count);
    if have > 0 && have < count {
        chosen.extend((have..count).map(|_| rng.random_range(0..have)));
        chosen.shuffle(rng);
    }
    Corrupted {
        points: chosen.iter().map(|&i| cloud.points[i]).collect(),
        origin: chosen.iter().map(|&i| cloud.origin[i]).collect(),
    }
}
