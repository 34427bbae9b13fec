//! Training pairs: which shape, which corruption, which pose, all from (seed, number of the pair).

use rand::rngs::ChaCha8Rng;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use srrf_cloud::{PointCloud, Rigid, ShapeSource};
use srrf_corrupt::{CorruptionKind, Pair, PairConfig, PairError, PairSynthesizer, Rotation, Sampling, Severity};

use crate::config::{DrawConfig, TrainConfig};

/// Stream of a generator: keeps the draws of training, validation and shuffling apart.
#[derive(Clone, Copy)]
enum Stream {
    Shuffle = 1,
    Training = 2,
    Validation = 3,
    Shard = 4,
}

/// A generator for item `item` of `stream`.
fn generator(seed: u64, stream: Stream, item: u64) -> ChaCha8Rng {
    let mut key = [0_u8; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&(stream as u64).to_le_bytes());
    let mut rng = ChaCha8Rng::from_seed(key);
    rng.set_stream(item);
    rng
}

/// The pairs of a run. The same number gives the same pair, whatever was drawn before.
pub struct PairSource {
    shapes: Box<dyn ShapeSource>,
    training: Vec<usize>,
    validation: Vec<usize>,
    draw: DrawConfig,
    kinds: Vec<CorruptionKind>,
    seed: u64,
    pairs: PairConfig,
}

impl PairSource {
    /// Splits `shapes` into a training and a validation part (every n-th shape).
    pub fn new(config: &TrainConfig, shapes: Box<dyn ShapeSource>) -> Self {
        let (count, held_out) = (shapes.len(), config.data.validation.min(shapes.len() / 2).max(1));
        let stride = count as f64 / held_out as f64;
        let validation: Vec<usize> = (0..held_out).map(|i| ((i as f64 + 0.5) * stride) as usize).collect();
        let training = (0..count).filter(|i| validation.binary_search(i).is_err()).collect();
        let drawn = &config.draw.corruptions;
        let kinds = if drawn.is_empty() { CorruptionKind::ALL.to_vec() } else { drawn.clone() };
        let pairs = PairConfig { keep_correspondence: false, ..config.pairs.clone() };
        Self { shapes, training, validation, draw: config.draw.clone(), kinds, seed: config.seed, pairs }
    }

    /// Number of training shapes, the length of an epoch in pairs.
    pub fn len(&self) -> usize {
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
        order.shuffle(&mut generator(self.seed, Stream::Shuffle, epoch as u64));
        order
    }

    /// Pairs `first .. first + count` of the run, one shard. All have the same number of points.
    ///
    /// # Errors
    /// [`PairError`] when a shape cannot be read or corrupted.
    pub fn shard(&self, first: usize, count: usize) -> Result<Vec<Pair>, PairError> {
        let independent = generator(self.seed, Stream::Shard, first as u64).random_bool(self.draw.independent);
        let mut order = (usize::MAX, Vec::new());
        (first..first + count)
            .map(|number| {
                let (epoch, position) = (number / self.len(), number % self.len());
                if order.0 != epoch {
                    order = (epoch, self.order(epoch));
                }
                self.training_pair(order.1[position], number, independent)
            })
            .collect()
    }

    fn training_pair(&self, shape: usize, number: usize, independent: bool) -> Result<Pair, PairError> {
        let mut rng = generator(self.seed, Stream::Training, number as u64);
        let mut pairs = self.pairs.clone();
        if independent {
            pairs.sampling = Sampling::Independent;
            pairs.points = self.draw.independent_points;
        }
        if rng.random_bool(self.draw.residual) {
            pairs.rotation = Rotation::EulerAxes { max_deg: self.draw.residual_deg };
            pairs.translation = self.draw.residual_translation;
        }
        let corruption = if rng.random_bool(self.draw.clean) {
            None
        } else {
            let kind = self.kinds[rng.random_range(0..self.kinds.len())];
            let severity = self.draw.severities[rng.random_range(0..self.draw.severities.len())];
            Severity::try_from(severity).ok().map(|severity| (kind, severity))
        };
        let turned = rng.random_bool(self.draw.turned);
        let seed = rng.random::<u64>();
        if turned {
            let shapes = Turned { shapes: self.shapes.as_ref(), rotation: random_rotation(&mut rng) };
            PairSynthesizer::new(pairs)?.pair(&shapes, shape, corruption, seed, number as u64)
        } else {
            PairSynthesizer::new(pairs)?.pair(self.shapes.as_ref(), shape, corruption, seed, number as u64)
        }
    }

    /// The validation pairs: each held-out shape once, the types in turn, clean among them.
    ///
    /// # Errors
    /// [`PairError`] when a shape cannot be read or corrupted.
    pub fn validation(&self, severity: Severity) -> Result<Vec<Pair>, PairError> {
        let synthesizer = PairSynthesizer::new(self.pairs.clone())?;
        let mut rng = generator(self.seed, Stream::Validation, 0);
        let seed = rng.random::<u64>();
        self.validation
            .iter()
            .enumerate()
            .map(|(i, &shape)| {
                let kind = self.kinds.get(i % (self.kinds.len() + 1)).copied();
                let corruption = kind.map(|kind| (kind, severity));
                synthesizer.pair(self.shapes.as_ref(), shape, corruption, seed, i as u64)
            })
            .collect()
    }
}

/// Uniform on SO(3): the rotation nearest to a matrix of normal draws.
fn random_rotation(rng: &mut ChaCha8Rng) -> Rigid {
    let normal = rand_distr::StandardNormal;
    let matrix = nalgebra::Matrix3::from_fn(|_, _| rng.sample::<f64, _>(normal));
    let rotation = Rigid::nearest_rotation(&matrix).unwrap_or_else(nalgebra::Matrix3::identity);
    Rigid { rotation, ..Rigid::identity() }
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

    fn sample(
        &self,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<PointCloud, srrf_cloud::SourceError> {
        Ok(self.shapes.sample(index, count, rng)?.transformed(&self.rotation))
    }

    fn sample_two(
        &self,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(PointCloud, PointCloud), srrf_cloud::SourceError> {
        let (a, b) = self.shapes.sample_two(index, count, rng)?;
        Ok((a.transformed(&self.rotation), b.transformed(&self.rotation)))
    }
}
