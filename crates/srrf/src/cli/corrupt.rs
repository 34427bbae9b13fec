//! `srrf corrupt`: one of the twelve corruptions.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use rand::{SeedableRng, rngs::ChaCha8Rng};
use srrf_cloud::PointCloud;
use srrf_corrupt::{Corrupted, CorruptionKind, Severity, Variants, corruption};

use super::failure::Failure;
use super::files;
use super::say::{Voice, count, points};

/// Corrupt a cloud in one of twelve ways, to see what a registration stands.
///
/// The cloud is brought to the unit sphere, corrupted there, and mapped back. `srrf-corrupt` has more
/// options, and draws all corruptions side by side.
#[derive(Debug, Args)]
pub struct CorruptArgs {
    /// The cloud, or `-`
    input: PathBuf,

    /// Where to write it: its points only; `-` writes PLY to standard output
    output: PathBuf,

    /// Which corruption, such as `cutout` or `gaussian`; a wrong name lists them
    #[arg(short = 't', long = "type", value_name = "NAME")]
    kind: CorruptionKind,

    /// How strong, 1 to 5
    #[arg(short, long, value_name = "1-5", default_value = "3")]
    severity: Severity,

    /// Seed of all draws
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,

    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Corrupts.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn run(args: &CorruptArgs) -> Result<ExitCode, Failure> {
    files::check_cloud_output(&args.output)?;
    let input = files::read(&args.input, None)?;
    let (unit, frame) = input.cloud.to_unit_sphere();
    let corruption = corruption(args.kind, &Variants::paper());
    let Corrupted { points: moved, origin } =
        corruption.apply(unit.points(), args.severity, &mut ChaCha8Rng::seed_from_u64(args.seed)).map_err(
            |e| Failure::Usage(format!("{:?}: {e}; take a larger cloud, or another corruption", input.name)),
        )?;
    let corrupted = PointCloud::new(moved.iter().map(|p| frame.undo(p)).collect())
        .map_err(|e| Failure::cloud(&input.name, &e))?;
    files::write_points(&args.output, &corrupted)?;
    let added = origin.iter().filter(|o| o.is_none()).count();
    let dropped = match input.dropped {
        0 => String::new(),
        n => format!("; {} with NaN or infinity were left out before", count(n)),
    };
    Voice::new(args.quiet, files::is_stream(&args.output)).say(&format!(
        "wrote {}: {} {}, seed {}; {} became {}, {} of them new{dropped}",
        args.output.display(),
        corruption.name(),
        args.severity,
        args.seed,
        points(input.cloud.len()),
        count(corrupted.len()),
        count(added),
    ));
    Ok(ExitCode::SUCCESS)
}
