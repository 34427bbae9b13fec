//! What the pairs are made of.

use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use srrf_cloud::PointCloud;
use srrf_corrupt::datasets::{ShapeSource, SourceError};
use srrf_corrupt::shapes::ProceduralShapes;

/// Shapes that the pairs are made of.
const SHAPES: usize = 64;

/// Clouds of built-in shapes that are made once, as a data set on disk is.
pub struct Stored(Vec<PointCloud>);

impl Stored {
    /// The same clouds for the same seed.
    pub fn new(seed: u64, points: usize) -> Result<Self, SourceError> {
        let shapes = ProceduralShapes::new(seed, SHAPES, None)?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..SHAPES).map(|i| shapes.sample(i, points, &mut rng)).collect::<Result<_, _>>().map(Self)
    }
}

impl ShapeSource for Stored {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn description(&self) -> String {
        format!("{} stored clouds", self.len())
    }

    fn id(&self, index: usize) -> String {
        format!("cloud_{index}")
    }

    fn class(&self, _: usize) -> &str {
        ""
    }

    /// The whole cloud: the pairs ask for as many points as it has.
    fn sample(&self, index: usize, _: usize, _: &mut ChaCha8Rng) -> Result<PointCloud, SourceError> {
        Ok(self.0[index].clone())
    }

    fn sample_two(
        &self,
        index: usize,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<(PointCloud, PointCloud), SourceError> {
        let cloud = self.sample(index, count, rng)?;
        Ok((cloud.clone(), cloud))
    }
}
