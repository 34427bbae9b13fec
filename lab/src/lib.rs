//! What the programs of the lab share: the pairs that networks are validated on, and parts of clouds.

use std::path::Path;

use srrf_cloud::{CloudError, PointCloud};
use srrf_corrupt::{Pair, Severity};
use srrf_train::TrainConfig;
use srrf_train::data::{TrainingPairs, training_shapes};

/// Shapes that the network of the program, `srrf`, was validated with ([`srrf_corrupt::datasets::held_out`]):
/// `data.validation` of its configuration.
pub const VALIDATION_SHAPES: usize = 192;

/// Any error, across threads.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// What the shapes are, and the validation pairs of a configuration: for each seed, each severity.
///
/// # Errors
/// When shapes cannot be read or corrupted, or a severity does not exist.
pub fn held_out_pairs(
    config: &TrainConfig,
    data: Option<&Path>,
    seeds: &[u64],
    severities: &[u8],
) -> Result<(String, Vec<Pair>), Failure> {
    let (mut description, mut found) = (String::new(), Vec::new());
    for &seed in seeds {
        let config = TrainConfig { seed, ..config.clone() };
        let pairs = TrainingPairs::new(&config, training_shapes(&config, data, None)?)?;
        description = pairs.description();
        for &severity in severities {
            found.extend(pairs.validation(Severity::try_from(severity)?)?);
        }
    }
    Ok((description, found))
}

/// Leaves the points of these numbers.
///
/// # Errors
/// [`CloudError`] when there are none.
pub fn keep(cloud: &mut PointCloud, kept: &[usize]) -> Result<(), CloudError> {
    *cloud = PointCloud::new(kept.iter().map(|&i| cloud.points()[i]).collect())?;
    Ok(())
}
