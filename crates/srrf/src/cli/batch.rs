//! `srrf batch`: many pairs, in parallel.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use clap::Args;
use rayon::ThreadPoolBuilder;
use serde_json::{Value, json};
use srrf::{Registrar, Request};

use super::batch_output::ResultLines;
use super::batch_pairs::{ListedPair, PairList};
use super::common::{failed, left_out, to_json, unusable};
use super::method::MethodArgs;
use super::scale::ScaleArgs;
use super::transform;
use srrf_args::Failure;
use srrf_args::flags::{Common, value};
use srrf_args::words::{count, counted};
use srrf_args::{Output, Progress};
use srrf_args::{files, interrupt};

const HELP: &str = "Exit codes:
  0    every pair has a pose (see `abstain` in its line)
  1    some pairs have none (see `error` in their lines), or the results could not be written
  2    bad usage, list or results file
  130  interrupted; the same command goes on where it stopped";

/// Register the pairs of a CSV list, in parallel: one JSON line a pair, in the order of the list.
///
/// The list has the columns `source`, `target` and, if wanted, `initial` (a file with a first guess); files are
/// relative to it. Pairs that are in the results already are skipped, so that the same command goes on after an
/// interruption; delete a line to have its pair done again.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct BatchArgs {
    /// The list
    pairs: PathBuf,

    /// The results, one JSON object a line; or `-`
    #[arg(short, long, alias = "out", value_name = value::FILE)]
    output: PathBuf,

    #[command(flatten)]
    method: MethodArgs,

    #[command(flatten)]
    scale: ScaleArgs,

    #[command(flatten)]
    common: Common,
}

/// Registers all pairs.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn run(args: &BatchArgs) -> Result<ExitCode, Failure> {
    files::check_output(&args.output)?;
    let threads = args.common.threads.start()?;
    let pairs = PairList::read(&args.pairs)?;
    let bar = args.common.progress();
    bar.step("loading the network");
    let registrar = Registrar::new(args.scale.options(args.method.options())).map_err(unusable)?;
    let described = args.describe();
    let (results, done) = ResultLines::open(&args.output, &pairs.rows, &described)?;
    let todo: Vec<&ListedPair> = pairs.rows.iter().filter(|row| !done.contains_key(&row.number)).collect();
    let out = Output::new(args.common.quiet.quiet, files::is_stream(&args.output));
    bar.clear();
    if !done.is_empty() {
        out.say(&format!("{} of {} done already", count(done.len()), pairs_of(pairs.rows.len())));
    }
    interrupt::advise("; the same command goes on where this one stopped");

    bar.counted("registering", todo.len(), "pairs");
    let batch = Batch { pairs: &pairs, registrar: &registrar, described: &described, scale: args.scale };
    let tally = batch.run(&todo, threads, results, &bar)?;
    bar.clear();
    let before = done.values().filter(|has_pose| !**has_pose).count();
    out.say(&format!(
        "{}: {} probably right, {} abstained, {} without a pose",
        pairs_of(todo.len()),
        count(todo.len() - tally.abstained - tally.failed),
        count(tally.abstained),
        count(tally.failed)
    ));
    if before > 0 {
        out.say(&format!("{} done before without a pose: delete their lines to try again", pairs_of(before)));
    }
    Ok(if tally.failed + before > 0 { ExitCode::from(1) } else { ExitCode::SUCCESS })
}

/// `1 pair`, `1,234 pairs`.
fn pairs_of(n: usize) -> String {
    counted(n, "pair")
}

impl BatchArgs {
    /// What the answers depend on besides the clouds.
    fn describe(&self) -> Value {
        let m = &self.method;
        json!({
            "method": m.method,
            "rotation": m.rotation,
            "refine": !m.no_refine,
            "weights": m.weights.weights,
            "seed": m.seed.seed,
            "scale": self.scale.describe(),
        })
    }
}

/// How many pairs went otherwise than hoped.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    abstained: usize,
    failed: usize,
}

struct Batch<'a> {
    pairs: &'a PairList,
    registrar: &'a Registrar,
    described: &'a Value,
    scale: ScaleArgs,
}

impl Batch<'_> {
    /// Each worker takes the next pair, on threads of its own: as long as there are more pairs than threads,
    /// none waits for another.
    fn run(
        &self,
        todo: &[&ListedPair],
        threads: usize,
        results: ResultLines,
        bar: &Progress,
    ) -> Result<Tally, Failure> {
        let workers = threads.min(todo.len()).max(1);
        let next = AtomicUsize::new(0);
        let state = Mutex::new((results, Tally::default(), Ok(())));
        let work = || {
            let pool = ThreadPoolBuilder::new().num_threads((threads / workers).max(1)).build();
            let pool = match pool {
                Ok(pool) => pool,
                Err(e) => {
                    let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
                    state.2 =
                        Err(Failure::failed(format!("cannot start worker threads: {e}; try --threads 1")));
                    return;
                }
            };
            loop {
                let place = next.fetch_add(1, Ordering::Relaxed);
                let Some(row) = todo.get(place) else { return };
                let (value, abstain) = pool.install(|| self.line(row));
                let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
                state.1.abstained += usize::from(abstain == Some(true));
                state.1.failed += usize::from(abstain.is_none());
                if state.2.is_ok() {
                    state.2 = state.0.put(place, &value);
                }
                if state.2.is_err() {
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
        let (_, tally, outcome) = state.into_inner().unwrap_or_else(PoisonError::into_inner);
        outcome.map(|()| tally)
    }

    /// The line of a pair, and whether its pose is doubtful; `None` without a pose.
    fn line(&self, row: &ListedPair) -> (Value, Option<bool>) {
        let (mut value, abstain) = match self.register(row) {
            Ok((value, abstain)) => (value, Some(abstain)),
            Err(failure) => {
                (json!({ "source": row.source, "target": row.target, "error": failure.to_string() }), None)
            }
        };
        if let Value::Object(map) = &mut value {
            map.insert("pair".into(), json!(row.number));
            map.insert("initial".into(), json!(row.initial));
            map.insert("options".into(), self.described.clone());
        }
        (value, abstain)
    }

    fn register(&self, row: &ListedPair) -> Result<(Value, bool), Failure> {
        let mut source = files::read_solid(&self.pairs.path(&row.source), None)?;
        self.scale.apply(&mut source)?;
        let target = files::read_solid(&self.pairs.path(&row.target), None)?;
        let initial = row.initial.as_ref().map(|file| transform::read(&self.pairs.path(file))).transpose()?;
        let request = Request { initial, ..Request::new(&source.cloud, &target.cloud) };
        let found = self.scale.register(self.registrar, &request);
        let mut outcome = found.map_err(|e| failed(e, &source.name, &target.name))?;
        let dropped = [source.dropped, target.dropped];
        outcome.warnings.extend([&source, &target].into_iter().filter_map(left_out));
        Ok((to_json(&outcome, &row.source, &row.target, dropped), outcome.abstain))
    }
}
