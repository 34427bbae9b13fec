//! `srrf batch merge`: results of several runs in one file.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use srrf_args::flags::{Quiet, value};
use srrf_args::words::counted;
use srrf_args::{Failure, Output, OutputLock, Places};

use super::list::PairList;
use super::{RESULTS, results};
use srrf_cloud::io::ReadOptions;

/// Join results of several runs: each pair once; the extension of the output says the format.
///
/// Of two rows of one pair the one with a pose counts. Two different poses of one pair are an error.
#[derive(Debug, Args)]
pub struct MergeArgs {
    /// The results
    #[arg(required = true)]
    results: Vec<PathBuf>,

    /// Where they go together
    #[arg(short, long, value_name = value::FILE)]
    output: PathBuf,

    /// The list whose order they get; pairs that are missing are counted
    #[arg(long, value_name = value::FILE)]
    order: Option<PathBuf>,

    #[command(flatten)]
    quiet: Quiet,
}

/// Joins results.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn merge(args: &MergeArgs) -> Result<ExitCode, Failure> {
    let mut places = Places::new().reads("--order", args.order.as_deref());
    for results in &args.results {
        places = places.reads("the results", &**results);
    }
    places.writes("--output", &*args.output, RESULTS)?.check()?;
    let _lock = OutputLock::take(&args.output)?;
    let listed =
        args.order.as_deref().map(|order| PairList::read(order, &ReadOptions::default())).transpose()?;
    let ids: Vec<&str> = listed.iter().flat_map(|list| &list.rows).map(|pair| &*pair.id).collect();
    let pairs = results::join(&args.results, &ids, &args.output)?;
    let out = Output::new(args.quiet.quiet, false);
    out.say(&format!("{} in {}", counted(pairs, "pair"), args.output.display()));
    if listed.is_some() && pairs < ids.len() {
        out.say(&format!("{} of the list are missing: run their shards", counted(ids.len() - pairs, "pair")));
    }
    Ok(ExitCode::SUCCESS)
}
