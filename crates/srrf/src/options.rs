//! [`Options`]: what a user may want to change.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use srrf_refine::{Deformed, Ranking, RefineConfig};

use crate::probability::Probability;

/// The device that every build has.
pub(crate) const DEFAULT_DEVICE: &str = "flex";

/// How starts for the refinement are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The poses of the network, of FPFH with RANSAC, and the given one; the best supported wins.
    #[default]
    Auto,
    /// The poses of the network only.
    Srrf,
    /// FPFH features with RANSAC only.
    FpfhRansac,
    /// Iterative closest point from the given pose.
    Icp,
    /// The given pose only (the identity, if none is given), refined.
    Given,
}

impl Method {
    /// All methods, the default first.
    pub const ALL: [Self; 5] = [Self::Auto, Self::Srrf, Self::FpfhRansac, Self::Icp, Self::Given];

    /// Whether it looks for poses by features, without a first guess.
    pub(crate) fn looks_globally(self) -> bool {
        matches!(self, Self::Auto | Self::FpfhRansac)
    }

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Srrf => "srrf",
            Self::FpfhRansac => "fpfh-ransac",
            Self::Icp => "icp",
            Self::Given => "given",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// An option that makes no sense.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OptionsError {
    /// No method of that name.
    #[error("no method `{0}`; there are auto, srrf, fpfh-ransac, icp and given")]
    Method(String),
    /// No rotation range of that name.
    #[error("rotation `{0}`: use 45 (turned by less than that about each axis) or so3 (any rotation)")]
    Rotation(String),
}

impl FromStr for Method {
    type Err = OptionsError;

    fn from_str(name: &str) -> Result<Self, OptionsError> {
        Self::ALL.into_iter().find(|m| m.name() == name).ok_or_else(|| OptionsError::Method(name.to_owned()))
    }
}

/// How far the clouds may be turned against each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum RotationRange {
    /// By up to about 45 degrees about each axis, the range that the network was trained for. FPFH with RANSAC gives
    /// no start that is turned by more than 90 degrees against the given pose.
    #[serde(rename = "45")]
    Within45,
    /// By anything: the network also sees the source in the 24 orientations of a cube.
    #[default]
    #[serde(rename = "180")]
    Any,
}

impl FromStr for RotationRange {
    type Err = OptionsError;

    fn from_str(name: &str) -> Result<Self, OptionsError> {
        match name {
            "45" => Ok(Self::Within45),
            "180" => Ok(Self::Any),
            _ => Err(OptionsError::Rotation(name.to_owned())),
        }
    }
}

/// What a user may want to change. [`fmt::Display`] writes all of it on one line, for records of what an answer was made with.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Options {
    /// How starts are found. Default [`Method::Auto`].
    pub method: Method,
    /// How far the clouds may be turned. Default [`RotationRange::Any`].
    pub rotation: RotationRange,
    /// The refinement; `None` answers with the coarse pose. Default on.
    pub refine: Option<RefineConfig>,
    /// Weights: a file, or the name of a model in the program. Default `srrf`.
    pub weights: Option<String>,
    /// Device of the network. Default `flex`.
    pub device: String,
    /// Seed of the random samples of FPFH with RANSAC; nothing else draws. Default 0.
    pub seed: u64,
    /// Whether clouds that seem to be in different units of length are an error. Default on; switch it off for clouds that are
    /// known to share one.
    pub check_scale: bool,
    /// The verdict is to abstain where the probability is below this. Default 0.5.
    pub abstain_below: Probability,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            method: Method::Auto,
            rotation: RotationRange::Any,
            refine: Some(RefineConfig {
                ranking: Ranking::Planes,
                deformed: Deformed::Halfway,
                ..RefineConfig::default()
            }),
            weights: None,
            device: DEFAULT_DEVICE.to_owned(),
            seed: 0,
            check_scale: true,
            abstain_below: Probability::HALF,
        }
    }
}

/// One line of JSON that names every option; equal options give equal lines.
impl fmt::Display for Options {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&serde_json::to_string(self).map_err(|_| fmt::Error)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_option_is_in_the_line() {
        let options = Options::default();
        let line = options.to_string();
        assert_eq!(line, Options::default().to_string());
        let others = [
            Options { rotation: RotationRange::Within45, ..options.clone() },
            Options { seed: 1, ..options.clone() },
            Options { refine: None, ..options.clone() },
            Options { abstain_below: Probability::ZERO, ..options.clone() },
        ];
        assert!(others.iter().all(|other| other.to_string() != line), "{line}");
        assert!(line.contains("\"rotation\":\"180\"") && line.contains("\"soft_points\":4096"), "{line}");
    }

    #[test]
    fn names_come_back() {
        for method in Method::ALL {
            assert_eq!(method.name().parse(), Ok(method));
            assert_eq!(serde_json::to_value(method).unwrap(), method.name());
        }
        assert!("magic".parse::<Method>().unwrap_err().to_string().contains("fpfh-ransac"));
        assert_eq!("180".parse(), Ok(RotationRange::Any));
        assert!("90".parse::<RotationRange>().is_err());
    }
}
