//! `srrf view`: a page that shows two clouds and a pose between them.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use srrf_view::{Page, Pose};

use super::page::{PageArgs, title};
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
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

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
    files::check_output(&args.output)?;
    args.common.threads.start()?;
    let pose = args.transform.as_deref().map(transform::read).transpose()?;
    let (source, target) = (files::read(&args.source, None)?, files::read(&args.target, None)?);
    let mut pair = args.page.pair(&source, &target);
    if let Some(pose) = pose {
        pair = pair.pose(Pose::new("given", pose));
    }
    let html = Page::new(title(&source, &target)).pair(pair).to_html();
    files::write(&args.output, html.as_bytes())?;
    Output::new(args.common.quiet.quiet, files::is_stream(&args.output))
        .say(&format!("wrote {}: open it in a browser", args.output.display()));
    Ok(ExitCode::SUCCESS)
}
