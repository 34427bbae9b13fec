//! [`CorruptionKind`]: the names of the corruptions.

use std::{fmt, str::FromStr};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The paper's twelve corruptions, in its order: density, noise, transformation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CorruptionKind {
    /// Clusters grow denser, as under repeated scanning.
    DensityInc,
    /// Clusters lose most of their points.
    DensityDec,
    /// Clusters are removed.
    Cutout,
    /// Uniform noise on every coordinate.
    Uniform,
    /// Gaussian noise on every coordinate.
    Gaussian,
    /// Clutter in the bounding cube.
    Background,
    /// Some points are displaced strongly.
    Impulse,
    /// New points appear near existing ones.
    Upsampling,
    /// A shear in the x-z plane.
    Shear,
    /// Free-form deformation.
    Distortion,
    /// Smooth warp by multiquadric radial basis functions.
    DistortionRbf,
    /// Smooth warp by inverse multiquadric radial basis functions.
    DistortionRbfInv,
}

/// A name that belongs to no corruption.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown corruption `{name}`: choose one of {}", CorruptionKind::ALL.map(CorruptionKind::name).join(", "))]
pub struct UnknownCorruption {
    /// The name that was given.
    pub name: String,
}

impl CorruptionKind {
    /// All corruptions in the paper's order.
    pub const ALL: [Self; 12] = [
        Self::DensityInc,
        Self::DensityDec,
        Self::Cutout,
        Self::Uniform,
        Self::Gaussian,
        Self::Background,
        Self::Impulse,
        Self::Upsampling,
        Self::Shear,
        Self::Distortion,
        Self::DistortionRbf,
        Self::DistortionRbfInv,
    ];

    /// The paper's name in snake case.
    pub fn name(self) -> &'static str {
        match self {
            Self::DensityInc => "density_inc",
            Self::DensityDec => "density_dec",
            Self::Cutout => "cutout",
            Self::Uniform => "uniform",
            Self::Gaussian => "gaussian",
            Self::Background => "background",
            Self::Impulse => "impulse",
            Self::Upsampling => "upsampling",
            Self::Shear => "shear",
            Self::Distortion => "distortion",
            Self::DistortionRbf => "distortion_rbf",
            Self::DistortionRbfInv => "distortion_rbf_inv",
        }
    }

    /// Whether ModelNet40-C ends this corruption with [`box_normalize`](crate::box_normalize). No
    /// corruption here does so itself; it is an option of pair synthesis.
    pub fn is_box_normalized(self) -> bool {
        match self {
            Self::DensityInc | Self::DensityDec | Self::Cutout | Self::Gaussian => false,
            Self::Uniform
            | Self::Background
            | Self::Impulse
            | Self::Upsampling
            | Self::Shear
            | Self::Distortion
            | Self::DistortionRbf
            | Self::DistortionRbfInv => true,
        }
    }
}

impl fmt::Display for CorruptionKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for CorruptionKind {
    type Err = UnknownCorruption;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|kind| kind.name() == name)
            .ok_or_else(|| UnknownCorruption { name: name.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_there_and_back() {
        for kind in CorruptionKind::ALL {
            assert_eq!(kind.name().parse(), Ok(kind));
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.name());
        }
        let error = "rain".parse::<CorruptionKind>().unwrap_err().to_string();
        assert!(error.contains("`rain`") && error.contains("density_inc, density_dec"), "{error}");
    }
}
