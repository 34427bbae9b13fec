//! `srrf view`: a page that shows two clouds and a pose between them.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use srrf_view::Pose;

use super::page::{self, PageArgs};
use super::transform;
use srrf_args::Failure;
use srrf_args::Output;
use srrf_args::files;
use srrf_args::flags::Common;

/// Write a page that shows two clouds, and a pose between them if one is given.
///
/// The page is one file that works offline, in any browser.
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// The source, or `-`
    source: PathBuf,

    /// The target, or `-`
    target: PathBuf,

    /// A pose that maps source to target: 4 rows of 4, as `srrf register -o` writes it
    #[arg(long, value_name = "FILE")]
    transform: Option<PathBuf>,

    /// The page to write
    #[arg(short, long, value_name = "FILE", required_unless_present = "png")]
    output: Option<PathBuf>,

    /// Write a picture
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,

    #[command(flatten)]
    page: PageArgs,

    #[command(flatten)]
    common: Common,
}

/// Writes the page.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn run(args: &ViewArgs) -> Result<ExitCode, Failure> {
    if files::is_stream(&args.source) && files::is_stream(&args.target) {
        return Err(Failure::usage(
            "both clouds are `-`: standard input holds one; name a file for the other".into(),
        ));
    }
    let outputs = [&args.output, &args.png];
    outputs.into_iter().flatten().try_for_each(|path| files::check_output(path))?;
    let streams = outputs.into_iter().flatten().filter(|path| files::is_stream(path)).count();
    if streams > 1 {
        return Err(Failure::usage("both results are to go to `-`: standard output takes one".into()));
    }
    args.common.threads.start()?;
    let pose = args.transform.as_deref().map(transform::read).transpose()?;
    let progress = args.common.progress();
    progress.step(format!("reading {:?} and {:?}", args.source, args.target));
    let (source, target) = (files::read(&args.source, None)?, files::read(&args.target, None)?);
    let mut pair = args.page.pair(&source, &target);
    if let Some(pose) = pose {
        pair = pair.pose(Pose::new("given", pose));
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
    let out = Output::new(args.common.quiet.quiet, streams > 0);
    lines.iter().for_each(|line| out.say(line));
    Ok(ExitCode::SUCCESS)
}
