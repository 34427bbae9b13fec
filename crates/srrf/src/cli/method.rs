//! The options of a registration, shared by the verbs that register.

use clap::Args;
use srrf::{Method, Options, RotationRange};

/// How to register.
#[derive(Debug, Clone, Args)]
pub struct MethodArgs {
    /// How starts are found: `auto` (all of them), `srrf` (the network), `fpfh-ransac`, `icp`, `given` (only the
    /// first guess)
    #[arg(long, value_name = "NAME", default_value_t = Method::Auto)]
    pub method: Method,

    /// How far the clouds may be turned: 45 (by less than that) or 180 (by anything)
    #[arg(long, value_name = "DEGREES", default_value = "180")]
    pub rotation: RotationRange,

    /// Answer with the coarse pose
    #[arg(long)]
    pub no_refine: bool,

    /// Weights of the network: a file, or a name that `srrf weights` lists [default: srrf]
    #[arg(long, value_name = "NAME|FILE")]
    pub weights: Option<String>,

    /// Where the network runs: `flex` (CPU), and `ndarray`, `wgpu`, `vulkan`, `cuda`, `libtorch` where built in
    #[arg(long, value_name = "NAME", default_value = "flex")]
    pub device: String,

    /// Seed of the random samples. The same seed gives the same answer
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
}

impl MethodArgs {
    /// The library's options.
    pub fn options(&self) -> Options {
        let mut options = Options {
            method: self.method,
            rotation: self.rotation,
            weights: self.weights.clone(),
            device: self.device.clone(),
            seed: self.seed,
            ..Options::default()
        };
        if self.no_refine {
            options.refine = None;
        }
        options
    }
}
