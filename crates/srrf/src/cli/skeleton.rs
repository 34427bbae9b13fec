//! `srrf skeleton`: the skeleton of a cloud as a PLY file.

use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use srrf::Skeleton;

use super::Common;
use super::failure::Failure;
use super::files;
use super::register::{failed, warning};
use super::say::{Voice, count};

/// Write the skeleton that the network sees in a cloud: centres and radii of spheres along its middle.
///
/// The PLY file has the properties x, y, z and radius, in the unit of the cloud.
#[derive(Debug, Args)]
pub struct SkeletonArgs {
    /// The cloud, or `-`
    input: PathBuf,

    /// The PLY file to write, or `-`
    output: PathBuf,

    /// Weights of the network: a file, or a name that `srrf weights` lists [default: srrf]
    #[arg(long, value_name = "NAME|FILE")]
    weights: Option<String>,

    /// Where the network runs
    #[arg(long, value_name = "NAME", default_value = "flex")]
    device: String,

    #[command(flatten)]
    common: Common,
}

/// Extracts.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn run(args: &SkeletonArgs) -> Result<ExitCode, Failure> {
    files::check_output(&args.output)?;
    args.common.start_threads()?;
    let input = files::read_solid(&args.input, None)?;
    let skeleton = srrf::skeleton(&input.cloud, args.weights.as_deref(), &args.device)
        .map_err(|e| failed(&e, &input.name, &input.name))?;
    files::write(&args.output, to_ply(&skeleton).as_bytes())?;
    let voice = Voice::new(args.common.quiet, files::is_stream(&args.output));
    voice.say(&format!(
        "wrote {}: {} spheres of {}, by {}",
        args.output.display(),
        count(skeleton.points.len()),
        input.name,
        skeleton.weights
    ));
    if let Some(warning) = warning(&input.name, input.dropped) {
        voice.say(&format!("warning: {warning}"));
    }
    Ok(ExitCode::SUCCESS)
}

/// PLY, ASCII; numbers read back as the same bits.
fn to_ply(skeleton: &Skeleton) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\ncomment skeleton by {}\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nproperty double radius\nend_header\n",
        skeleton.weights.replace(['\n', '\r'], " "),
        skeleton.points.len()
    );
    for ([x, y, z], radius) in skeleton.points.iter().zip(&skeleton.radii) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{x} {y} {z} {radius}");
    }
    text
}
