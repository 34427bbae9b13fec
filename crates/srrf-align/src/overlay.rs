//! [`Overlay`]: how two scans lie on each other.

use nalgebra::Matrix6;

/// How two scans lie on each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlay {
    /// Share of the source's points that lie on the target.
    pub overlap_source: f64,
    /// Share of the target's points that lie on the source.
    pub overlap_target: f64,
    /// The share of one scan's points that the other's scanner saw through, the larger of both; none where no place of a scanner is known.
    pub seen_through: Option<f64>,
    /// Root mean square distance of those, along the normals.
    pub rms: f64,
    /// Inverse covariance of a motion after the pose, in the target's frame about its centre; rotation first.
    pub information: Matrix6<f64>,
}

impl Overlay {
    /// Whether less is seen through, or as much and more lies on the other scan.
    pub fn is_better(&self, other: &Self) -> bool {
        let through = |o: &Self| o.seen_through.unwrap_or(0.0);
        let overlap = |o: &Self| o.overlap_source + o.overlap_target;
        let by_sight = through(self).total_cmp(&through(other));
        by_sight.then(overlap(other).total_cmp(&overlap(self))).is_lt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_better_of_two_poses_is_seen_through_less_then_overlaps_more() {
        let with = |through: f64, overlap: f64| Overlay {
            overlap_source: overlap,
            overlap_target: 0.4,
            seen_through: Some(through),
            rms: 0.01,
            information: Matrix6::identity(),
        };
        assert!(with(0.0, 0.5).is_better(&with(0.01, 0.9)));
        assert!(with(0.0, 0.6).is_better(&with(0.0, 0.5)) && !with(0.0, 0.5).is_better(&with(0.0, 0.5)));
    }
}
