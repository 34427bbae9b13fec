//! [`RefineConfig`] and what can be wrong.

use serde::{Deserialize, Serialize};
use srrf_cloud::{CloudError, RegisterError};

/// What a match is asked to bring to zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Metric {
    /// The distance of the two points (Besl and McKay 1992).
    PointToPoint,
    /// The distance along the normal (Chen and Medioni 1992), with a hundredth of the distance itself.
    PointToPlane,
    /// The distance along the normal, with a tenth of the distance itself: nearly the convergence
    /// of point to plane, and points that are in both clouds still lock.
    #[default]
    Both,
}

impl Metric {
    /// The weights `(a, b)` of the metric `a I + b n n^T`.
    pub(crate) fn weights(self) -> (f64, f64) {
        match self {
            Self::PointToPoint => (1.0, 0.0),
            Self::PointToPlane => (0.01, 1.0),
            Self::Both => (0.1, 1.0),
        }
    }
}

/// What to answer where the clouds look deformed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Deformed {
    /// The first start, as it was given: never worse than a learned method that is named first, which knows shapes. So a pair that
    /// an affine map fits better than the refined pose ([`crate::AffineFit`]) counts as deformed, too, most of all where that pose is
    /// turned by more than 20 degrees away from its start, unless half of the matches coincide.
    #[default]
    Start,
    /// Halfway from the first start that agrees with the best supported one to where point to point leads, for starts that know no
    /// shapes and may be far off.
    Halfway,
}

/// What starts are compared by, after their short runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ranking {
    /// Distances between points ([`crate::StartSupport::support`]): for starts that are close to each other.
    #[default]
    Points,
    /// Distances along the normals: for many starts from anywhere. On two samplings of one mesh it finds the right one of some
    /// hundred starts in 2 to 3 of 100 pairs more.
    Planes,
}

/// Settings of the refinement. Lengths are relative to the clouds, so that the defaults serve
/// objects and streets alike. The defaults were chosen on training shapes of ModelNet40 with the
/// program `tune` in `lab`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RefineConfig {
    /// What matches minimise. Default: both; on rigid rows it had no failures where point to
    /// point had 1 to 2 in 100.
    pub metric: Metric,
    /// First scale of the kernel, in median residuals of the start. Default 2; kept within 2 point
    /// spacings and a quarter of the cloud's radius (root mean square).
    pub start_residuals: f64,
    /// Last scale of the kernel, in point spacings. Default 0.5: smaller ones lose pairs on rows
    /// with noise, larger ones feel the edges of holes.
    pub end_spacings: f64,
    /// Factor of the scale at each iteration. Default 0.8.
    pub shrink: f64,
    /// Most iterations of the robust stage. Default 25: seven to shrink, the rest to settle.
    pub max_iterations: usize,
    /// Iterations that each start gets when there are several. Default 6.
    pub start_iterations: usize,
    /// What starts are compared by then. Default: points.
    pub ranking: Ranking,
    /// The run ends when a step moves the cloud by less than this, in radii. Default 1e-6.
    pub tolerance: f64,
    /// Neighbours of a normal. Default 20: averages over the noise of severity 5 at 1,024 points.
    pub normal_neighbours: usize,
    /// Clouds with more points than this are first refined on about so many voxel centroids.
    /// Default 2,048.
    pub coarse_points: usize,
    /// Clouds with more points than this end on about so many voxel centroids. Default 20,000:
    /// the pose of 35,000 points changes by less than its uncertainty.
    pub max_points: usize,
    /// Whether to end with soft matches (expectation maximisation). Default true. On two samplings with
    /// noise on the same points it halves the error of nearest neighbours.
    pub soft: bool,
    /// Clouds with more points than this skip the soft stage. Default 4,096: at that density nearest
    /// neighbours on planes are as exact, and faster.
    pub soft_points: usize,
    /// Whether to look for deformation, which makes exact alignment worthless ([`crate::Verdict::Deformed`]).
    /// Default true; clouds of more than `coarse_points` are exempt. Switch it off for small clouds that are known to
    /// be rigid: of two sparse samplings of one shape it takes 2 in 100 for deformed, of small crops and single views up to one
    /// in eight.
    pub check_deformation: bool,
    /// What to answer then. Default: the first start.
    pub deformed: Deformed,
}

impl Default for RefineConfig {
    fn default() -> Self {
        Self {
            metric: Metric::Both,
            start_residuals: 2.0,
            end_spacings: 0.5,
            shrink: 0.8,
            max_iterations: 25,
            start_iterations: 6,
            ranking: Ranking::Points,
            tolerance: 1e-6,
            normal_neighbours: 20,
            coarse_points: 2048,
            max_points: 20_000,
            soft: true,
            soft_points: 4096,
            check_deformation: true,
            deformed: Deformed::Start,
        }
    }
}

/// Why poses could not be refined.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RefineError {
    /// The source cloud cannot be used.
    #[error("source: {0}")]
    Source(#[source] CloudError),
    /// The target cloud cannot be used.
    #[error("target: {0}")]
    Target(#[source] CloudError),
    /// A setting makes no sense.
    #[error("`{field}` is {value}: it must be {need}")]
    Config {
        /// The field of [`RefineConfig`].
        field: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        need: &'static str,
    },
    /// There is no start.
    #[error("no start was given: pass at least one pose, such as the identity")]
    NoStart,
    /// A start holds NaN or infinity: its number, from 0.
    #[error("start number {0} (from 0) has numbers that are not finite")]
    Start(usize),
}

impl From<RefineError> for RegisterError {
    fn from(error: RefineError) -> Self {
        match error {
            RefineError::Source(e) => Self::Source(e),
            RefineError::Target(e) => Self::Target(e),
            other => Self::NoPose(Box::new(other)),
        }
    }
}

impl RefineConfig {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`RefineError::Config`] names the first bad one.
    pub fn validate(&self) -> Result<(), RefineError> {
        let above_zero = [
            ("start_residuals", self.start_residuals),
            ("end_spacings", self.end_spacings),
            ("tolerance", self.tolerance),
        ];
        for (field, value) in above_zero {
            if !value.is_finite() || value <= 0.0 {
                return Err(RefineError::Config { field, value, need: "a finite number above 0" });
            }
        }
        if !(0.05..=0.99).contains(&self.shrink) {
            return Err(RefineError::Config {
                field: "shrink",
                value: self.shrink,
                need: "between 0.05 and 0.99",
            });
        }
        let counts = [
            ("max_iterations", self.max_iterations, 1, "at least 1"),
            ("start_iterations", self.start_iterations, 1, "at least 1"),
            ("coarse_points", self.coarse_points, 64, "at least 64"),
            ("max_points", self.max_points, 64, "at least 64"),
        ];
        for (field, value, least, need) in counts {
            if value < least {
                return Err(RefineError::Config { field, value: value as f64, need });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_it_writes_and_nothing_else() {
        let config = RefineConfig { metric: Metric::PointToPoint, ..RefineConfig::default() };
        let text = serde_json::to_string(&config).unwrap();
        assert_eq!(serde_json::from_str::<RefineConfig>(&text).unwrap(), config);
        assert_eq!(serde_json::from_str::<RefineConfig>("{}").unwrap(), RefineConfig::default());
        assert!(serde_json::from_str::<RefineConfig>(r#"{"iterations": 3}"#).is_err());
    }

    #[test]
    fn numbers_are_checked() {
        assert_eq!(RefineConfig::default().validate(), Ok(()));
        let bad = |config: RefineConfig| config.validate().unwrap_err().to_string();
        assert!(bad(RefineConfig { shrink: 1.0, ..Default::default() }).contains("`shrink` is 1"));
        assert!(bad(RefineConfig { end_spacings: f64::NAN, ..Default::default() }).contains("end_spacings"));
        assert!(bad(RefineConfig { max_iterations: 0, ..Default::default() }).contains("at least 1"));
    }
}
