//! `srrf view`: a page that shows two clouds and a pose between them.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use srrf_view::Pose;

use super::page::{self, PageArgs};
use super::poses::{PoseReading, described, looks_inverted};
use super::surface::{self, SurfaceArgs};
use super::values::ShownValues;
use srrf_args::flags::Common;
use srrf_args::reading::PairReadFlags;
use srrf_args::{Failure, Output, OutputKind, Places, files};

/// Write a page that shows two clouds, and a pose between them if one is given.
///
/// The page is one file that works offline, in any browser.
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// The source, or `-`
    source: PathBuf,

    /// The target, or `-`
    target: PathBuf,

    /// A pose that maps source to target: 4 rows of 4, or any other kind that `srrf register -o` writes
    #[arg(long, value_name = "FILE")]
    transform: Option<PathBuf>,

    #[command(flatten)]
    reading: PoseReading,

    /// The page to write
    #[arg(short, long, value_name = "FILE", required_unless_present = "png")]
    output: Option<PathBuf>,

    /// Write a picture
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,

    #[command(flatten)]
    surface: SurfaceArgs,

    #[command(flatten)]
    page: PageArgs,

    #[command(flatten)]
    read: PairReadFlags,

    #[command(flatten)]
    common: Common,
}

/// Writes the page.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn run(args: &ViewArgs) -> Result<ExitCode, Failure> {
    let places = Places::new()
        .reads("the source", &*args.source)
        .reads("the target", &*args.target)
        .reads("--transform", args.transform.as_deref())
        .writes("--output", args.output.as_deref(), OutputKind::PAGE)?
        .writes("--png", args.png.as_deref(), OutputKind::PNG)?;
    places.check()?;
    let out = Output::new(args.common.quiet.quiet, places.takes_standard_output());
    args.common.threads.start()?;
    let pose = args.transform.as_deref().map(|path| args.reading.read(path)).transpose()?;
    let progress = args.common.progress();
    progress.step(format!("reading {:?} and {:?}", args.source, args.target));
    let mut source = files::read(&args.source, None, args.read.source())?;
    let mut target = files::read(&args.target, None, args.read.target())?;
    args.read.check(&source.file, &target.file)?;
    let surfaces = args.surface.draw(&mut source, &mut target, true, 0)?;
    let values = ShownValues::of_pair(&source, &target);
    let mut pair = args.page.pair(&source, &target, &values);
    for (input, drawn) in [&source, &target].into_iter().zip(&surfaces) {
        if let Some(drawn) = drawn {
            pair = pair.warning(format!("{}: {}.", input.name, surface::text(drawn)));
        }
    }
    if let Some(pose) = &pose {
        out.say(&described("--transform", pose));
        let name = if pose.abstained { "given, abstained" } else { "given" };
        pair = pair.pose(Pose::new(name, pose.target_from_source));
        if let Some(warning) = looks_inverted(&pose.target_from_source, &source.cloud, &target.cloud) {
            out.say(&format!("warning: {warning}"));
            pair = pair.warning(warning.to_string());
        }
    }
    let mut lines = Vec::new();
    if let Some(path) = &args.png {
        progress.step(format!("writing {path:?}"));
        files::write(path, &page::png(&pair)?)?;
        lines.push(format!("wrote {}: a picture", path.display()));
    }
    if let Some(path) = &args.output {
        progress.step(format!("writing {path:?}"));
        files::write(path, page::html(pair, &source, &target).as_bytes())?;
        lines.push(format!("wrote {}: open it in a browser", path.display()));
    }
    progress.clear();
    lines.iter().for_each(|line| out.say(line));
    Ok(ExitCode::SUCCESS)
}
