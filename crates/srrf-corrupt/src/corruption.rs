//! The seam [`Corruption`].

use rand::rngs::ChaCha8Rng;
use srrf_cloud::CloudError;

use crate::severity::Severity;

/// A corrupted cloud that remembers where its points come from.
#[derive(Debug, Clone, PartialEq)]
pub struct Corrupted {
    /// The points, shape `[m, 3]`, canonical frame.
    pub points: Vec<[f64; 3]>,
    /// Length `m`: the index of the input point that this point is, possibly moved; `None` for
    /// points that were added.
    pub origin: Vec<Option<u32>>,
}

impl Corrupted {
    /// Every input point is still there, in its place in the list.
    pub fn moved(points: Vec<[f64; 3]>) -> Self {
        let origin = (0..points.len() as u32).map(Some).collect();
        Self { points, origin }
    }

    /// The input points whose indices are in `kept`, unmoved.
    /// Indices beyond the cloud name no point and are left out.
    pub fn subset(points: &[[f64; 3]], kept: &[u32]) -> Self {
        let (points, origin) = kept.iter().filter_map(|&i| Some((*points.get(i as usize)?, Some(i)))).unzip();
        Self { points, origin }
    }

    /// All input points unmoved, and `added` after them.
    pub fn extended(points: &[[f64; 3]], added: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let mut extended = Self::moved(points.to_vec());
        extended.points.extend(added);
        extended.origin.resize(extended.points.len(), None);
        extended
    }
}

/// Why a cloud could not be corrupted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CorruptError {
    /// The cloud is empty or has a coordinate that is not finite.
    #[error("{0}")]
    Cloud(#[from] CloudError),
    /// The corruption is not defined for so few points.
    #[error("{corruption} needs at least {need} points, the cloud has {have}")]
    TooFew {
        /// Name of the corruption.
        corruption: &'static str,
        /// Number of points there are.
        have: usize,
        /// Number of points needed.
        need: usize,
    },
    /// The cloud has more points than an index of 32 bits can name.
    #[error("the cloud has {0} points, at most {max} can be corrupted", max = u32::MAX)]
    TooMany(usize),
    /// A deformation cannot be computed.
    #[error("the interpolation system of the {0} kernel has no unique solution")]
    Singular(&'static str),
}

/// One way in which a cloud goes wrong.
///
/// The input is expected in the canonical frame (centred, radius 1); other clouds are corrupted
/// with the same absolute lengths. No corruption normalises its result.
///
/// A type outside this crate that implements it is corrupted with as any other, by
/// [`PairSynthesizer::pair_with`](crate::PairSynthesizer::pair_with).
pub trait Corruption: Send + Sync {
    /// The name in tables, in snake case.
    fn name(&self) -> &'static str;

    /// Points that a clean cloud should have for `points` corrupted ones; as many, unless the corruption is
    /// stated for another number.
    fn clean_points(&self, points: usize) -> usize {
        points
    }

    /// Whether ModelNet40-C ends this corruption with [`box_normalize`](crate::box_normalize). No corruption
    /// does so itself; it is an option of pair synthesis.
    fn is_box_normalized(&self) -> bool {
        false
    }

    /// Corrupts `points` (shape `[n, 3]`). The same generator state gives the same result.
    ///
    /// # Errors
    /// [`CorruptError`] for an empty cloud, coordinates that are not finite, or too few points.
    fn apply(
        &self,
        points: &[[f64; 3]],
        severity: Severity,
        rng: &mut ChaCha8Rng,
    ) -> Result<Corrupted, CorruptError>;
}

/// Checks what every corruption needs: points, finite coordinates, and at least `need` of them.
///
/// # Errors
/// [`CorruptError`] names `corruption` where there are too few.
pub fn check_points(points: &[[f64; 3]], corruption: &'static str, need: usize) -> Result<(), CorruptError> {
    if points.is_empty() {
        return Err(CloudError::Empty.into());
    }
    if u32::try_from(points.len()).is_err() {
        return Err(CorruptError::TooMany(points.len()));
    }
    if let Some(index) = points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        return Err(CloudError::NotFinite { index, point: points[index] }.into());
    }
    if points.len() < need {
        return Err(CorruptError::TooFew { corruption, have: points.len(), need });
    }
    Ok(())
}
