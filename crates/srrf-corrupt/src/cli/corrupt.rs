//! The verb `corrupt`, of `srrf` and of `srrf-corrupt`: one corruption of a file.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use rand::{SeedableRng, rngs::ChaCha8Rng};
use srrf_args::flags::{Quiet, Seed, value};
use srrf_args::reading::ReadFlags;
use srrf_args::surface::SurfaceFlag;
use srrf_args::words::{count, points};
use srrf_args::{Failure, Output, Places, ProgressArgs, files};
use srrf_cloud::PointCloud;

use super::list::list;
use super::reading::ReadingArgs;
use crate::corruption::Corrupted;
use crate::corruptions::CorruptionKind;
use crate::kind::corruption;
use crate::severity::Severity;

/// Corrupt a cloud in one of twelve ways, to see what a registration stands.
///
/// The cloud is brought to the unit sphere, corrupted there, and mapped back. Points with NaN are left out. A mesh is
/// corrupted as points drawn from its surface.
#[derive(Debug, Args)]
pub struct CorruptArgs {
    /// The cloud, or `-`
    #[arg(required_unless_present = "list")]
    input: Option<PathBuf>,

    /// Which corruption, such as `cutout` or `gaussian`; `--list` shows them
    #[arg(
        short,
        long,
        alias = "type",
        short_alias = 't',
        value_name = "NAME",
        required_unless_present = "list"
    )]
    corruption: Option<CorruptionKind>,

    /// How strong, 1 to 5
    #[arg(short, long, value_name = "1-5", default_value = "3")]
    severity: Severity,

    /// Where to write the corrupted cloud: its points only; `-` writes PLY to standard output
    #[arg(short, long, value_name = value::FILE, required_unless_present_any = ["list", "to"])]
    output: Option<PathBuf>,

    /// The same as `--output`
    #[arg(hide = true, conflicts_with = "output")]
    to: Option<PathBuf>,

    #[command(flatten)]
    seed: Seed,

    #[command(flatten)]
    reading: ReadingArgs,

    /// List the corruptions and what grows with their severity
    #[arg(long, exclusive = true)]
    list: bool,

    /// What is done anyway
    #[arg(long, hide = true)]
    drop_nan: bool,

    #[command(flatten)]
    read: ReadFlags,

    #[command(flatten)]
    surface: SurfaceFlag,

    #[command(flatten)]
    quiet: Quiet,

    #[command(flatten)]
    progress: ProgressArgs,
}

/// Corrupts.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn corrupt(args: &CorruptArgs) -> Result<ExitCode, Failure> {
    let output = args.output.as_ref().or(args.to.as_ref());
    let (Some(input), Some(output), Some(kind)) = (&args.input, output, args.corruption) else {
        Output::Standard.say(list().trim_end());
        return Ok(ExitCode::SUCCESS);
    };
    Places::new().reads("the cloud", &**input).writes_cloud("--output", &**output)?.check()?;
    let progress = args.progress.start(args.quiet.quiet);
    progress.step(format!("reading {input:?}"));
    let mut input = files::read(input, None, args.read.options())?;
    let drawn = args.surface.draw_alone(&mut input, args.seed.seed)?;
    progress.step(format!("corrupting {:?}", input.name));
    let (unit, frame) = input.cloud.to_unit_sphere();
    let corruption = corruption(kind, &args.reading.variants());
    let seed = args.seed.seed;
    let Corrupted { points: moved, origin } = corruption
        .apply(unit.points(), args.severity, &mut ChaCha8Rng::seed_from_u64(seed))
        .map_err(|e| {
            let message = format!("{:?}: {e}; take a larger cloud, or another corruption", input.name);
            Failure::usage(message).because(e)
        })?;
    let corrupted = PointCloud::new(moved.iter().map(|p| frame.undo(p)).collect())
        .map_err(|e| Failure::cloud(&input.name, &e))?;
    progress.step(format!("writing {output:?}"));
    let kept = files::write_points(output, &corrupted, &input)?;
    progress.clear();
    let added = origin.iter().filter(|o| o.is_none()).count();
    let dropped = match input.dropped {
        0 => String::new(),
        n => format!("; {} with NaN or infinity were left out before", count(n)),
    };
    let precision = if kept.double.is_some() { format!("; {kept}") } else { String::new() };
    let out = Output::new(args.quiet.quiet, files::is_stream(output));
    out.say(&format!(
        "wrote {}: {} {}, seed {seed}; {} became {}, {} of them new{dropped}{precision}",
        output.display(),
        corruption.name(),
        args.severity,
        points(input.cloud.len()),
        count(corrupted.len()),
        count(added),
    ));
    drawn.iter().for_each(|drawn| out.say(&format!("{} is {}", input.name, drawn.text())));
    input.notes.iter().for_each(|note| out.say(&format!("warning: {}: {note}.", input.name)));
    Ok(ExitCode::SUCCESS)
}
