//! Iterative closest point, point to plane.

use serde::{Deserialize, Serialize};
use srrf_cloud::{Register, RegisterError, Registration, Solid};

use crate::icp_loop::Scene;

/// Settings of [`IcpPlane`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IcpPlaneConfig {
    /// Largest number of iterations. Default 50, as for [`crate::Icp`]; Open3D's is 30.
    pub max_iterations: usize,
    /// Matches farther apart are left out, unit of the clouds. Default `None`.
    pub max_distance: Option<f64>,
    /// Neighbours of a normal. Default 20; Open3D's tutorial takes up to 30.
    pub normal_neighbours: usize,
    /// Stops when the source moves by less than this part of the target's radius. Default 1e-7.
    pub tolerance: f64,
}

impl Default for IcpPlaneConfig {
    fn default() -> Self {
        Self { max_iterations: 50, max_distance: None, normal_neighbours: 20, tolerance: 1e-7 }
    }
}

/// Iterative closest point on the planes of the target (Chen and Medioni 1992), from the identity.
/// A hundredth of the point-to-point distance keeps motions that planes leave open.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct IcpPlane {
    /// The settings.
    pub config: IcpPlaneConfig,
}

impl IcpPlane {
    /// The method with these settings.
    pub fn new(config: IcpPlaneConfig) -> Self {
        Self { config }
    }
}

impl Register for IcpPlane {
    fn name(&self) -> &str {
        "icp-plane"
    }

    fn register_solid(&self, source: Solid<'_>, target: Solid<'_>) -> Result<Registration, RegisterError> {
        let config = &self.config;
        let limit = config.max_distance.map_or(f64::INFINITY, |d| d * d);
        let scene = Scene::new(source, target, Some(config.normal_neighbours))?;
        scene.run(config.max_iterations, config.tolerance, |squared, _| {
            squared.iter().map(|r| if *r <= limit { 1.0 } else { 0.0 }).collect()
        })
    }
}
