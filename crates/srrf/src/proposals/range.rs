//! [`in_range`]: the poses that a range of rotations leaves.

use srrf_cloud::{RegisterError, Rigid};

use crate::options::RotationRange;

/// With [`RotationRange::Within45`], poses that are turned by more than this against the first guess are no starts: 45 degrees
/// about each of three axes come to 86 at most.
const WITHIN_DEG: f64 = 90.0;

/// Those of `poses` whose turn against the first guess is in the range.
pub(super) fn in_range(
    range: RotationRange,
    poses: Vec<Rigid>,
    given: &Rigid,
) -> Result<Vec<Rigid>, RegisterError> {
    match range {
        RotationRange::Any => Ok(poses),
        RotationRange::Within45 => within(poses, given),
    }
}

/// The poses that are turned by at most [`WITHIN_DEG`] against the first guess.
fn within(poses: Vec<Rigid>, given: &Rigid) -> Result<Vec<Rigid>, RegisterError> {
    let count = poses.len();
    let kept: Vec<Rigid> = poses.into_iter().filter(|p| p.angle_to_deg(given) <= WITHIN_DEG).collect();
    if kept.is_empty() {
        return Err(RegisterError::NoPose(format!(
            "each of {count} poses is turned by more than {WITHIN_DEG} degrees against the given one; the rotation range \
             45 excludes them, 180 does not"
        ).into()));
    }
    Ok(kept)
}

#[cfg(test)]
mod tests {
    use srrf_cloud::EulerXyz;

    use super::*;

    #[test]
    fn poses_beyond_the_range_are_left_out_and_none_left_is_an_error() {
        let about_z = |degrees| Rigid {
            rotation: EulerXyz::from_deg([0.0, 0.0, degrees]).to_matrix(),
            ..Rigid::identity()
        };
        let given = about_z(30.0);
        let poses = vec![about_z(160.0), about_z(119.0), about_z(-59.0), about_z(-61.0)];
        assert_eq!(within(poses, &given).unwrap(), [about_z(119.0), about_z(-59.0)]);
        let said = within(vec![about_z(160.0), about_z(-61.0)], &given).unwrap_err().to_string();
        assert!(said.contains("each of 2 poses") && said.contains("180"), "{said}");
    }
}
