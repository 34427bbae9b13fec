//! `srrf-eval tables`: the paper's tables and figures, our ablations, and one page to look at it all.
//!
//! 1. [`MethodSet`] sets up the methods, `plan` says which pairs each experiment scores;
//! 2. every experiment goes through [`Run`] and the [`Cache`], the same path as the plain command;
//! 3. `sections` joins tables, pictures and views of the summaries into a document;
//! 4. [`report`] writes it into the folder.

mod chosen;
mod losses;
mod options;
mod plan;
mod sampling;
mod sections;
mod thresholds;

use std::collections::BTreeMap;

pub use options::TablesOptions;

use srrf_args::flags::Threads;

use crate::answers::RunOutcome;
use crate::cache::Cache;
use crate::cli::shared::weights_by_method;
use crate::method_set::{DefaultRows, MethodSet};
use crate::methods::{MethodContext, ReadyMethod, registry};
use crate::pairs::PairSource;
use crate::protocol::{MIDDLE, Protocol, SynthesizedPairs};
use crate::report::book;
use crate::report::numbers::numbers;
use crate::report::write::{self, ReportPart};
use crate::rows::TableRow;
use crate::run::Run;
use crate::summary::Summary;
use crate::{EvalError, data, report};
use sampling::SampledPairs;

/// Built-in shapes that are scored without data.
const BUILT_IN_SHAPES: usize = 20;

/// What [`make`] says while it works.
pub enum TablesProgress<'a> {
    /// A line for the reader.
    Line(&'a str),
    /// An experiment begins: its title, its pairs.
    Start(&'a str, usize),
    /// So many pairs are done; the last was of this group.
    Done(usize, &'a str),
}

/// Where progress goes.
type Listener<'a> = &'a mut (dyn FnMut(TablesProgress<'_>) + Send);

/// A scored experiment.
struct Measured {
    outcome: RunOutcome,
    summary: Summary,
    data: String,
}

/// Everything that was measured, by part of the report.
struct TablesEvidence {
    parts: BTreeMap<&'static str, Measured>,
    /// Networks that were trained otherwise, by name.
    variants: Vec<(String, Measured)>,
    methods: MethodSet,
    /// For each method that learns, its weights.
    weights: BTreeMap<String, String>,
    /// Parts that were wanted and could not be made, and why.
    missing: Vec<(String, String)>,
    shapes: usize,
}

impl TablesEvidence {
    /// All severities on the same shapes, which ablations are compared with: the main tables, where each of
    /// their shapes is shown at every severity.
    fn same_shapes(&self, options: &TablesOptions) -> Option<&Measured> {
        self.parts.get("severity").or_else(|| self.parts.get("main").filter(|_| !options.spread))
    }
}

/// Makes the report and gives the names of the files written.
///
/// # Errors
/// [`EvalError`] where data, weights or folders cannot be used.
pub fn make(options: &TablesOptions, say: Listener<'_>) -> Result<Vec<String>, EvalError> {
    let weights = weights_by_method(&options.weights);
    let context = MethodContext { weights, device: options.device.clone() };
    let methods = MethodSet::new(&options.methods, DefaultRows::Tables, &context)?;
    report::prepare(&options.out)?;
    options.book.as_deref().map_or(Ok(()), report::prepare)?;
    let cache = Cache::open(&options.cache_folder(), &options.device)?;
    for (name, reason) in &methods.left_out {
        say(TablesProgress::Line(&format!("left out: {name}: {reason}")));
    }
    let shapes = match options.shapes {
        Some(shapes) => shapes,
        None => data::open(options.data.as_deref(), BUILT_IN_SHAPES)?.len(),
    };
    let stage = TablesRun { options, cache: &cache, shapes };
    let mut parts = BTreeMap::new();
    for experiment in plan::experiments(options, shapes, &methods) {
        let pairs = stage.pairs(experiment.protocol)?;
        let measured = stage.score(experiment.title, &pairs, &methods.methods, experiment.rows, say)?;
        parts.insert(experiment.key, measured);
    }
    let weights = methods.weights();
    let mut evidence =
        TablesEvidence { parts, variants: Vec::new(), methods, weights, missing: Vec::new(), shapes };
    if evidence.same_shapes(options).is_none() {
        let parts = plan::COMPARED.into_iter().filter(|part| evidence.parts.contains_key(part));
        let compared = parts.chain(options.variant.iter().map(|(name, _)| name.as_str()));
        let base = if options.spread { "severity" } else { "main" };
        let reason = format!("it is compared with the part `{base}`, which --parts leaves out");
        evidence.missing.extend(compared.map(|part| (part.to_owned(), reason.clone())));
    }
    stage.other_weights(&mut evidence, say)?;
    stage.variants(&mut evidence, say)?;
    stage.thresholds(&mut evidence, &context, say)?;
    stage.samples(&mut evidence, say)?;
    say(TablesProgress::Line(&format!("{} answers were taken from the cache", cache.reused())));
    let document = sections::document(options, &stage, &evidence, &context)?;
    let parts = evidence.parts.iter().map(|(part, measured)| (*part, measured));
    let variants = evidence.variants.iter().map(|(name, measured)| (name.as_str(), measured));
    let parts: Vec<ReportPart<'_>> = parts
        .chain(variants)
        .map(|(part, measured)| ReportPart { part, data: &measured.data, summary: &measured.summary })
        .collect();
    let mut written = write::all(&options.out, &document, &parts)?;
    if let Some(folder) = &options.book {
        let of = |part: &str| evidence.parts.get(part).map(|measured| &measured.summary);
        let numbers = numbers(&document, of("main"), of("partial"));
        let files = book::write(folder, &document, &numbers)?;
        written.extend(files.into_iter().map(|name| folder.join(name).display().to_string()));
    }
    Ok(written)
}

/// What all experiments share.
struct TablesRun<'a> {
    options: &'a TablesOptions,
    cache: &'a Cache,
    shapes: usize,
}

impl TablesRun<'_> {
    /// The protocol of ablations at one severity.
    fn middle(&self) -> Protocol {
        let same = plan::same_shapes_protocol(self.options, self.shapes);
        Protocol { severities: vec![MIDDLE], ..same }
    }

    fn pairs(&self, protocol: Protocol) -> Result<SynthesizedPairs, EvalError> {
        let source = data::open(self.options.data.as_deref(), protocol.shapes)?;
        SynthesizedPairs::new(source, protocol)
    }

    fn score(
        &self,
        title: &str,
        pairs: &dyn PairSource,
        methods: &[ReadyMethod],
        rows: Vec<TableRow>,
        say: Listener<'_>,
    ) -> Result<Measured, EvalError> {
        say(TablesProgress::Start(title, pairs.groups().iter().map(|g| g.pairs).sum()));
        let threads = Threads { threads: self.options.threads }.count();
        let run = Run { pairs, methods, transforms: Vec::new(), rows, threads, cache: Some(self.cache) };
        let outcome = run.execute(&mut |done, group| say(TablesProgress::Done(done, group)))?;
        Ok(Measured { summary: Summary::of(&outcome)?, outcome, data: pairs.description() })
    }

    /// The models of the other tables: trained clean, and the network trained without the loss.
    fn other_weights(&self, evidence: &mut TablesEvidence, say: Listener<'_>) -> Result<(), EvalError> {
        let options = self.options;
        let main = plan::main_protocol(options, self.shapes);
        let middle = self.middle();
        let of_srrf = |weights| MethodContext::of_srrf(weights, &options.device).weights;
        let (ddl, no_ddl) = (of_srrf(options.with_loss()), of_srrf(options.without_loss()));
        let clean = options.clean_models();
        let wanted = [
            ("clean-trained", "clean-trained", "models trained clean", clean, main, "--clean-weights"),
            ("table5", "with-loss", "skeletons with the loss", ddl, middle.clone(), "--ddl-weights"),
            ("table5", "without-loss", "skeletons without the loss", no_ddl, middle, "--no-ddl-weights"),
        ];
        for (part, key, title, weights, protocol, switch) in wanted {
            if !options.wants(part) || (key == "with-loss" && weights.is_empty()) {
                continue; // without weights of their own, table 5 takes those of the main tables
            }
            if weights.is_empty() {
                let reason = format!("no such weights are in the program; give a file with {switch}");
                evidence.missing.push((title.to_owned(), reason));
                continue;
            }
            let entries = registry().iter().filter(|m| weights.contains_key(m.name));
            let rows: Vec<TableRow> = entries.flat_map(|m| m.rows()).collect();
            let context = MethodContext { weights, device: options.device.clone() };
            let set = MethodSet::of_rows(&rows, false, &context)?;
            let measured = self.score(title, &self.pairs(protocol)?, &set.methods, set.rows.clone(), say)?;
            evidence.parts.insert(key, measured);
            let named = |(method, weights)| (format!("{method}, {title}"), weights);
            evidence.weights.extend(set.weights().into_iter().map(named));
        }
        Ok(())
    }

    /// The networks of `--variant`.
    fn variants(&self, evidence: &mut TablesEvidence, say: Listener<'_>) -> Result<(), EvalError> {
        for (name, weights) in &self.options.variant {
            let context = MethodContext::of_srrf(Some(weights.clone()), &self.options.device);
            let set = MethodSet::of_rows(&TableRow::NETWORK, false, &context)?;
            let pairs = self.pairs(self.middle())?;
            let measured = self.score(name, &pairs, &set.methods, set.rows.clone(), say)?;
            evidence.weights.extend(set.weights().into_values().map(|w| (name.clone(), w)));
            evidence.variants.push((name.clone(), measured));
        }
        Ok(())
    }

    /// The variants of the integration.
    fn thresholds(
        &self,
        evidence: &mut TablesEvidence,
        context: &MethodContext,
        say: Listener<'_>,
    ) -> Result<(), EvalError> {
        if !self.options.wants("thresholds") || evidence.methods.method(&TableRow::SRRF).is_none() {
            return Ok(());
        }
        let methods = thresholds::methods(context)?;
        let protocol =
            Protocol { clean: false, corruptions: thresholds::CORRUPTIONS.to_vec(), ..self.middle() };
        let rows = methods.iter().flat_map(ReadyMethod::rows).collect();
        let measured = self.score("inlier thresholds", &self.pairs(protocol)?, &methods, rows, say)?;
        evidence.parts.insert("thresholds", measured);
        Ok(())
    }

    /// Table 4.
    fn samples(&self, evidence: &mut TablesEvidence, say: Listener<'_>) -> Result<(), EvalError> {
        if !self.options.wants("table4") {
            return Ok(());
        }
        let rows = evidence.methods.only(&sections::SAMPLED_ROWS);
        let Some(network) = evidence.methods.method(&TableRow::SRRF).filter(|_| !rows.is_empty()) else {
            return Ok(());
        };
        if !rows.contains(&TableRow::DCP) {
            let reason = "DCP has no weights here; other methods stand in".to_owned();
            evidence.missing.push(("DCP in table 4".to_owned(), reason));
        }
        let pairs = self.sampled(&*network.register)?;
        let measured = self.score("samples of clean pairs", &pairs, &evidence.methods.methods, rows, say)?;
        evidence.parts.insert("table4", measured);
        Ok(())
    }

    /// The pairs of table 4.
    fn sampled<'a>(&self, skeletons: &'a dyn srrf_cloud::Register) -> Result<SampledPairs<'a>, EvalError> {
        let same = plan::same_shapes_protocol(self.options, self.shapes);
        let clean = self.pairs(Protocol { corruptions: Vec::new(), severities: Vec::new(), ..same })?;
        // As many points as the skeletons of the network have, so that only the choice differs.
        let first = clean.pair(0, 0)?.pair;
        let found = skeletons.register(&first.source, &first.target).ok();
        let count = found.and_then(|f| f.skeletons).map_or(64, |s| s.source.points.len());
        Ok(SampledPairs::new(clean, skeletons, count, self.options.seed))
    }
}
