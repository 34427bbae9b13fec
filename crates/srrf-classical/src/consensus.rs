//! [`Correspondences`] and what searches for a consensus among them share.

use std::cmp::Ordering;

use srrf_cloud::Rigid;

/// Matches between two clouds: point `i` of one is believed to be point `i` of the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Correspondences {
    source: Vec<[f64; 3]>,
    target: Vec<[f64; 3]>,
}

/// Why points are no matches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CorrespondencesError {
    /// Not as many of one cloud as of the other.
    #[error("{source_points} source points and {target_points} target points: matches need as many of both")]
    Lengths {
        /// Points of the source.
        source_points: usize,
        /// Points of the target.
        target_points: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("match number {0} (from 0) has a coordinate that is not finite")]
    NotFinite(usize),
}

impl Correspondences {
    /// Matches of `source` and `target`, shape `[n, 3]` each.
    ///
    /// # Errors
    /// [`CorrespondencesError`] for lists of different lengths, and for coordinates that are not finite.
    pub fn new(source: Vec<[f64; 3]>, target: Vec<[f64; 3]>) -> Result<Self, CorrespondencesError> {
        if source.len() != target.len() {
            let (source_points, target_points) = (source.len(), target.len());
            return Err(CorrespondencesError::Lengths { source_points, target_points });
        }
        let finite = |p: &[f64; 3]| p.iter().all(|c| c.is_finite());
        match source.iter().zip(&target).position(|(x, y)| !finite(x) || !finite(y)) {
            Some(number) => Err(CorrespondencesError::NotFinite(number)),
            None => Ok(Self { source, target }),
        }
    }

    /// Number of matches.
    pub fn len(&self) -> usize {
        self.source.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.source.is_empty()
    }

    /// Their source points, shape `[n, 3]`.
    pub fn source(&self) -> &[[f64; 3]] {
        &self.source
    }

    /// Their target points, shape `[n, 3]`.
    pub fn target(&self) -> &[[f64; 3]] {
        &self.target
    }
}

/// A pose and the matches that agree with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupportedPose {
    /// `target ~ R source + t`.
    pub target_from_source: Rigid,
    /// Matches that it puts within the distance.
    pub inliers: usize,
    /// Sum of their squared distances, to tell equals apart.
    pub squares: f64,
}

impl SupportedPose {
    /// Counts the matches that `pose` puts within `distance`.
    pub(crate) fn of(source: &[[f64; 3]], target: &[[f64; 3]], pose: Rigid, distance: f64) -> Self {
        let limit = distance * distance;
        let (mut inliers, mut squares) = (0, 0.0);
        for (x, y) in source.iter().zip(target) {
            let r = squared(&pose.apply(x), y);
            if r <= limit {
                inliers += 1;
                squares += r;
            }
        }
        Self { target_from_source: pose, inliers, squares }
    }

    /// Whether it has more support.
    pub(crate) fn beats(&self, other: &Self) -> bool {
        (self.inliers, -self.squares) > (other.inliers, -other.squares)
    }

    /// Best first.
    pub(crate) fn by_support(a: &Self, b: &Self) -> Ordering {
        b.inliers.cmp(&a.inliers).then(a.squares.total_cmp(&b.squares))
    }
}

/// Keeps the best `most` poses that differ by 10 degrees or 10 `distance`s.
pub(crate) fn keep_diverse(best: &mut Vec<SupportedPose>, new: SupportedPose, most: usize, distance: f64) {
    let alike = |a: &SupportedPose| {
        let (a, b) = (&a.target_from_source, &new.target_from_source);
        a.angle_to_deg(b) < 10.0 && (a.translation - b.translation).norm() < 10.0 * distance
    };
    if best.len() == most && best.last().is_some_and(|last| !new.beats(last)) {
        return;
    }
    if let Some(place) = best.iter().position(alike) {
        if !new.beats(&best[place]) {
            return;
        }
        best.remove(place);
    }
    let place = best.iter().position(|b| new.beats(b)).unwrap_or(best.len());
    best.insert(place, new);
    best.truncate(most);
}

/// `|a - b|^2`.
pub(crate) fn squared(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]) * (a[c] - b[c])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_must_fit_and_be_finite() {
        let error = Correspondences::new(vec![[0.0; 3]; 2], vec![[0.0; 3]; 3]).unwrap_err();
        assert_eq!(error, CorrespondencesError::Lengths { source_points: 2, target_points: 3 });
        let nan = Correspondences::new(vec![[0.0; 3]; 2], vec![[0.0; 3], [0.0, f64::NAN, 0.0]]);
        assert_eq!(nan, Err(CorrespondencesError::NotFinite(1)));
        let matches = Correspondences::new(vec![[1.0; 3]], vec![[2.0; 3]]).unwrap();
        assert_eq!((matches.len(), matches.source()[0], matches.target()[0]), (1, [1.0; 3], [2.0; 3]));
    }

    #[test]
    fn alike_poses_are_kept_once() {
        let at = |x: f64, inliers| SupportedPose {
            target_from_source: Rigid { translation: [x, 0.0, 0.0].into(), ..Rigid::identity() },
            inliers,
            squares: 0.0,
        };
        let mut best = Vec::new();
        for pose in [at(0.0, 5), at(0.5, 7), at(30.0, 6), at(60.0, 4), at(90.0, 3)] {
            keep_diverse(&mut best, pose, 3, 1.0);
        }
        assert_eq!(best, [at(0.5, 7), at(30.0, 6), at(60.0, 4)]);
    }
}
