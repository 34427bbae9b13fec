//! [`Remembered`]: shapes that keep their samples, since all corruptions show the same points of a shape.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use rand::rngs::ChaCha8Rng;
use srrf_cloud::PointCloud;
use srrf_corrupt::datasets::{Label, ShapeSource, SourceError};

/// Most numbers that are kept: 64 MiB.
const KEPT: usize = 64 * 1024 * 1024 / size_of::<[f64; 3]>();

/// What a sample depends on besides the shapes: the shape, the number of points, and the state of the generator.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Key {
    index: usize,
    count: usize,
    seed: [u8; 32],
    stream: u64,
    position: u128,
}

/// A sample, and where it leaves the generator.
#[derive(Debug)]
struct Sample {
    points: PointCloud,
    after: u128,
}

/// Shapes of a source. Samples that were drawn once are not drawn again while there is room for them.
pub struct Remembered {
    source: Box<dyn ShapeSource>,
    samples: Mutex<HashMap<Key, Arc<Sample>>>,
}

impl Remembered {
    pub fn new(source: Box<dyn ShapeSource>) -> Self {
        Self { source, samples: Mutex::default() }
    }
}

impl ShapeSource for Remembered {
    fn len(&self) -> usize {
        self.source.len()
    }

    fn description(&self) -> String {
        self.source.description()
    }

    fn id(&self, index: usize) -> String {
        self.source.id(index)
    }

    fn class(&self, index: usize) -> &str {
        self.source.class(index)
    }

    fn is_symmetric(&self, index: usize) -> bool {
        self.source.is_symmetric(index)
    }

    fn label(&self, index: usize) -> Label {
        self.source.label(index)
    }

    fn sample(&self, index: usize, count: usize, rng: &mut ChaCha8Rng) -> Result<PointCloud, SourceError> {
        let (seed, stream, position) = (rng.get_seed(), rng.get_stream(), rng.get_word_pos());
        let key = Key { index, count, seed, stream, position };
        let samples = || self.samples.lock().unwrap_or_else(PoisonError::into_inner);
        let known = samples().get(&key).map(Arc::clone);
        if let Some(known) = known {
            rng.set_word_pos(known.after);
            return Ok(known.points.clone());
        }
        let points = self.source.sample(index, count, rng)?;
        let sample = Arc::new(Sample { points: points.clone(), after: rng.get_word_pos() });
        let mut samples = samples();
        if samples.len().saturating_add(1).saturating_mul(count) <= KEPT {
            samples.insert(key, sample);
        }
        Ok(points)
    }

    fn sample_two(
        &self,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(PointCloud, PointCloud), SourceError> {
        self.source.sample_two(index, count, rng)
    }
}
