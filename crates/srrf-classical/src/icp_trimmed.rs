//! Trimmed iterative closest point.

use serde::{Deserialize, Serialize};
use srrf_cloud::{Register, RegisterError, Registration, Solid};

use crate::icp_loop::Scene;

/// Settings of [`IcpTrimmed`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IcpTrimmedConfig {
    /// Share of the matches that are kept, the nearest ones. Default 0.8: clutter and holes of the
    /// strongest severity touch up to a third of the points.
    pub keep: f64,
    /// Iterations over which the share falls from 1 to `keep`. Default 20: trimming from the first iteration
    /// on keeps what happens to lie near, and halves the range of motions that are found.
    pub settle: usize,
    /// Largest number of iterations. Default 50, as for [`crate::Icp`].
    pub max_iterations: usize,
    /// Stops when the source moves by less than this part of the target's radius. Default 1e-7.
    pub tolerance: f64,
}

impl Default for IcpTrimmedConfig {
    fn default() -> Self {
        Self { keep: 0.8, settle: 20, max_iterations: 50, tolerance: 1e-7 }
    }
}

/// Iterative closest point, point to point, on the nearest matches only (Chetverikov et al. 2002), from
/// the identity.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct IcpTrimmed {
    /// The settings.
    pub config: IcpTrimmedConfig,
}

impl IcpTrimmed {
    /// The method with these settings.
    pub fn new(config: IcpTrimmedConfig) -> Self {
        Self { config }
    }
}

impl Register for IcpTrimmed {
    fn name(&self) -> &str {
        "icp-trimmed"
    }

    fn register_solid(&self, source: Solid<'_>, target: Solid<'_>) -> Result<Registration, RegisterError> {
        let config = &self.config;
        let scene = Scene::new(source, target, None)?;
        scene.run(config.max_iterations, config.tolerance, |squared, iteration| {
            let settled = (iteration as f64 / config.settle.max(1) as f64).min(1.0);
            let share = 1.0 - (1.0 - config.keep) * settled;
            let kept = ((share * squared.len() as f64).ceil() as usize).clamp(1, squared.len());
            let mut sorted = squared.to_vec();
            let limit = *sorted.select_nth_unstable_by(kept - 1, f64::total_cmp).1;
            squared.iter().map(|r| if *r <= limit { 1.0 } else { 0.0 }).collect()
        })
    }
}
