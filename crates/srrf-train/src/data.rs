//! Training pairs: which shape, which corruption, which pose, all from (seed, number of the pair).

use std::path::Path;

use nalgebra::{Rotation3, Unit, Vector3};
use rand::rngs::ChaCha8Rng;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use srrf_cloud::{PointCloud, Rigid};
use srrf_corrupt::crop::{crop, random_direction};
use srrf_corrupt::datasets::{ACCEPTED_LAYOUTS, ShapeSource, SourceError, Split, held_out, open};
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::{
    CorruptionKind, Pair, PairConfig, PairError, PairSynthesizer, PoseDraw, Sampling, Severity, Stream,
};

use crate::config::{DataSource, DrawConfig, TrainConfig};
use crate::seam::Trained;

/// What a user without the data may do.
const WITHOUT: &str = "to train without a download: srrf-train --config configs/shapes.toml";

/// Why there are no shapes to train on.
#[derive(Debug, thiserror::Error)]
pub enum ShapesError {
    /// The configuration wants ModelNet40, and nobody said where it is.
    #[error(
        "this configuration trains on ModelNet40; say where it is by --data PATH, $SRRF_DATA or `data.path`. \
         {ACCEPTED_LAYOUTS}\n{WITHOUT}"
    )]
    NoPath,
    /// The configuration wants built-in shapes, and somebody said where others are.
    #[error(
        "this configuration trains on built-in shapes, and --data names others: leave --data out, or write \
         `data.source = \"modelnet\"`, which takes any of the layouts. {ACCEPTED_LAYOUTS}"
    )]
    NotAsked,
    /// It cannot be read.
    #[error("{0}\n{WITHOUT}")]
    Unreadable(#[source] SourceError),
    /// The built-in shapes cannot be made.
    #[error(transparent)]
    BuiltIn(SourceError),
}

/// The shapes that a configuration asks for: built-in ones, or the training split at `data`, which comes before that of
/// the environment, which comes before the path in the configuration.
///
/// # Errors
/// [`ShapesError`] where they cannot be had.
pub fn training_shapes<C: Trained>(
    config: &TrainConfig<C>,
    data: Option<&Path>,
    environment: Option<&Path>,
) -> Result<Box<dyn ShapeSource>, ShapesError> {
    if config.data.source == DataSource::Shapes && data.is_some() {
        return Err(ShapesError::NotAsked);
    }
    match (config.data.source, data.or(environment).or(config.data.path.as_deref())) {
        (DataSource::Shapes, _) => match ProceduralShapes::new(config.seed, config.data.shapes, None) {
            Ok(shapes) => Ok(Box::new(shapes)),
            Err(source) => Err(ShapesError::BuiltIn(source)),
        },
        (DataSource::Modelnet, Some(path)) => open(path, Split::Train).map_err(ShapesError::Unreadable),
        (DataSource::Modelnet, None) => Err(ShapesError::NoPath),
    }
}

/// Stream of a generator: keeps the draws of training, validation and shuffling apart.
#[derive(Clone, Copy)]
enum DrawStream {
    Shuffle = 1,
    Training = 2,
    Validation = 3,
    Shard = 4,
    Crop = 5,
    BuiltIn = 6,
}

/// A generator for item `item` of `stream`.
fn generator(seed: u64, stream: DrawStream, item: u64) -> ChaCha8Rng {
    let mut key = [0_u8; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&(stream as u64).to_le_bytes());
    let mut rng = ChaCha8Rng::from_seed(key);
    rng.set_stream(item);
    rng
}

/// The pairs of a run. The same number gives the same pair, whatever was drawn before.
pub struct TrainingPairs {
    shapes: Box<dyn ShapeSource>,
    built_in: Option<(ProceduralShapes, f64)>,
    training: Vec<usize>,
    validation: Vec<usize>,
    draw: DrawConfig,
    kinds: Vec<CorruptionKind>,
    seed: u64,
    pairs: PairConfig,
}

impl TrainingPairs {
    /// Splits `shapes` into a training and a validation part (every n-th shape).
    ///
    /// # Errors
    /// [`PairError`] when the built-in shapes that `data.built_in` asks for cannot be made.
    pub fn new<C: Trained>(config: &TrainConfig<C>, shapes: Box<dyn ShapeSource>) -> Result<Self, PairError> {
        let validation = held_out(shapes.len(), config.data.validation);
        let training = (0..shapes.len()).filter(|i| validation.binary_search(i).is_err()).collect();
        let drawn = &config.draw.corruptions;
        let kinds = if drawn.is_empty() { CorruptionKind::ALL.to_vec() } else { drawn.clone() };
        let pairs = PairConfig { keep_correspondence: false, ..config.pairs };
        let built_in = match config.data.built_in {
            share if share > 0.0 => {
                Some((ProceduralShapes::new(config.seed, config.data.shapes, None)?, share))
            }
            _ => None,
        };
        let draw = config.draw.clone();
        Ok(Self { shapes, built_in, training, validation, draw, kinds, seed: config.seed, pairs })
    }

    /// Number of training shapes, the length of an epoch in pairs.
    pub fn epoch_length(&self) -> usize {
        self.training.len()
    }

    /// Which data, and how they were split.
    pub fn description(&self) -> String {
        format!(
            "{}: {} shapes to train, {} to validate",
            self.shapes.description(),
            self.training.len(),
            self.validation.len()
        )
    }

    /// Order of the training shapes in an epoch.
    fn order(&self, epoch: usize) -> Vec<usize> {
        let mut order = self.training.clone();
        order.shuffle(&mut generator(self.seed, DrawStream::Shuffle, epoch as u64));
        order
    }

    /// Pairs `first .. first + count` of the run, one shard. All have the same number of points.
    ///
    /// # Errors
    /// [`PairError`] when a shape cannot be read or corrupted.
    pub fn shard(&self, first: usize, count: usize) -> Result<Vec<Pair>, PairError> {
        let mut rng = generator(self.seed, DrawStream::Shard, first as u64);
        let independent = rng.random_bool(self.draw.independent);
        if let Some((shapes, share)) = &self.built_in
            && rng.random_bool(*share)
        {
            return (first..first + count)
                .map(|number| {
                    let mut rng = generator(self.seed, DrawStream::BuiltIn, number as u64);
                    let sampled = Sampled { shapes, independent, points: self.pairs.points };
                    self.training_pair(sampled, rng.random_range(0..shapes.len()), number)
                })
                .collect();
        }
        let points = if independent { self.draw.independent_points } else { self.pairs.points };
        let sampled = Sampled { shapes: self.shapes.as_ref(), independent, points };
        let mut order = (usize::MAX, Vec::new());
        (first..first + count)
            .map(|number| {
                let (epoch, position) = (number / self.epoch_length(), number % self.epoch_length());
                if order.0 != epoch {
                    order = (epoch, self.order(epoch));
                }
                self.training_pair(sampled, order.1[position], number)
            })
            .collect()
    }

    fn training_pair(&self, sampled: Sampled, shape: usize, number: usize) -> Result<Pair, PairError> {
        let mut rng = generator(self.seed, DrawStream::Training, number as u64);
        let mut pairs = PairConfig { points: sampled.points, ..self.pairs };
        if sampled.independent {
            pairs.sampling = Sampling::Independent;
        }
        let corruption = if rng.random_bool(self.draw.clean) {
            None
        } else {
            let kind = self.kinds[rng.random_range(0..self.kinds.len())];
            let severity = self.draw.severities[rng.random_range(0..self.draw.severities.len())];
            Severity::try_from(severity).ok().map(|severity| (kind, severity))
        };
        let draw = &self.draw;
        let (residual, turned) = (rng.random_bool(draw.residual), rng.random_bool(draw.turned));
        let pose = match (residual, turned) {
            (true, _) => PoseDraw::Given(random_pose(&mut rng, draw.residual_deg, draw.residual_translation)),
            (_, true) => PoseDraw::Given(random_pose(&mut rng, draw.turned_deg, pairs.translation)),
            _ => PoseDraw::Seeded,
        };
        let stream = Stream { seed: rng.random(), item: number as u64 };
        let synthesizer = PairSynthesizer::new(pairs)?;
        let mut pair = if turned {
            let shapes = Turned { shapes: sampled.shapes, rotation: random_pose(&mut rng, 180.0, 0.0) };
            synthesizer.pair(&shapes, shape, corruption, pose, stream)?
        } else {
            synthesizer.pair(sampled.shapes, shape, corruption, pose, stream)?
        };
        let mut rng = generator(self.seed, DrawStream::Crop, number as u64);
        if self.draw.cropped > 0.0 && rng.random_bool(self.draw.cropped) {
            self.crop(&mut pair, &mut rng)?;
        }
        Ok(pair)
    }

    /// Cuts both clouds by a plane each, so that they overlap in part, and fills them up by repeats.
    /// The two directions are less than a right angle apart, as those of two views of an object.
    fn crop(&self, pair: &mut Pair, rng: &mut ChaCha8Rng) -> Result<(), PairError> {
        let first = random_direction(rng);
        let mut second = random_direction(rng);
        if first.dot(&second) < 0.0 {
            second = -second;
        }
        let second = pair.target_from_source.rotation * second;
        for (cloud, direction) in [(&mut pair.source, first), (&mut pair.target, second)] {
            let keep = self.draw.crop_keep + (1.0 - self.draw.crop_keep) * rng.random::<f64>();
            let kept = crop(cloud.points(), &direction, keep);
            let filled = kept.iter().copied().chain((kept.len()..cloud.len()).map(|i| kept[i % kept.len()]));
            *cloud = PointCloud::new(filled.map(|i| cloud.points()[i]).collect())
                .map_err(|source| PairError::Cloud { id: pair.id.clone(), source })?;
        }
        Ok(())
    }

    /// The validation pairs: each held-out shape once, the types in turn, clean among them.
    ///
    /// # Errors
    /// [`PairError`] when a shape cannot be read or corrupted.
    pub fn validation(&self, severity: Severity) -> Result<Vec<Pair>, PairError> {
        let synthesizer = PairSynthesizer::new(self.pairs)?;
        let seed = generator(self.seed, DrawStream::Validation, 0).random::<u64>();
        self.validation
            .iter()
            .enumerate()
            .map(|(i, &shape)| {
                let kind = self.kinds.get(i % (self.kinds.len() + 1)).copied();
                let corruption = kind.map(|kind| (kind, severity));
                let stream = Stream { seed, item: i as u64 };
                synthesizer.pair(self.shapes.as_ref(), shape, corruption, PoseDraw::Seeded, stream)
            })
            .collect()
    }
}

/// Where the clouds of a pair come from, and how they are sampled.
#[derive(Clone, Copy)]
struct Sampled<'a> {
    shapes: &'a dyn ShapeSource,
    independent: bool,
    points: usize,
}

/// A turn about a random axis by up to `max_deg`, and a translation of up to `translation` along
/// each axis.
fn random_pose(rng: &mut ChaCha8Rng, max_deg: f64, translation: f64) -> Rigid {
    let axis = Vector3::from_fn(|_, _| rng.sample::<f64, _>(StandardNormal));
    let angle_rad = (rng.random::<f64>() * max_deg).to_radians();
    let rotation = Rotation3::from_axis_angle(&Unit::new_normalize(axis), angle_rad).into_inner();
    let translation = Vector3::from_fn(|_, _| (2.0 * rng.random::<f64>() - 1.0) * translation);
    Rigid { rotation, translation }
}

/// A source whose shapes are turned.
struct Turned<'a> {
    shapes: &'a dyn ShapeSource,
    rotation: Rigid,
}

impl ShapeSource for Turned<'_> {
    fn len(&self) -> usize {
        self.shapes.len()
    }

    fn description(&self) -> String {
        format!("{}, turned", self.shapes.description())
    }

    fn id(&self, index: usize) -> String {
        self.shapes.id(index)
    }

    fn class(&self, index: usize) -> &str {
        self.shapes.class(index)
    }

    fn sample(&self, index: usize, count: usize, rng: &mut ChaCha8Rng) -> Result<PointCloud, SourceError> {
        Ok(self.shapes.sample(index, count, rng)?.transformed(&self.rotation))
    }

    fn sample_two(
        &self,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(PointCloud, PointCloud), SourceError> {
        let (a, b) = self.shapes.sample_two(index, count, rng)?;
        Ok((a.transformed(&self.rotation), b.transformed(&self.rotation)))
    }
}
