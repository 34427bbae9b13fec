//! `srrf-eval`: scores registration methods on clean and corrupted pairs.

use std::process::ExitCode;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use srrf_args::{Failure, Output, OutputLock, Progress, interrupt, run_program};
use srrf_cloud::profile;
use srrf_eval::tables::{self, TablesProgress};
use srrf_eval::{
    DefaultRows, EvalCommand, EvalError, EvalOptions, Meta, MethodContext, MethodSet, PairFile, PairSource,
    Run, Summary, SynthesizedPairs, TablesOptions, Transforms, data, report,
};

fn main() -> ExitCode {
    srrf_model::keep_freed_memory();
    run_program(|options: EvalOptions| {
        interrupt::install()?;
        match &options.command {
            Some(EvalCommand::Scripts(scripts)) => return scripts.run(srrf_eval::command()),
            Some(EvalCommand::Tables(tables)) => {
                interrupt::advise("; the same command goes on where this one stopped");
                tables.check_places()?;
                report::prepare(&tables.out)?;
                let _lock = OutputLock::take(&tables.out.join("report"))?;
                make_tables(tables)?;
            }
            None => {
                options.check_places()?;
                run(&options)?;
            }
        }
        Ok(ExitCode::SUCCESS)
    })
}

fn run(options: &EvalOptions) -> Result<(), Failure> {
    let (start, threads) = (Instant::now(), options.thread_count());
    if options.profile {
        profile::start();
    }
    let context = MethodContext { weights: options.weights_by_method(), device: options.device.clone() };
    let mut set = MethodSet::new(&options.methods, DefaultRows::Plain, &context)?.without_held();
    report::prepare(&options.out)?;
    let _lock = OutputLock::take(&options.out.join("report"))?;
    let _lock_of_pairs = options.export_pairs.as_deref().map(OutputLock::take).transpose()?;
    let pairs = open_pairs(options)?;
    say(&format!("data: {}", pairs.description()));
    if options.pairs.is_none() {
        say(&format!("seed: {}", options.seed));
    }

    let transforms = options
        .transforms
        .iter()
        .map(|path| Transforms::read(path, pairs.groups(), &options.reading()))
        .collect::<Result<Vec<_>, _>>()?;
    set.add_transforms(&transforms)?;
    if !pairs.has_oracle() {
        set.drop_oracle(!options.methods.is_empty())?;
    }
    if set.rows.is_empty() {
        return Err(EvalError::Usage("no method is left to score".into()).into());
    }
    let weights = set.weights();
    if weights.is_empty() {
        say("weights: none are needed, since no method that learns is run");
    }
    weights.iter().for_each(|(name, weights)| say(&format!("weights of {name}: {weights}")));
    let bar = Progress::auto();
    if let Some(path) = &options.export_pairs {
        bar.counted("exporting", count(pairs.as_ref()), "pairs");
        srrf_eval::export(pairs.as_ref(), path, &mut || bar.advance(1))?;
        bar.clear();
        say(&format!("pairs written to {}", path.display()));
    }

    bar.counted("scoring", count(pairs.as_ref()), "pairs");
    let run = Run {
        pairs: pairs.as_ref(),
        methods: &set.methods,
        transforms,
        rows: set.rows.clone(),
        threads,
        cache: None,
    };
    let outcome = run.execute(&mut |done, _| bar.advance(done))?;
    bar.clear();

    let summary = Summary::of(&outcome)?;
    let meta = Meta {
        version: env!("CARGO_PKG_VERSION").into(),
        command: std::env::args().collect::<Vec<_>>().join(" "),
        data: pairs.description(),
        seed: options.seed,
        weights,
        device: options.device.clone(),
        threads,
        machine: report::machine(),
        seconds: start.elapsed().as_secs_f64(),
        started_unix: SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map_or(0, |d| d.as_secs().saturating_sub(start.elapsed().as_secs())),
    };
    let written = report::write(&options.out, &meta, &summary, &outcome)?;
    say("");
    say(&report::screen(&summary));
    if options.profile {
        say(&profile::report().to_string());
    }
    let names: Vec<String> =
        written.iter().filter_map(|p| Some(p.file_name()?.to_string_lossy().into_owned())).collect();
    say(&format!(
        "{} pairs in {:.1} s; written to {}: {}",
        outcome.records.len(),
        meta.seconds,
        options.out.display(),
        names.join(", ")
    ));
    Ok(())
}

/// The report of `srrf-eval tables`.
fn make_tables(options: &TablesOptions) -> Result<(), EvalError> {
    let bar = Progress::auto();
    let written = tables::make(options, &mut |progress| match progress {
        TablesProgress::Line(line) => {
            bar.clear();
            say(line);
        }
        TablesProgress::Start(title, pairs) => {
            bar.clear();
            say(&format!("{title}: {pairs} pairs"));
            bar.counted(title, pairs, "pairs");
        }
        TablesProgress::Done(pairs, _) => bar.advance(pairs),
    })?;
    bar.clear();
    say(&format!("written to {}: {}", options.out.display(), written.join(", ")));
    Ok(())
}

/// The pairs of a file, or pairs made from shapes.
fn open_pairs(options: &EvalOptions) -> Result<Box<dyn PairSource>, EvalError> {
    if let Some(path) = &options.pairs {
        return Ok(Box::new(PairFile::read(path, &options.reading())?));
    }
    let protocol = options.protocol()?;
    let shapes = data::open(options.data.as_deref(), protocol.shapes)?;
    Ok(Box::new(SynthesizedPairs::new(shapes, protocol)?))
}

/// How many pairs there are.
fn count(pairs: &dyn PairSource) -> usize {
    pairs.groups().iter().map(|g| g.pairs).sum()
}

/// A line on standard output; a closed pipe is no reason to stop before the report is written.
fn say(line: &str) {
    Output::Standard.say(line);
}
