//! The seam [`Corruption`], and the registry of the twelve.

use rand::rngs::ChaCha8Rng;
use srrf_cloud::CloudError;

use crate::corruptions::{
    Background, Cutout, DensityDec, DensityIncrease, Distortion, DistortionRbf, Gaussian, Impulse, Shear,
    Uniform, Upsampling,
};
use crate::{CorruptionKind, Severity, Variants};

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
    pub(crate) fn subset(points: &[[f64; 3]], kept: &[u32]) -> Self {
        Self {
            points: kept.iter().map(|&i| points[i as usize]).collect(),
            origin: kept.iter().map(|&i| Some(i)).collect(),
        }
    }

    /// All input points unmoved, and `added` after them.
    pub(crate) fn extended(points: &[[f64; 3]], added: impl IntoIterator<Item = [f64; 3]>) -> Self {
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
pub trait Corruption: Send + Sync {
    /// The name in tables, in snake case.
    fn name(&self) -> &'static str;

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

/// The corruption of this name, in the readings that `variants` chooses.
pub fn corruption(kind: CorruptionKind, variants: &Variants) -> Box<dyn Corruption> {
    match kind {
        CorruptionKind::DensityInc => Box::new(DensityIncrease::new(variants)),
        CorruptionKind::DensityDec => Box::new(DensityDec),
        CorruptionKind::Cutout => Box::new(Cutout),
        CorruptionKind::Uniform => Box::new(Uniform),
        CorruptionKind::Gaussian => Box::new(Gaussian),
        CorruptionKind::Background => Box::new(Background),
        CorruptionKind::Impulse => Box::new(Impulse { linf: variants.impulse_linf }),
        CorruptionKind::Upsampling => Box::new(Upsampling { linf: variants.upsampling_linf }),
        CorruptionKind::Shear => Box::new(Shear),
        CorruptionKind::Distortion => Box::new(Distortion),
        CorruptionKind::DistortionRbf => Box::new(DistortionRbf::Multiquadric),
        CorruptionKind::DistortionRbfInv => Box::new(DistortionRbf::InverseMultiquadric),
    }
}

/// Checks what every corruption needs.
pub(crate) fn check(points: &[[f64; 3]], corruption: &'static str, need: usize) -> Result<(), CorruptError> {
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
