//! Iterative closest point with a robust kernel.

use serde::{Deserialize, Serialize};
use srrf_cloud::{Register, RegisterError, Registration, Solid};

use crate::icp_loop::Scene;

/// Settings of [`IcpRobust`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IcpRobustConfig {
    /// Scale of the kernel in medians of the residuals, renewed at each iteration. Default 3, which
    /// leaves Gaussian residuals nearly untouched.
    pub medians: f64,
    /// Least scale, in point spacings. Default 0.5.
    pub least_spacings: f64,
    /// Largest number of iterations. Default 50, as for [`crate::Icp`].
    pub max_iterations: usize,
    /// Neighbours of a normal; `None` for point to point. Default 20.
    pub normal_neighbours: Option<usize>,
    /// Stops when the source moves by less than this part of the target's radius. Default 1e-7.
    pub tolerance: f64,
}

impl Default for IcpRobustConfig {
    fn default() -> Self {
        Self {
            medians: 3.0,
            least_spacings: 0.5,
            max_iterations: 50,
            normal_neighbours: Some(20),
            tolerance: 1e-7,
        }
    }
}

/// Iterative closest point, point to plane, under the Geman-McClure kernel of KISS-ICP (Vizzo et al.
/// 2023) with a scale that follows the residuals, from the identity.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct IcpRobust {
    /// The settings.
    pub config: IcpRobustConfig,
}

impl IcpRobust {
    /// The method with these settings.
    pub fn new(config: IcpRobustConfig) -> Self {
        Self { config }
    }
}

impl Register for IcpRobust {
    fn name(&self) -> &str {
        "icp-robust"
    }

    fn register_solid(&self, source: Solid<'_>, target: Solid<'_>) -> Result<Registration, RegisterError> {
        let config = &self.config;
        let scene = Scene::new(source, target, config.normal_neighbours)?;
        let least = (config.least_spacings * scene.spacing).max(f64::MIN_POSITIVE);
        scene.run(config.max_iterations, config.tolerance, |squared, _| {
            let mut sorted = squared.to_vec();
            let median = sorted.select_nth_unstable_by(squared.len() / 2, f64::total_cmp).1.sqrt();
            let scale = (config.medians * median).max(least).powi(2);
            squared.iter().map(|r| (scale / (scale + r)).powi(2)).collect()
        })
    }
}
