//! The report, put together from what was measured.

use std::path::{Path, PathBuf};

use srrf_cloud::{PointCloud, Register};
use srrf_corrupt::Pair;

use super::options::TablesOptions;
use super::{Measured, TablesEvidence, TablesRun, chosen, losses, plan, thresholds};
use crate::EvalError;
use crate::method_set::MethodSet;
use crate::methods::MethodContext;
use crate::pairs::PairSource;
use crate::protocol::{MIDDLE, SynthesizedPairs};
use crate::report::document::{Document, Picture, Section};
use crate::report::figures;
use crate::report::sheet::Sheet;
use crate::report::sheets::{self, Column};
use crate::rows::TableRow;
use crate::summary::SeverityKey;

/// Rows of table 4: DCP, or what stands in for it.
pub(super) static SAMPLED_ROWS: [TableRow; 4] =
    [TableRow::ICP, TableRow::DCP, TableRow::SRRF_DENSE, TableRow::SRRF];

/// Rows of the picture of registrations.
const DRAWN_ROWS: [TableRow; 3] = [TableRow::ICP, TableRow::SRRF, TableRow::SRRF_REFINE];

/// Puts the report together.
pub(super) fn document(
    options: &TablesOptions,
    stage: &TablesRun<'_>,
    evidence: &TablesEvidence,
    context: &MethodContext,
) -> Result<Document, EvalError> {
    let mut sections = Vec::new();
    let same = evidence.same_shapes(options);
    if let Some(main) = evidence.parts.get("main") {
        sections.push(main_section(main));
        sections.push(probability_section(main));
        sections.push(losses_section(main));
    }
    if let Some(same) = same {
        sections.push(severity_section(same)?);
    }
    if let Some(main) = evidence.parts.get("main") {
        let pairs = stage.pairs(plan::main_protocol(options, stage.shapes))?;
        sections.push(pictures(stage, evidence, &pairs, main, context)?);
        sections.push(views(evidence, &pairs, main)?);
    }
    if let Some(clean) = evidence.parts.get("clean-trained") {
        let mut section = Section::new("clean-trained", "Models trained on clean pairs");
        section.text.push("The same pairs as above; the network never saw a corruption in training.".into());
        section.sheets = sheets::paper_tables(&clean.summary, "-clean-trained");
        sections.push(section);
    }
    if let Some(partial) = evidence.parts.get("partial") {
        sections.push(partial_section(partial));
    }
    sections.push(sampling_section(stage, evidence)?);
    sections.push(skeleton_section(evidence, same));
    sections.push(ablations(evidence, same));
    if let Some(main) = evidence.parts.get("main") {
        let mut section = Section::new("costs", "Time");
        section.sheets.push(sheets::costs(&main.summary));
        sections.push(section);
    }
    sections.retain(|s| !s.is_empty());
    let mut facts = facts(options, evidence);
    let texts = sections.iter_mut().flat_map(|section| &mut section.text);
    for text in texts.chain(facts.iter_mut().map(|(_, value)| value)) {
        *text = without_place(options.data.as_deref(), text);
    }
    Ok(Document { title: "Registration of corrupted pairs: report".into(), facts, sections })
}

/// Where the numbers come from. Nothing here differs between two runs of the same command.
fn facts(options: &TablesOptions, evidence: &TablesEvidence) -> Vec<(String, String)> {
    let mut facts = Vec::new();
    let mut fact = |name: &str, value: String| facts.push((name.to_owned(), value));
    if let Some(measured) = evidence.parts.get("main").or_else(|| evidence.parts.values().next()) {
        fact("Data", measured.data.clone());
    }
    fact("Shapes", evidence.shapes.to_string());
    fact("Seed", options.seed.to_string());
    for (method, weights) in &evidence.weights {
        fact(&format!("Weights of {method}"), weights.clone());
    }
    for (name, reason) in evidence.methods.left_out.iter().chain(&evidence.missing) {
        fact(&format!("Left out: {name}"), reason.clone());
    }
    // The places of the program, of the data and of the report are no part of the command.
    let arguments: Vec<String> = std::env::args().skip(1).map(|argument| without_folder(&argument)).collect();
    fact("Command", format!("srrf-eval {}", arguments.join(" ")));
    fact("Program", format!("srrf-eval {}, device {}", env!("CARGO_PKG_VERSION"), options.device));
    fact("Machine", crate::report::machine());
    fact("Time of all answers", format!("{:.0} s on one thread each", seconds(evidence)));
    facts
}

/// An argument; of an absolute path, also behind a `=`, its last part alone.
fn without_folder(argument: &str) -> String {
    let (flag, value) = match argument.split_once('=') {
        Some((flag, value)) if flag.starts_with('-') => (format!("{flag}="), value),
        _ => (String::new(), argument),
    };
    let path = Path::new(value);
    match path.file_name() {
        Some(name) if path.is_absolute() => format!("{flag}{}", name.to_string_lossy()),
        _ => argument.to_owned(),
    }
}

/// `text`, with `PATH` where it names the place of the data: pages are read elsewhere.
fn without_place(data: Option<&Path>, text: &str) -> String {
    match data.map(Path::to_string_lossy) {
        Some(place) if !place.is_empty() => text.replace(&*place, "PATH"),
        _ => text.to_owned(),
    }
}

/// Sum of the times of all answers; branches of one answer count once.
fn seconds(evidence: &TablesEvidence) -> f64 {
    let of = |measured: &Measured| -> f64 {
        let rows = &measured.outcome.rows;
        let whole = |row: &TableRow| {
            rows.iter().any(|r| matches!((r, row), (TableRow::Method(a), TableRow::Branch(b, _)) if a == b))
        };
        let counted: Vec<usize> = (0..rows.len()).filter(|&i| !whole(&rows[i])).collect();
        let answers = measured.outcome.records.iter().flat_map(|r| counted.iter().map(|&i| &r.answers[i]));
        answers.filter_map(|a| a.seconds).sum()
    };
    evidence.parts.values().chain(evidence.variants.iter().map(|(_, m)| m)).map(of).sum()
}

fn losses_section(main: &Measured) -> Section {
    let mut section = Section::new("losses", "Where SRRF loses");
    section.text.push("Every place where the printed digits say so, mean of the severities.".into());
    section.list = losses::losses(&main.summary);
    section
}

fn main_section(main: &Measured) -> Section {
    let mut section = Section::new("tables", "Tables 1 to 3: models trained with corruption");
    section.text.push(
        "Both clouds corrupted independently, before the exact pose. RMSE and MAE are over the three Euler angles \
         (DCP's convention) and the three components of the translation, from one array of errors; a pair on which \
         a method fails counts as the identity. Recall: under 5 degrees and 0.1."
            .into(),
    );
    section.sheets.extend(sheets::rankings(&main.summary));
    section.sheets.extend(sheets::paper_tables(&main.summary, ""));
    section.sheets.extend(sheets::symmetry(&main.summary));
    section
}

fn probability_section(main: &Measured) -> Section {
    let mut section = Section::new("probability", "How well the product knows whether it is right");
    section.sheets.extend(sheets::probability(&main.summary));
    section
}

fn partial_section(partial: &Measured) -> Section {
    let mut section = Section::new("partial", "Partial overlap");
    section.text.push(format!("{}. The crop is that of RPMNet's partial pairs; theirs have noise as well, and here the clouds share exact points where they overlap, so that these pairs are easier.", partial.data));
    let title = "Clean pairs, of each of which a crop keeps 70 percent of the points";
    section.sheets.push(sheets::plain("partial", title, "", &partial.summary));
    section.sheets.extend(
        sheets::probability(&partial.summary).map(|s| Sheet { key: "partial-probability".into(), ..s }),
    );
    section
}

fn severity_section(same: &Measured) -> Result<Section, EvalError> {
    let mut section = Section::new("severity", "Error against severity");
    section.text.push(format!("{}; the same in every column.", same.data));
    section.figures = figures::severity_curves(&same.summary)?;
    section.sheets = sheets::severities(&same.summary, "severity", true);
    Ok(section)
}

/// Corruptions, registrations, weights and samplings.
fn pictures(
    stage: &TablesRun<'_>,
    evidence: &TablesEvidence,
    pairs: &SynthesizedPairs,
    main: &Measured,
    context: &MethodContext,
) -> Result<Section, EvalError> {
    let mut section = Section::new("pictures", "Pictures");
    let same = stage.pairs(plan::same_shapes_protocol(stage.options, stage.shapes))?;
    section.figures.extend(figures::corruption_sheet(&same, same.groups()[0].pairs / 3)?);
    section.figures.extend(figures::registrations(pairs, &main.outcome, &DRAWN_ROWS)?);
    if evidence.methods.method(&TableRow::SRRF).is_some() {
        let shown = |count: usize| {
            let count = count.min(main.outcome.groups[0].pairs);
            let items = (0..count).map(|i| i * main.outcome.groups[0].pairs / count);
            items
                .map(|item| Ok(pairs.pair(0, item)?.pair.source))
                .collect::<Result<Vec<PointCloud>, EvalError>>()
        };
        let clouds = shown(3)?;
        let clouds: Vec<&PointCloud> = clouds.iter().collect();
        section.figures.push(figures::weights(context, &clouds)?);
        section.figures.push(figures::samplings(context, &clouds, stage.options.seed)?);
        section.figures.extend(skeleton_picture(stage, evidence, pairs, main)?);
    }
    Ok(section)
}

/// Skeletons of pairs of several corruptions, by the network and, where there is one, by the network
/// that was trained without the loss.
fn skeleton_picture(
    stage: &TablesRun<'_>,
    evidence: &TablesEvidence,
    pairs: &SynthesizedPairs,
    main: &Measured,
) -> Result<Option<Picture>, EvalError> {
    let network = |weights: Option<PathBuf>| -> Result<Option<MethodSet>, EvalError> {
        let context = |weights| MethodContext::of_srrf(Some(weights), &stage.options.device);
        weights.map(|weights| MethodSet::of_rows(&[TableRow::SRRF], false, &context(weights))).transpose()
    };
    let (with, without) = (network(stage.options.with_loss())?, network(stage.options.without_loss())?);
    let mut networks: Vec<(&str, &dyn Register)> = Vec::new();
    if let Some(method) = without.as_ref().and_then(|set| set.method(&TableRow::SRRF)) {
        networks.push(("without the loss", &*method.register));
    }
    let with = with.as_ref().unwrap_or(&evidence.methods).method(&TableRow::SRRF);
    let Some(method) = with else { return Ok(None) };
    networks.push(("with the loss", &*method.register));
    let mut shown: Vec<(String, Pair)> = Vec::new();
    for wanted in ["density_dec", "cutout", "gaussian", "background", "shear", "distortion_rbf"] {
        let group = main.outcome.groups.iter().position(|g| g.corruption == wanted && g.severity == 3);
        let Some(group) = group else { continue };
        let item = (shown.len() * 5 + 1) % main.outcome.groups[group].pairs;
        shown.push((wanted.to_owned(), pairs.pair(group, item)?.pair));
    }
    Ok(figures::agreement(&networks, &shown))
}

fn views(evidence: &TablesEvidence, pairs: &SynthesizedPairs, main: &Measured) -> Result<Section, EvalError> {
    let mut section = Section::new("pairs", "Chosen pairs in 3D");
    section.text.push(
        "A typical pair of each corruption at severity 3 (median error of srrf among shapes without an axis of \
         symmetry) and three of the worst. Choose a pair and a pose; drag to turn."
            .into(),
    );
    let network = evidence.methods.method(&TableRow::SRRF).map(|m| &*m.register as &dyn Register);
    section.html = chosen::viewer(pairs, &main.outcome, network)?;
    Ok(section)
}

fn sampling_section(stage: &TablesRun<'_>, evidence: &TablesEvidence) -> Result<Section, EvalError> {
    let mut section = Section::new("table4", "Table 4: few points, chosen in three ways");
    let Some(measured) = evidence.parts.get("table4") else { return Ok(section) };
    section.text.push(format!("{}.", measured.data));
    section.sheets.push(sheets::plain(
        "table4",
        "Table 4: clean pairs reduced to few points",
        "Corresponding subsets are one subset of the source, posed: their points match exactly. Independent ones \
         are chosen in each cloud by itself; both clouds show the same points of the shape, in another order. The \
         paper (DCP, RMSE(R) / MAE(R)): original 2.564 / 1.513, random 2.205 / 1.370, farthest point 2.297 / 1.288, \
         skeleton 1.464 / 0.888.",
        &measured.summary,
    ));
    let row = SAMPLED_ROWS.iter().rev().find(|r| measured.outcome.rows.contains(r));
    if let (Some(row), Some(method)) = (row, evidence.methods.method(&TableRow::SRRF)) {
        let pairs = stage.sampled(&*method.register)?;
        section.figures.extend(figures::sampled_registrations(&pairs, &measured.outcome, row, 0)?);
    }
    Ok(section)
}

fn skeleton_section(evidence: &TablesEvidence, same: Option<&Measured>) -> Section {
    let mut section = Section::new("table5", "Table 5: skeletons");
    let of = |part: &str| evidence.parts.get(part).map(|m| &m.summary);
    if let Some(with) = of("with-loss").or(same.map(|m| &m.summary)) {
        section.sheets.extend(sheets::table5(with, of("without-loss")));
    }
    section
}

fn ablations(evidence: &TablesEvidence, same: Option<&Measured>) -> Section {
    let mut section = Section::new("ablations", "Ablations");
    section.text.push(
        "Dense branch, skeleton branch and fusion are rows of every table. The number of skeleton points is fixed by \
         the weights: its ablation needs networks trained with other numbers (`--variant`)."
            .into(),
    );
    let middle = SeverityKey::One(MIDDLE.get());
    let compared = [
        (
            "one-sided",
            "One or both clouds corrupted",
            "both",
            "target only",
            "Severity 3, the same shapes and poses.",
        ),
        (
            "independent",
            "Shared or independent sampling",
            "shared",
            "independent",
            "Severity 3. Shared: both clouds start from the same points of the shape. Independent: from disjoint \
             halves of a stored cloud, each of half the points, filled up by repeats, or from two samplings of a \
             surface.",
        ),
    ];
    for (key, title, first, second, note) in compared {
        if let (Some(same), Some(other)) = (same, evidence.parts.get(key)) {
            let columns = [
                Column { name: first, summary: &same.summary, severity: middle },
                Column { name: second, summary: &other.summary, severity: middle },
            ];
            section.sheets.extend(sheets::compare(key, title, note, &columns));
        }
    }
    if let (Some(same), Some(beyond)) = (same, evidence.parts.get("beyond")) {
        let at = |summary, severity| Column {
            name: ["s = 5", "s = 6", "s = 7"][usize::from(severity) - 5],
            summary,
            severity: SeverityKey::One(severity),
        };
        let columns = [at(&same.summary, 5), at(&beyond.summary, 6), at(&beyond.summary, 7)];
        let note = "Training knew severities 1 to 5. Beyond, every parameter goes on by its step from 4 to 5; \
                    upsampling, which copies every point at 5, has no more to copy.";
        section.sheets.extend(sheets::compare("beyond", "Beyond the severities of training", note, &columns));
    }
    if let (Some(same), false) = (same, evidence.variants.is_empty()) {
        let mut columns = vec![Column { name: "default", summary: &same.summary, severity: middle }];
        for (name, measured) in &evidence.variants {
            columns.push(Column { name, summary: &measured.summary, severity: middle });
        }
        let note = "Severity 3, the same pairs.";
        section.sheets.extend(sheets::compare("variants", "Networks trained otherwise", note, &columns));
    }
    if let Some(mixtures) = evidence.parts.get("mixtures") {
        let columns = [Column { name: "s = 3", summary: &mixtures.summary, severity: middle }];
        let note = "Two corruptions at once, one after the other; and `local`: only the half of the points farthest in \
                    a random direction, another one in each cloud.";
        section.sheets.extend(sheets::compare("mixtures", "Heterogeneous corruption", note, &columns));
    }
    if let Some(measured) = evidence.parts.get("thresholds") {
        let title = "Inlier test and threshold of the integration, severity 3";
        section.sheets.push(sheets::plain("thresholds", title, thresholds::NOTE, &measured.summary));
    }
    section
}
