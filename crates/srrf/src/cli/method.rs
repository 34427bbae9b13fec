//! The options of a registration, shared by the verbs that register.

use clap::Args;
use srrf::{Method, Options, OptionsError, RotationRange};
use srrf_args::flags::{Device, Seed, Weights, help, value};

/// How to register.
#[derive(Debug, Clone, Args)]
pub struct MethodArgs {
    /// How starts are found: `auto` (all of them), `srrf` (the network), `fpfh-ransac`, `icp`, `given` (only the
    /// first guess)
    #[arg(long, value_name = "NAME", default_value_t = Method::Auto)]
    pub method: Method,

    #[arg(
        long,
        value_name = value::ROTATION,
        default_value = "so3",
        value_parser = rotation,
        help = help::ROTATION,
        long_help = format!("{}\n\nHere 45 (by less than that about each axis) or so3 (180 means the same)", help::ROTATION)
    )]
    pub rotation: RotationRange,

    /// Answer with the coarse pose
    #[arg(long)]
    pub no_refine: bool,

    #[command(flatten)]
    pub weights: Weights,

    #[command(flatten)]
    pub device: Device,

    #[command(flatten)]
    pub seed: Seed,
}

/// A range of rotations by its name.
fn rotation(name: &str) -> Result<RotationRange, OptionsError> {
    if name == "so3" { Ok(RotationRange::Any) } else { name.parse() }
}

impl MethodArgs {
    /// The library's options.
    pub fn options(&self) -> Options {
        let mut options = Options {
            method: self.method,
            rotation: self.rotation,
            weights: self.weights.weights.clone(),
            device: self.device.device.clone(),
            seed: self.seed.seed,
            ..Options::default()
        };
        if self.no_refine {
            options.refine = None;
        }
        options
    }
}
