//! `srrf skeleton`: the skeleton of a cloud as a PLY file.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use srrf::FoundSkeleton;

use super::common::{failed, warnings_of};
use srrf_args::flags::{Common, Device, Weights, value};
use srrf_args::reading::ReadFlags;
use srrf_args::surface::SurfaceFlag;
use srrf_args::words::count;
use srrf_args::{Failure, Output, OutputKind, Places, files};

/// Write the skeleton that the network sees in a cloud: centres and radii of spheres along its middle.
///
/// The PLY file has the properties x, y, z and radius, in the unit of the cloud.
#[derive(Debug, Args)]
pub struct SkeletonArgs {
    /// The cloud, or `-`
    input: PathBuf,

    /// The PLY file to write, or `-`
    #[arg(short, long, value_name = value::FILE, required_unless_present = "to")]
    output: Option<PathBuf>,

    /// The same as `--output`
    #[arg(hide = true, conflicts_with = "output")]
    to: Option<PathBuf>,

    #[command(flatten)]
    weights: Weights,

    #[command(flatten)]
    device: Device,

    #[command(flatten)]
    read: ReadFlags,

    #[command(flatten)]
    surface: SurfaceFlag,

    #[command(flatten)]
    common: Common,
}

/// Extracts.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn run(args: &SkeletonArgs) -> Result<ExitCode, Failure> {
    let Some(output) = args.output.as_ref().or(args.to.as_ref()) else {
        return Err(Failure::usage("name the file to write: --output FILE".into()));
    };
    let weights = args.weights.weights.as_deref().map(Path::new).filter(|path| path.is_file());
    let places = Places::new().reads("the cloud", &*args.input).reads("--weights", weights);
    places.writes("--output", &**output, OutputKind::PLY)?.check()?;
    args.common.threads.start()?;
    let progress = args.common.progress();
    progress.step(format!("reading {:?}", args.input));
    let mut input = files::read_solid(&args.input, None, args.read.options())?;
    let drawn = args.surface.draw_alone(&mut input, 0)?;
    progress.step(format!("finding the skeleton of {:?}", input.name));
    let found = srrf::skeleton(&input.cloud, args.weights.weights.as_deref(), &args.device.device)
        .map_err(|e| failed(e, &input.name, &input.name))?;
    files::write(output, to_ply(&found).as_bytes())?;
    progress.clear();
    let out = Output::new(args.common.quiet.quiet, files::is_stream(output));
    out.say(&format!(
        "wrote {}: {} spheres of {}, by {}",
        output.display(),
        count(found.skeleton.points.len()),
        input.name,
        found.weights
    ));
    drawn.iter().for_each(|drawn| out.say(&format!("{} is {}", input.name, drawn.text())));
    for warning in warnings_of(&input) {
        out.say(&format!("warning: {warning}"));
    }
    Ok(ExitCode::SUCCESS)
}

/// PLY, ASCII; numbers read back as the same bits.
fn to_ply(FoundSkeleton { skeleton, weights }: &FoundSkeleton) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\ncomment skeleton by {}\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nproperty double radius\nend_header\n",
        weights.replace(['\n', '\r'], " "),
        skeleton.points.len()
    );
    for ([x, y, z], radius) in skeleton.points.iter().zip(&skeleton.radii) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{x} {y} {z} {radius}");
    }
    text
}
