//! `srrf-corrupt sheet`: every corruption at every severity in one picture.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use rand::{SeedableRng, rngs::ChaCha8Rng, seq::index};
use srrf_args::flags::{Quiet, Seed, UpAxis, help, value};
use srrf_args::numbers::{real, whole};
use srrf_args::reading::ReadFlags;
use srrf_args::surface::SurfaceFlag;
use srrf_args::{Failure, Output, OutputKind, Places, files};
use srrf_cloud::PointCloud;

use super::draw::ContactSheet;
use super::reading::ReadingArgs;
use crate::datasets::ShapeSource;
use crate::shapes::ProceduralShapes;

/// The shape of a sheet without an input file.
const BUILT_IN: &str = "chair";

/// Draw every corruption at every severity as a PNG.
#[derive(Debug, Args)]
pub struct SheetArgs {
    /// The cloud to show, or `-`; a built-in shape without it
    input: Option<PathBuf>,

    /// The PNG to write
    #[arg(short, long, value_name = value::FILE)]
    output: PathBuf,

    #[command(flatten)]
    seed: Seed,

    /// Larger clouds are thinned to so many points.
    #[arg(
        long,
        value_name = value::NUMBER,
        default_value_t = 1024,
        value_parser = whole(32usize, 100_000),
        allow_negative_numbers = true,
        help = help::POINTS,
        long_help = format!("{}\n\nLarger clouds are thinned to so many", help::POINTS)
    )]
    points: usize,

    #[command(flatten)]
    reading: ReadingArgs,

    #[command(flatten)]
    up: UpAxis,

    /// Where the eye is, in degrees around that axis
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 215.0,
        value_parser = real(-3600.0, 3600.0),
        allow_negative_numbers = true
    )]
    yaw: f64,

    /// What is done anyway
    #[arg(long, hide = true)]
    drop_nan: bool,

    #[command(flatten)]
    read: ReadFlags,

    #[command(flatten)]
    surface: SurfaceFlag,

    #[command(flatten)]
    quiet: Quiet,
}

/// Draws.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn sheet(args: &SheetArgs) -> Result<ExitCode, Failure> {
    let places = Places::new().reads("the cloud", args.input.as_deref());
    places.writes("--output", &*args.output, OutputKind::PNG)?.check()?;
    let mut rng = ChaCha8Rng::seed_from_u64(args.seed.seed);
    let mut drawn = None;
    let (cloud, name) = match &args.input {
        Some(path) => {
            let mut input = files::read(path, None, args.read.options())?;
            drawn = args.surface.draw_alone(&mut input, args.seed.seed)?;
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            (thinned(input.cloud, args.points, &mut rng)?.to_unit_sphere().0, name)
        }
        None => (built_in(args.points, &mut rng)?, format!("built-in {BUILT_IN}")),
    };
    let sheet = ContactSheet {
        cloud: &cloud,
        title: format!("{name}, {} points, seed {}", cloud.len(), args.seed.seed),
        variants: args.reading.variants(),
        seed: args.seed.seed,
        up: args.up.up,
        yaw_deg: args.yaw,
    };
    let png = sheet
        .draw()
        .map_err(|e| Failure::usage(format!("{name}: {e}")).because(e))?
        .to_png()
        .map_err(Failure::other)?;
    files::write(&args.output, &png)?;
    let out = Output::new(args.quiet.quiet, files::is_stream(&args.output));
    out.say(&format!("wrote {}: 12 corruptions x 5 severities of {name}", args.output.display()));
    drawn.iter().for_each(|drawn| out.say(&format!("{name} is {}", drawn.text())));
    Ok(ExitCode::SUCCESS)
}

/// A random subset, in the order of the file, of a cloud of more points.
fn thinned(cloud: PointCloud, count: usize, rng: &mut ChaCha8Rng) -> Result<PointCloud, Failure> {
    if cloud.len() <= count {
        return Ok(cloud);
    }
    let mut chosen = index::sample(rng, cloud.len(), count).into_vec();
    chosen.sort_unstable();
    PointCloud::new(chosen.into_iter().map(|i| cloud.points()[i]).collect()).map_err(Failure::other)
}

fn built_in(points: usize, rng: &mut ChaCha8Rng) -> Result<PointCloud, Failure> {
    ProceduralShapes::new(0, 1, Some(&[BUILT_IN]))
        .and_then(|shapes| shapes.sample(0, points, rng))
        .map_err(Failure::other)
}
