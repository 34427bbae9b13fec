//! [`PairConfig`]: the switches of pair synthesis.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::variants::{InvalidVariant, Variants};

/// Which cloud of a pair is corrupted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Corrupt {
    /// Both, with independent draws (the paper's figure 1).
    #[default]
    Both,
    /// Only the source.
    Source,
    /// Only the target.
    Target,
}

/// Where the points of source and target come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// Both from the same points of the shape, as in DCP.
    #[default]
    Shared,
    /// Each from points of its own: two samplings of a surface, or two disjoint parts of a stored
    /// cloud (half of it each at most). Harder, and closer to two scans.
    Independent,
}

/// Whether corrupted clouds are scaled to a box of side 2, as ModelNet40-C does after uniform,
/// impulse, upsampling, background, shear and the three distortions (and only after those).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Normalize {
    /// Never. The pose stays exact and the scale stays 1.
    #[default]
    None,
    /// After corrupting, before posing: source and target differ in scale and offset by what
    /// their corruptions do to their boxes, so that no pose fits exactly.
    Canonical,
    /// After posing, which may be what the paper did: the translation is erased and cannot be
    /// found by any method. Score the rotation only.
    AfterPose,
}

/// From which rotations the pose is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum RotationRange {
    /// `R = Rx(a) Ry(b) Rz(c)` with each angle uniform in `[0, max_deg)`, as in DCP.
    EulerAxes {
        /// Upper end of each angle, in degrees.
        #[schemars(range(min = 0.0, max = 360.0))]
        max_deg: f64,
    },
    /// Uniform over all rotations.
    So3,
}

/// How pairs are made. The default is the protocol of our tables: DCP's poses and sampling, both
/// clouds corrupted independently, no normalisation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PairConfig {
    /// Which cloud is corrupted. Default: both.
    pub corrupt: Corrupt,
    /// Where the points come from. Default: shared.
    pub sampling: Sampling,
    /// Box normalisation. Default: none.
    pub normalize: Normalize,
    /// Rotations. Default: 45 degrees by Euler axis (DCP).
    pub rotation: RotationRange,
    /// Each coordinate of the translation is uniform in plus and minus this, canonical unit.
    /// Default: 0.5 (DCP).
    #[schemars(range(min = 0.0, max = 1e6))]
    pub translation: f64,
    /// Points of source and target; corrupted clouds are resampled to so many. Default: 1024
    /// (DCP).
    #[schemars(range(min = 3, max = 1000000))]
    pub points: usize,
    /// Whether pairs say which base point each point is (needed by the oracle). Default: true.
    pub keep_correspondence: bool,
    /// Readings of the corruptions. Default: the paper's text.
    pub variants: Variants,
}

impl Default for PairConfig {
    fn default() -> Self {
        Self {
            corrupt: Corrupt::Both,
            sampling: Sampling::Shared,
            normalize: Normalize::None,
            rotation: RotationRange::EulerAxes { max_deg: 45.0 },
            translation: 0.5,
            points: 1024,
            keep_correspondence: true,
            variants: Variants::paper(),
        }
    }
}

/// Most points of a cloud of a pair.
const MOST_POINTS: usize = 1_000_000;

/// Why a [`PairConfig`] makes no sense.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidConfig {
    /// A pair needs points, and no end of memory is asked for.
    #[error("`points` is {0}: a pair needs at least 3 points in each cloud, and has at most {MOST_POINTS}")]
    Points(usize),
    /// The range of angles is not one.
    #[error("`max_deg` is {0}: it must be between 0 and 360 degrees")]
    MaxDeg(f64),
    /// The range of translations is not one.
    #[error("`translation` is {0}: it must be a finite number, 0 or more")]
    Translation(f64),
    /// A length of the variants is not one.
    #[error("`variants`: {0}")]
    Variants(#[from] InvalidVariant),
}

impl PairConfig {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`InvalidConfig`] names the first bad one.
    pub fn validate(&self) -> Result<(), InvalidConfig> {
        if !(3..=MOST_POINTS).contains(&self.points) {
            return Err(InvalidConfig::Points(self.points));
        }
        if let RotationRange::EulerAxes { max_deg } = self.rotation
            && !(0.0..=360.0).contains(&max_deg)
        {
            return Err(InvalidConfig::MaxDeg(max_deg));
        }
        if !self.translation.is_finite() || self.translation < 0.0 {
            return Err(InvalidConfig::Translation(self.translation));
        }
        Ok(self.variants.validate()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_it_writes_and_nothing_else() {
        let config = PairConfig { sampling: Sampling::Independent, ..PairConfig::default() };
        let text = serde_json::to_string(&config).unwrap();
        assert_eq!(serde_json::from_str::<PairConfig>(&text).unwrap(), config);
        assert_eq!(
            serde_json::from_str::<PairConfig>(r#"{"normalize": "after_pose", "rotation": "so3"}"#).unwrap(),
            PairConfig {
                normalize: Normalize::AfterPose,
                rotation: RotationRange::So3,
                ..PairConfig::default()
            }
        );
        assert!(serde_json::from_str::<PairConfig>(r#"{"normalise": "none"}"#).is_err());
        assert!(
            serde_json::from_str::<PairConfig>(r#"{"rotation": {"euler_axes": {"max": 45.0}}}"#).is_err()
        );
    }

    #[test]
    fn numbers_are_checked() {
        let with = |change: fn(&mut PairConfig)| {
            let mut config = PairConfig::default();
            change(&mut config);
            config.validate()
        };
        assert_eq!(with(|_| {}), Ok(()));
        assert_eq!(with(|c| c.points = 2), Err(InvalidConfig::Points(2)));
        assert_eq!(with(|c| c.points = MOST_POINTS), Ok(()));
        assert_eq!(with(|c| c.points = 1_000_001), Err(InvalidConfig::Points(1_000_001)));
        assert_eq!(with(|c| c.translation = -1.0), Err(InvalidConfig::Translation(-1.0)));
        assert!(with(|c| c.rotation = RotationRange::EulerAxes { max_deg: f64::NAN }).is_err());
        assert!(with(|c| c.variants.impulse_linf = -0.1).is_err());
    }
}
