//! `srrf-corrupt`: draws the contact sheet of all corruptions, and lists them.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand, ValueEnum};
use rand::{SeedableRng, rngs::ChaCha8Rng};
use srrf_cloud::{PointCloud, shapes::ProceduralShapes, source::ShapeSource};
use srrf_corrupt::Variants;

mod canvas;
mod failure;
mod list;
mod sheet;

use failure::Failure;
use sheet::{Sheet, Up};

/// The shape of a sheet without an input file.
const BUILT_IN: &str = "chair";

#[derive(Parser)]
#[command(version, about = "Corrupts point clouds in the twelve ways of the SRRF paper")]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// List the corruptions and what grows with their severity.
    #[arg(long)]
    list: bool,
}

#[derive(Subcommand)]
enum Command {
    /// Draw every corruption at every severity as a PNG.
    Sheet(SheetArgs),
}

#[derive(Args)]
struct SheetArgs {
    /// The PNG to write.
    #[arg(short, long, value_name = "PNG")]
    output: PathBuf,
    /// Seed of all draws.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Number of points of the clean cloud.
    #[arg(long, default_value_t = 1024, value_parser = clap::value_parser!(u32).range(32..=1_000_000))]
    points: u32,
    /// The readings of the corruptions.
    #[arg(long, value_enum, default_value_t = Reading::Paper)]
    variants: Reading,
    /// The axis that points up in the picture.
    #[arg(long, value_enum, default_value_t = Up::Z)]
    up: Up,
    /// Where the eye is, in degrees around that axis.
    #[arg(long, default_value_t = 215.0, allow_negative_numbers = true)]
    yaw: f64,
}

/// Where the paper's text and the reference code differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Reading {
    /// The paper's text.
    Paper,
    /// The code of ModelNet40-C.
    #[value(name = "modelnet40-c")]
    ModelNet40C,
}

impl From<Reading> for Variants {
    fn from(reading: Reading) -> Self {
        match reading {
            Reading::Paper => Self::paper(),
            Reading::ModelNet40C => Self::modelnet40_c(),
        }
    }
}

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
    match cli.command {
        Some(Command::Sheet(args)) => draw_sheet(&args),
        None if cli.list => Ok(list::list()),
        None => Err(Failure::Usage("nothing to do: see --help".into())),
    }
}

fn draw_sheet(args: &SheetArgs) -> Result<String, Failure> {
    let mut rng = ChaCha8Rng::seed_from_u64(args.seed);
    let (cloud, name) = (built_in(args.points as usize, &mut rng)?, format!("built-in {BUILT_IN}"));
    let title = format!("{name}, {} points, seed {}", cloud.len(), args.seed);
    let sheet = Sheet {
        cloud: &cloud,
        title,
        variants: args.variants.into(),
        seed: args.seed,
        up: args.up,
        yaw_deg: args.yaw,
    };
    let png = sheet.draw().map_err(Failure::input)?.to_png().map_err(Failure::other)?;
    write_whole(&args.output, &png)?;
    Ok(format!("wrote {}: 12 corruptions x 5 severities of {name}", args.output.display()))
}

fn built_in(points: usize, rng: &mut ChaCha8Rng) -> Result<PointCloud, Failure> {
    ProceduralShapes::new(0, 1, Some(&[BUILT_IN]))
        .and_then(|shapes| shapes.sample(0, points, rng))
        .map_err(Failure::other)
}

/// Writes a file through a temporary one beside it, so that it is there whole or not at all.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(Failure::Usage(format!(
            "cannot write {}: the folder {} does not exist; create it first",
            path.display(),
            folder.display()
        )));
    }
    let failed = |e: std::io::Error| Failure::Other(format!("cannot write {}: {e}", path.display()));
    let mut file =
        tempfile::Builder::new().prefix(".srrf-").suffix(".tmp").tempfile_in(folder).map_err(failed)?;
    file.write_all(bytes).map_err(failed)?;
    file.as_file().sync_all().map_err(failed)?;
    file.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
}
