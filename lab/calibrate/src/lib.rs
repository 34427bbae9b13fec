//! What the programs behind the probability share: small point sets, parts of clouds, and the shapes that no network was trained on.

pub mod point_sets;

use srrf_cloud::{CloudError, PointCloud};

/// Shapes that the network of the program, `srrf`, was validated with ([`srrf_corrupt::datasets::held_out`]):
/// `data.validation` of its configuration.
pub const VALIDATION_SHAPES: usize = 192;

/// Leaves the points of these numbers.
///
/// # Errors
/// [`CloudError`] when there are none.
pub fn keep(cloud: &mut PointCloud, kept: &[usize]) -> Result<(), CloudError> {
    *cloud = PointCloud::new(kept.iter().map(|&i| cloud.points()[i]).collect())?;
    Ok(())
}
