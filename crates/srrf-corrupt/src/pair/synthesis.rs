//! [`PairSynthesizer`]: corrupt, normalise, resample, pose, shuffle.

use crate::datasets::{ShapeSource, SourceError};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, seq::SliceRandom};
use srrf_cloud::{CloudError, PointCloud, Rigid};

use super::pose::draw;
use super::{Corrupt, InvalidConfig, Normalize, PairConfig, PoseDraw, Purpose, Sampling, Stream};
use crate::{
    CorruptError, Corrupted, Corruption, CorruptionKind, DensityInc, Mixture, Severity, box_normalize,
};

/// Two clouds of one shape, and the pose between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Shape `[points, 3]`, in the shape's canonical frame.
    pub source: PointCloud,
    /// Shape `[points, 3]`, posed by [`Pair::target_from_source`].
    pub target: PointCloud,
    /// The pose that was applied: exact, up to what the corruptions moved. With
    /// [`Normalize::AfterPose`] only its rotation means something.
    pub target_from_source: Rigid,
    /// For each source point the base point that it is, `None` for points that a corruption
    /// added. Absent for independent sampling, or where the config does not keep it.
    pub source_origin: Option<Vec<Option<u32>>>,
    /// The same for the target. Points with equal entries correspond.
    pub target_origin: Option<Vec<Option<u32>>>,
    /// What was done to the clouds; `None` if they are clean, or corrupted by a [`Mixture`].
    pub corruption: Option<(CorruptionKind, Severity)>,
    /// Name of the shape.
    pub id: String,
    /// Name of its category, empty if unknown.
    pub class: String,
    /// Whether its class is symmetric about an axis, so that no pose is unique.
    pub symmetric: bool,
}

/// What a shape is called.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Label {
    /// Name of the shape.
    pub id: String,
    /// Name of its category.
    pub class: String,
    /// Whether the category is symmetric about an axis.
    pub symmetric: bool,
}

/// The clean points from which a pair is made, canonical frame.
#[derive(Debug, Clone, Copy)]
pub enum Bases<'a> {
    /// Source and target are made from the same points.
    Shared(&'a PointCloud),
    /// Source and target (in this order) are made from points of their own.
    Independent(&'a PointCloud, &'a PointCloud),
}

/// Why a pair could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PairError {
    /// The config makes no sense.
    #[error("pair configuration: {0}")]
    Config(#[from] InvalidConfig),
    /// The shape could not be had.
    #[error("{0}")]
    Shape(#[from] SourceError),
    /// The shape could not be corrupted.
    #[error("shape {id}: {source}")]
    Corrupt {
        /// Name of the shape.
        id: String,
        /// Why.
        source: CorruptError,
    },
    /// The pair has coordinates that are not finite, as huge input coordinates may give.
    #[error("shape {id}: {source}")]
    Cloud {
        /// Name of the shape.
        id: String,
        /// Which.
        source: CloudError,
    },
}

/// What hits a cloud.
#[derive(Clone, Copy)]
struct Hit<'a> {
    corruption: &'a dyn Corruption,
    severity: Severity,
    /// Whether box normalisation, if the config asks for it, follows.
    boxed: bool,
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
        // ModelNet40-C's density_inc thins a cloud of twice the points.
        let thinned = self.config.variants.density_inc == DensityInc::ModelNet40C
            && matches!(corruption, Some((CorruptionKind::DensityInc, _)));
        let count = if thinned { 2 * self.config.points } else { self.config.points };
        self.sampled(shapes, index, count, stream, |bases, label| {
            self.pair_from_bases(bases, label, corruption, pose, stream)
        })
    }

    /// As [`PairSynthesizer::pair`], with a mixture of corruptions. Box normalisation leaves mixtures
    /// alone.
    ///
    /// # Errors
    /// [`PairError`] when the shape cannot be read or corrupted.
    pub fn mixed_pair(
        &self,
        shapes: &dyn ShapeSource,
        index: usize,
        (mixture, severity): (Mixture, Severity),
        pose: PoseDraw,
        stream: Stream,
    ) -> Result<Pair, PairError> {
        let corruption = mixture.corruption(&self.config.variants);
        let hit = Hit { corruption: &*corruption, severity, boxed: false };
        self.sampled(shapes, index, self.config.points, stream, |bases, label| {
            self.make(bases, label, Some(hit), pose, stream)
        })
    }

    /// Draws `count` base points of shape `index` for `make`.
    fn sampled(
        &self,
        shapes: &dyn ShapeSource,
        index: usize,
        count: usize,
        stream: Stream,
        make: impl FnOnce(Bases<'_>, Label) -> Result<Pair, PairError>,
    ) -> Result<Pair, PairError> {
        let label = Label {
            id: shapes.id(index),
            class: shapes.class(index).to_owned(),
            symmetric: shapes.is_symmetric(index),
        };
        let mut rng = stream.rng(Purpose::Base);
        match self.config.sampling {
            Sampling::Shared => make(Bases::Shared(&shapes.sample(index, count, &mut rng)?), label),
            Sampling::Independent => {
                let (source, target) = shapes.sample_two(index, count, &mut rng)?;
                make(Bases::Independent(&source, &target), label)
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
        let built = corruption
            .map(|(kind, severity)| (crate::corruption(kind, &self.config.variants), kind, severity));
        let hit = built.as_ref().map(|(corruption, kind, severity)| Hit {
            corruption: &**corruption,
            severity: *severity,
            boxed: kind.is_box_normalized(),
        });
        Ok(Pair { corruption, ..self.make(bases, label, hit, pose, stream)? })
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
            PoseDraw::DcpTest(item) => super::dcp_test_pose(item),
            PoseDraw::Given(pose) => pose,
        };
        let side = |base: &PointCloud, hit: bool, pose: &Rigid, corrupting, resampling| {
            let hit = corruption.filter(|_| hit);
            let mut rng = stream.rng(corrupting);
            let cloud = self
                .corrupted(base, hit, &mut rng)
                .map_err(|source| PairError::Corrupt { id: label.id.clone(), source })?;
            let boxed = hit.is_some_and(|hit| hit.boxed);
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
        let Some(Hit { corruption, severity, boxed }) = hit else {
            return Ok(Corrupted::moved(base.points().to_vec()));
        };
        let mut cloud = corruption.apply(base.points(), severity, rng)?;
        if boxed && self.config.normalize == Normalize::Canonical {
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
