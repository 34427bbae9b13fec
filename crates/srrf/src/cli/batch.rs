//! `srrf batch`: many pairs, in parallel.

use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use clap::{Args, Subcommand};
use rayon::ThreadPoolBuilder;
use serde_json::{Value, json};
use srrf::{Registrar, Request, Target};

use super::common::{failed, to_json, unusable, warnings_of};
use super::method::MethodArgs;
use super::page::{self, PageArgs};
use super::poses::{PoseReading, looks_inverted};
use super::scale::{self, ScaleArgs};
use super::surface::SurfaceArgs;
use super::values::ShownValues;
use srrf_args::files::Input;
use srrf_args::flags::{Common, value};
use srrf_args::reading::{PairReadFlags, described as described_reading};
use srrf_args::words::{count, counted};
use srrf_args::{Failure, Output, OutputKind, OutputLock, Places, Progress};
use srrf_args::{files, interrupt};
use srrf_cloud::io::ReadOptions;

mod csv;
mod digest;
mod list;
mod merge;
mod overview;
mod pair;
mod parquet_list;
mod results;
mod row;
mod shard;
mod shared;
mod store;
mod table;

use digest::Digest;
use list::PairList;
use merge::{MergeArgs, merge};
use overview::Overview;
use pair::ListedPair;
use results::Results;
use row::BatchRow;
use shard::Shard;
use shared::{ReadyTarget, SharedTargets};

/// What results are written as.
const RESULTS: OutputKind =
    OutputKind { what: "rows of results", extensions: &["jsonl", "ndjson", "csv", "parquet"] };

const HELP: &str = "Exit codes:
  0    every pair has a pose (see `abstain` in its line)
  1    some pairs have none (see `error` in their lines), or the results could not be written
  2    bad usage, list or results file
  130  interrupted; the same command goes on where it stopped";

/// Register the pairs of a list, in parallel: one row a pair, in the order of the list.
///
/// The list is CSV, JSON lines or Parquet, with the columns `source`, `target` and, if wanted, `initial` (a file with a first
/// guess) and `id`; files are relative to it, other columns are carried to the results. Pairs that are in the results
/// already are skipped, so that the same command goes on after an interruption, and a list can grow.
#[derive(Debug, Args)]
#[command(after_help = HELP, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct BatchArgs {
    #[command(subcommand)]
    verb: Option<BatchVerb>,

    /// The list
    #[arg(required = true)]
    pairs: Option<PathBuf>,

    /// The results: JSON lines, or CSV or Parquet by the extension; or `-`
    #[arg(short, long, alias = "out", value_name = value::FILE, required = true)]
    output: Option<PathBuf>,

    /// Only this part of the list, such as 3/64; `srrf batch merge` joins the parts
    #[arg(long, value_name = "K/N")]
    shard: Option<Shard>,

    /// Register pairs again that are in the results without a pose
    #[arg(long)]
    retry_failed: bool,

    /// Write an overview and a page for each pair into a folder
    #[arg(long, value_name = value::FOLDER)]
    html: Option<PathBuf>,

    #[command(flatten)]
    page: PageArgs,

    #[command(flatten)]
    method: MethodArgs,

    #[command(flatten)]
    scale: ScaleArgs,

    #[command(flatten)]
    reading: PoseReading,

    #[command(flatten)]
    surface: SurfaceArgs,

    #[command(flatten)]
    read: PairReadFlags,

    #[command(flatten)]
    common: Common,
}

/// What can be done with results.
#[derive(Debug, Subcommand)]
enum BatchVerb {
    Merge(MergeArgs),
}

/// What results of a batch come to: counts, times, reliability, the slowest and the least probable pairs.
#[derive(Debug, Args)]
pub struct SummaryArgs {
    /// The results: JSON lines, CSV or Parquet
    results: PathBuf,
}

/// Sums up results.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn summary(args: &SummaryArgs) -> Result<ExitCode, Failure> {
    Output::Standard.say(&digest_of(&args.results)?.text());
    Ok(ExitCode::SUCCESS)
}

fn digest_of(results: &std::path::Path) -> Result<Digest, Failure> {
    let mut digest = Digest::default();
    store::each_row(results, &mut |row| {
        digest.add(&row);
        Ok(())
    })?;
    Ok(digest)
}

/// Registers all pairs.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn run(args: &BatchArgs) -> Result<ExitCode, Failure> {
    if let Some(BatchVerb::Merge(merge_args)) = &args.verb {
        return merge(merge_args);
    }
    let (Some(list), Some(output)) = (&args.pairs, &args.output) else {
        return Err(Failure::usage("name a list, and a file for the results by --output".into()));
    };
    let places = Places::new().reads("the list", &**list).writes("--output", &**output, RESULTS)?;
    places.check()?;
    let _lock = OutputLock::take(output)?;
    let threads = args.common.threads.start()?;
    let pairs = PairList::read(list, &args.read.source())?;
    pairs.read_by(places).check()?;
    let reading = [args.read.source().of_several(), args.read.target().of_several()];
    pairs.check_taken(&reading)?;
    let bar = args.common.progress();
    bar.step("loading the network");
    let registrar = Registrar::new(args.scale.options(args.method.options())).map_err(unusable)?;
    let described = args.describe();
    let (results, done) = Results::open(output, &pairs.rows, &described, args.retry_failed)?;
    let mine = |row: &&ListedPair| args.shard.is_none_or(|shard| shard.has(&row.id));
    let asked = pairs.rows.iter().filter(mine).count();
    let todo: Vec<&ListedPair> =
        pairs.rows.iter().filter(mine).filter(|row| !done.contains_key(&row.id)).collect();
    let out = Output::new(args.common.quiet.quiet, files::is_stream(output));
    bar.clear();
    if let Some(shard) = args.shard {
        out.say(&format!("shard {shard}: {} of {}", count(asked), pairs_of(pairs.rows.len())));
    }
    if !done.is_empty() {
        out.say(&format!("{} of {} done already", count(done.len()), pairs_of(pairs.rows.len())));
    }
    if let Some(folder) = &args.html {
        std::fs::create_dir_all(folder).map_err(|e| {
            Failure::usage(format!("cannot make the folder {folder:?}: {e}; choose another --html"))
        })?;
    }
    interrupt::advise("; the same command goes on where this one stopped");

    bar.counted("registering", todo.len(), "pairs");
    let targets = SharedTargets::new(todo.iter().map(|row| &*row.target));
    let batch = Batch { args, pairs: &pairs, registrar: &registrar, described: &described, targets, reading };
    let (results, digest) = batch.run(&todo, threads, results, &bar)?;
    results.finish(&pairs.rows)?;
    bar.clear();
    let before = done.values().filter(|has_pose| !**has_pose).count();
    out.say(&if todo.is_empty() { digest.counts() } else { digest.text() });
    if before > 0 {
        out.say(&format!("{} done before without a pose: --retry-failed tries again", pairs_of(before)));
    }
    if let (Some(folder), false) = (&args.html, files::is_stream(output)) {
        out.say(&overview(folder, output)?);
    }
    Ok(if digest.failed + before > 0 { ExitCode::from(1) } else { ExitCode::SUCCESS })
}

/// Writes the overview of all results, those of earlier runs too.
fn overview(folder: &std::path::Path, results: &std::path::Path) -> Result<String, Failure> {
    let mut columns = BTreeSet::new();
    store::each_row(results, &mut |row| {
        columns.extend(row.columns().cloned());
        Ok(())
    })?;
    let digest = digest_of(results)?.text();
    let mut overview = Overview::new(folder, &digest, columns.into_iter().collect());
    store::each_row(results, &mut |row| {
        overview.add(&row);
        Ok(())
    })?;
    let index = overview::index_of(folder);
    files::write(&index, overview.finish().as_bytes())?;
    Ok(format!("wrote {}: open it in a browser", index.display()))
}

/// `1 pair`, `1,234 pairs`.
fn pairs_of(n: usize) -> String {
    counted(n, "pair")
}

impl BatchArgs {
    /// What the answers depend on besides the clouds.
    fn describe(&self) -> Value {
        let m = &self.method;
        let mut described = json!({
            "method": m.method,
            "rotation": m.rotation,
            "refine": !m.no_refine,
            "weights": m.weights.weights,
            "seed": m.seed.seed,
        });
        if let Value::Object(map) = &mut described {
            map.extend(self.scale.describe().map(|scale| ("scale".to_owned(), scale)));
            map.extend(self.surface.vertices.then(|| ("vertices".to_owned(), json!(true))));
        }
        let reading = [described_reading(&self.read.source()), described_reading(&self.read.target())];
        if let (Value::Object(map), true) = (&mut described, reading.iter().any(|set| !set.is_empty())) {
            map.insert("reading".into(), json!(reading));
        }
        described
    }
}

struct Batch<'a> {
    args: &'a BatchArgs,
    pairs: &'a PairList,
    registrar: &'a Registrar,
    described: &'a Value,
    targets: SharedTargets,
    /// How sources and targets are read.
    reading: [ReadOptions; 2],
}

/// What the workers share.
struct BatchState {
    results: Results,
    digest: Digest,
    outcome: Result<(), Failure>,
}

impl Batch<'_> {
    /// Each worker takes the next pair, on threads of its own: as long as there are more pairs than threads,
    /// none waits for another.
    fn run(
        &self,
        todo: &[&ListedPair],
        threads: usize,
        results: Results,
        bar: &Progress,
    ) -> Result<(Results, Digest), Failure> {
        let workers = threads.min(todo.len()).max(1);
        let next = AtomicUsize::new(0);
        let state = Mutex::new(BatchState { results, digest: Digest::default(), outcome: Ok(()) });
        let work = || {
            let pool = ThreadPoolBuilder::new().num_threads((threads / workers).max(1)).build();
            let pool = match pool {
                Ok(pool) => pool,
                Err(e) => {
                    let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
                    state.outcome =
                        Err(Failure::failed(format!("cannot start worker threads: {e}; try --threads 1")));
                    return;
                }
            };
            loop {
                let place = next.fetch_add(1, Ordering::Relaxed);
                let Some(row) = todo.get(place) else { return };
                let line = pool.install(|| self.line(row));
                let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
                let BatchState { results, digest, outcome } = &mut *state;
                digest.add(&line);
                if outcome.is_ok() {
                    *outcome = results.put(place, &line);
                }
                if outcome.is_err() {
                    return;
                }
                bar.advance(1);
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..workers {
                scope.spawn(work);
            }
        });
        let BatchState { results, digest, outcome } =
            state.into_inner().unwrap_or_else(PoisonError::into_inner);
        outcome.map(|()| (results, digest))
    }

    /// The row of a pair, with or without a pose.
    fn line(&self, row: &ListedPair) -> BatchRow {
        let target = || -> Result<ReadyTarget, String> {
            let input = self.read_target(row).map_err(|e| e.to_string())?;
            let target = if self.args.surface.draws(&input) {
                None // drawn for each source, as dense as that one is
            } else {
                Some(self.prepare(row, &input).map_err(|e| e.to_string())?)
            };
            Ok(ReadyTarget { input, target })
        };
        // What a pair has made is not looked at again after a panic.
        let done = catch_unwind(AssertUnwindSafe(|| {
            self.targets
                .with(&row.target, target, |ready| self.register(row, ready).map_err(|e| e.to_string()))
        }));
        let answer =
            done.unwrap_or_else(|_| Err("a fault of the program; please report it with both files".into()));
        BatchRow::new(row, self.described, answer)
    }

    fn read_target(&self, row: &ListedPair) -> Result<Input, Failure> {
        files::read_solid(&self.pairs.path(&row.target), None, self.reading[1].clone())
    }

    fn prepare(&self, row: &ListedPair, target: &Input) -> Result<Target, Failure> {
        self.registrar.prepare(&target.cloud).map_err(|e| failed(e, &row.source, &target.name))
    }

    fn register(&self, row: &ListedPair, ready: &ReadyTarget) -> Result<Value, Failure> {
        let mut source = files::read_solid(&self.pairs.path(&row.source), None, self.reading[0].clone())?;
        self.args.scale.apply(&mut source)?;
        let (one_unit, seed) = (self.args.scale.is_one_unit(), self.args.method.seed.seed);
        let (own, own_target);
        let (target, prepared, surfaces) = match &ready.target {
            Some(prepared) => {
                let surfaces = self.args.surface.draw_source(&mut source, &ready.input, one_unit, seed)?;
                (&ready.input, prepared, surfaces)
            }
            None => {
                let mut mesh = self.read_target(row)?;
                let surfaces = self.args.surface.draw(&mut source, &mut mesh, one_unit, seed)?;
                own_target = self.prepare(row, &mesh)?;
                own = mesh;
                (&own, &own_target, surfaces)
            }
        };
        let read = |file: &String| self.args.reading.read(&self.pairs.path(file));
        let initial = row.initial.as_ref().map(read).transpose()?.map(|guess| guess.target_from_source);
        let request = Request { initial, ..Request::new(&source.cloud, prepared) };
        let found = self.args.scale.register(self.registrar, &request);
        let mut outcome = found.map_err(|e| failed(e, &source.name, &target.name))?;
        outcome.surfaces = surfaces;
        let dropped = [source.dropped, target.dropped];
        outcome.warnings.extend([&source, target].into_iter().flat_map(warnings_of));
        outcome.warnings.extend(initial.and_then(|pose| looks_inverted(&pose, &source.cloud, &target.cloud)));
        if let Some(folder) = &self.args.html {
            scale::applied(&outcome, &mut source)?;
            let values = ShownValues::of_pair(&source, target);
            let pair =
                page::of_outcome(&outcome, &source, target, &values, initial.as_ref(), &self.args.page);
            let html = page::html(pair, &source, target);
            files::write(&folder.join(overview::page_name(&row.id)), html.as_bytes())?;
        }
        Ok(to_json(&outcome, &row.source, &row.target, dropped))
    }
}
