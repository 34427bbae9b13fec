//! Global registration: FPFH, RANSAC, refinement.

use serde::{Deserialize, Serialize};
use srrf_cloud::{Register, RegisterError, Registration, Rigid, Solid};
use srrf_refine::{Deformed, RefineConfig, RefineTarget};

use crate::correspond::correspond;
use crate::fpfh_cloud::FpfhCloud;
use crate::graph_consensus::GraphConsensus;
use crate::ransac::RansacConsensus;

/// Settings of [`FpfhRansac`]. Lengths are in voxels, and the voxel follows from the clouds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FpfhRansacConfig {
    /// Clouds are thinned to at most so many points; the voxel is the point spacing or larger. Default
    /// 3,000. Open3D leaves the voxel to the user.
    pub points: usize,
    /// Radius of the features, in voxels. Default 5, as in Open3D's tutorial.
    pub feature_voxels: f64,
    /// Matches closer than this are inliers, in voxels. Default 1.5, as in Open3D's tutorial.
    pub distance_voxels: f64,
    /// Least ratio of an edge's lengths in the two clouds. Default 0.9, as in Open3D's tutorial.
    pub edge_similarity: f64,
    /// Most samples. Default 100,000, as in Open3D.
    pub max_iterations: usize,
    /// The search ends when a better consensus would have been found with this probability. Default
    /// 0.999, as in Open3D.
    pub confidence: f64,
    /// Poses handed to the refinement, which takes the best supported one. Default 4; Open3D's ICP gets one.
    pub hypotheses: usize,
    /// Seed of the samples. Default 0.
    pub seed: u64,
    /// The refinement, where Open3D's tutorial has point-to-plane ICP. Default on.
    pub refine: Option<RefineConfig>,
}

impl Default for FpfhRansacConfig {
    fn default() -> Self {
        Self {
            points: 3000,
            feature_voxels: 5.0,
            distance_voxels: 1.5,
            edge_similarity: 0.9,
            max_iterations: 100_000,
            confidence: 0.999,
            hypotheses: 4,
            seed: 0,
            refine: Some(RefineConfig { deformed: Deformed::Halfway, ..RefineConfig::default() }),
        }
    }
}

/// Matches of fast point feature histograms (Rusu et al. 2009), random sample consensus, then
/// refinement. Needs no start; the same clouds give the same answer with any number of threads.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FpfhRansac {
    /// The settings.
    pub config: FpfhRansacConfig,
}

impl FpfhRansac {
    /// The method with these settings.
    pub fn new(config: FpfhRansacConfig) -> Self {
        Self { config }
    }

    /// The poses on which most matches agree, best first, without refinement: at most
    /// [`FpfhRansacConfig::hypotheses`].
    ///
    /// # Errors
    /// [`RegisterError`] where fewer than three voxels hold points, and where no sample was consistent.
    pub fn hypotheses(
        &self,
        source: &FpfhCloud<'_>,
        target: &FpfhCloud<'_>,
    ) -> Result<Hypotheses, RegisterError> {
        let config = &self.config;
        let matches = correspond(source, target, config.points, config.feature_voxels, 30)?;
        let search = RansacConsensus {
            max_iterations: config.max_iterations,
            confidence: config.confidence,
            edge_similarity: config.edge_similarity,
            distance: config.distance_voxels * matches.voxel,
            keep: config.hypotheses.max(1),
            seed: config.seed,
        };
        let (found, drawn) = search.poses(&matches.correspondences(false)?);
        if found.is_empty() {
            return Err(RegisterError::NoPose(
                format!(
                    "none of {drawn} samples of {} matches was consistent; the clouds may not overlap, or \
                 `distance_voxels` is too small",
                    matches.pairs.len()
                )
                .into(),
            ));
        }
        Ok(Hypotheses { poses: found.iter().map(|p| p.target_from_source).collect(), drawn })
    }

    /// The poses on which most matches agree by [`GraphConsensus`], best first, without refinement: at most
    /// [`FpfhRansacConfig::hypotheses`]. It also looks at matches that hold in one direction only, of which few are right.
    ///
    /// # Errors
    /// As [`FpfhRansac::hypotheses`].
    pub fn graph_hypotheses(
        &self,
        source: &FpfhCloud<'_>,
        target: &FpfhCloud<'_>,
    ) -> Result<Hypotheses, RegisterError> {
        let config = &self.config;
        let matches = correspond(source, target, config.points, config.feature_voxels, 30)?;
        let search = GraphConsensus {
            distance: config.distance_voxels * matches.voxel,
            keep: config.hypotheses.max(1),
            ..GraphConsensus::default()
        };
        let all = matches.correspondences(true)?;
        let found = search.poses(&all);
        if found.is_empty() {
            return Err(RegisterError::NoPose(format!("no three of {} matches agree", all.len()).into()));
        }
        Ok(Hypotheses { poses: found.iter().map(|p| p.target_from_source).collect(), drawn: 0 })
    }
}

/// What [`FpfhRansac::hypotheses`] found.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypotheses {
    /// Poses that map the source onto the target, best first; at least one.
    pub poses: Vec<Rigid>,
    /// Samples drawn.
    pub drawn: usize,
}

impl Register for FpfhRansac {
    fn name(&self) -> &str {
        "fpfh-ransac"
    }

    fn register_solid(&self, source: Solid<'_>, target: Solid<'_>) -> Result<Registration, RegisterError> {
        let (source_ready, target_ready) = FpfhCloud::pair(source, target)?;
        let found = self.hypotheses(&source_ready, &target_ready)?;
        let Some(config) = &self.config.refine else {
            return Ok(Registration { iterations: found.drawn, ..Registration::from_pose(found.poses[0]) });
        };
        let refined = RefineTarget::new(target, config)?.refine(source, &found.poses)?;
        Ok(Registration {
            converged: refined.converged,
            iterations: found.drawn + refined.iterations,
            ..Registration::from_pose(refined.target_from_source)
        })
    }
}
