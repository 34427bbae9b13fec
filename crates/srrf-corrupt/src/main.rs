//! `srrf-corrupt`: corrupts a file, draws the contact sheet of all corruptions, and lists them.

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;
use rand::{SeedableRng, rngs::ChaCha8Rng, seq::index};
use srrf_cloud::PointCloud;
use srrf_cloud::io::{write_atomically, write_cloud};
use srrf_corrupt::{Corrupted, corruption};
use srrf_corrupt::{datasets::ShapeSource, shapes::ProceduralShapes};

mod canvas;
mod cli;
mod failure;
mod files;
mod list;
mod sheet;

use cli::{Cli, Command, CorruptArgs, SheetArgs};
use failure::Failure;
use sheet::Sheet;

/// The shape of a sheet without an input file.
const BUILT_IN: &str = "chair";

fn main() -> ExitCode {
    match run(Cli::parse()) {
        Ok(text) => {
            // A reader that has gone away, as `head` does, is no failure.
            let _ = writeln!(std::io::stdout(), "{}", text.trim_end());
            ExitCode::SUCCESS
        }
        Err(failure) => {
            let _ = writeln!(std::io::stderr(), "error: {failure}");
            failure.exit_code()
        }
    }
}

fn run(cli: Cli) -> Result<String, Failure> {
    match (cli.command, cli.corrupt) {
        (Some(Command::Sheet(args)), _) => draw_sheet(&args),
        (None, _) if cli.list => Ok(list::list()),
        (None, Some(args)) => corrupt_file(&args),
        (None, None) => Err(Failure::Usage("nothing to do: see --help".into())),
    }
}

/// Brings the cloud to the unit sphere, where the corruptions are defined, corrupts it, and maps
/// it back.
fn corrupt_file(args: &CorruptArgs) -> Result<String, Failure> {
    files::check_cloud_output(&args.output)?;
    let (cloud, dropped) = files::read(&args.input, args.drop_nan)?;
    let (unit, frame) = cloud.to_unit_sphere();
    let corruption = corruption(args.corruption, &args.variants.into());
    let Corrupted { points, origin } = corruption
        .apply(unit.points(), args.severity, &mut ChaCha8Rng::seed_from_u64(args.seed))
        .map_err(|e| Failure::input(format_args!("{}: {e}", args.input.display())))?;
    let corrupted = PointCloud::new(points.iter().map(|p| frame.undo(p)).collect())
        .map_err(|e| Failure::input(format_args!("{}, corrupted: {e}", args.input.display())))?;
    write_cloud(&args.output, &corrupted).map_err(Failure::other)?;
    let added = origin.iter().filter(|o| o.is_none()).count();
    Ok(format!(
        "wrote {}: {} {}, seed {}; {} points became {}, {added} of them new{}",
        args.output.display(),
        corruption.name(),
        args.severity,
        args.seed,
        cloud.len(),
        corrupted.len(),
        if dropped > 0 { format!("; {dropped} with NaN were left out before") } else { String::new() },
    ))
}

fn draw_sheet(args: &SheetArgs) -> Result<String, Failure> {
    files::check_folder(&args.output)?;
    let mut rng = ChaCha8Rng::seed_from_u64(args.seed);
    let (cloud, name) = match &args.input {
        Some(input) => {
            let (cloud, _) = files::read(input, args.drop_nan)?;
            let name = input.file_name().unwrap_or_default().to_string_lossy().into_owned();
            (thinned(cloud, args.points as usize, &mut rng)?.to_unit_sphere().0, name)
        }
        None => (built_in(args.points as usize, &mut rng)?, format!("built-in {BUILT_IN}")),
    };
    let sheet = Sheet {
        cloud: &cloud,
        title: format!("{name}, {} points, seed {}", cloud.len(), args.seed),
        variants: args.variants.into(),
        seed: args.seed,
        up: args.up,
        yaw_deg: args.yaw,
    };
    let png = sheet
        .draw()
        .map_err(|e| Failure::input(format_args!("{name}: {e}")))?
        .to_png()
        .map_err(Failure::other)?;
    write_atomically(&args.output, |out| out.write_all(&png))
        .map_err(|e| Failure::other(format_args!("cannot write {}: {e}", args.output.display())))?;
    Ok(format!("wrote {}: 12 corruptions x 5 severities of {name}", args.output.display()))
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
