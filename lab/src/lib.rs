//! What the programs of the lab share: the pairs that networks are validated on, and parts of clouds.

use std::path::Path;

pub use srrf_calibrate::{VALIDATION_SHAPES, keep};

use srrf_corrupt::{Pair, Severity};
use srrf_train::TrainConfig;
use srrf_train::data::{TrainingPairs, training_shapes};

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
