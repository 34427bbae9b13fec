//! Fits the probability of [`srrf::Outcome`] and writes how reliable it is.
//!
//! `cargo run -p srrf-calibrate --bin calibrate -- --cache FOLDER [--pairs N] [--modelnet DIR] [--scenes TABLE]... [--book DIR] [--write]`
//!
//! N pairs (default 1,200) to fit and a quarter as many to measure, of other seeds and other shapes: corrupted, cropped, seen from one
//! side, few and unrelated points, scales apart, by several methods, with and without a first guess. `--modelnet` adds the shapes
//! of ModelNet40's training split that the network was validated on; `--scenes` adds the public scans of a table
//! (`name,source,target,pose,kind`), every other one for measuring only, and the pairs of meshes that `scripts/other_meshes.py --pairs`
//! writes. No test shape is looked at.
//! The answers are kept in the folder of `--cache`, so that a fit takes seconds; remove it where the program changed.
//! `--write` replaces `crates/srrf/src/calibration.json`, `--kept` fits on kept answers alone. After building again, `--measure` asks the pairs to measure alone, in a new
//! folder, and `--book DIR` writes what the program says of them into the book.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a program that prints")]

mod pairs;
mod report;
mod scenes;

use std::collections::HashMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use clap::Parser;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use srrf::{Calibration, Features, Judge, Logistic, Options, Registrar, Request, ceiling};
use srrf_cloud::is_right;
use srrf_corrupt::datasets::{Split, open};
use srrf_corrupt::shapes::ProceduralShapes;

use pairs::{Case, Group, SEEDS, Shapes, Way, case};

#[derive(Parser)]
struct Arguments {
    /// Where answers are kept
    #[arg(long)]
    cache: PathBuf,
    /// Pairs to fit; a quarter as many more are measured
    #[arg(long, default_value_t = 1200)]
    pairs: u64,
    /// ModelNet40 in HDF5
    #[arg(long)]
    modelnet: Option<PathBuf>,
    /// Tables of scan pairs
    #[arg(long)]
    scenes: Vec<PathBuf>,
    /// Ask the pairs to measure alone, and fit nothing
    #[arg(long, conflicts_with = "write")]
    measure: bool,
    /// Folder for the page of the book
    #[arg(long, requires = "measure")]
    book: Option<PathBuf>,
    /// Replace the calibration in the program
    #[arg(long)]
    write: bool,
    /// Fit on the answers that are kept, and ask for no others: after a change of the features the program has no calibration that it
    /// could answer with
    #[arg(long, conflicts_with = "measure")]
    kept: bool,
    /// Penalty on the squares of the weights
    #[arg(long, default_value_t = 10.0)]
    ridge: f64,
}

/// An answer.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Example {
    /// What it is known by in the cache.
    key: String,
    group: Group,
    kind: String,
    method: String,
    held_out: bool,
    features: Features,
    /// What the program said.
    probability: f64,
    right: bool,
}

fn main() {
    let arguments = Arguments::parse();
    let examples = examples(&arguments);
    let (held_out, fitted): (Vec<&Example>, Vec<&Example>) = examples.iter().partition(|e| e.held_out);
    let page = report::tables(&held_out, |e| e.probability);
    println!("what the program says, held out:\n{page}");
    if arguments.measure {
        return arguments.book.iter().for_each(|book| write_page(book, held_out.len(), &page));
    }
    // What is answered by the ceiling says nothing of the regression.
    let free = fitted.iter().filter(|e| ceiling(&e.features) >= 0.5);
    let of_fit: Vec<(Features, bool)> = free.map(|e| (e.features, e.right)).collect();
    let what = format!(
        "{} answers, seed {}: built-in shapes{}{}; 12 corruptions, clean, cropped and seen from one side, few and unrelated points, scales apart; \
         methods auto, given and fpfh-ransac",
        of_fit.len(),
        SEEDS[0],
        if arguments.modelnet.is_some() { ", validation shapes of ModelNet40's training split" } else { "" },
        if arguments.scenes.is_empty() { "" } else { ", public scans and meshes" },
    );
    let alone: Vec<(Features, bool)> = of_fit.iter().map(|(f, right)| (f.alone(), *right)).collect();
    let among_others = Logistic::fit(&of_fit, arguments.ridge, what.clone()).unwrap();
    let alone = Logistic::fit(&alone, arguments.ridge, what).unwrap();
    let model = Calibration { among_others, alone };
    let judge = Judge::with(model.clone());
    let says = |e: &Example| judge.judge(&e.features).probability.get();
    println!("the new fit, on what it was fitted on:\n{}", report::tables(&fitted, says));
    println!("the new fit, held out:\n{}", report::tables(&held_out, says));
    let by_the_fit = |e: &Example| judge.judge(&e.features).alone.get();
    println!("without other poses, held out:\n{}", report::tables(&held_out, by_the_fit));
    if arguments.write {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../crates/srrf/src/calibration.json");
        fs::write(&path, serde_json::to_string_pretty(&model).unwrap() + "\n").unwrap();
    }
}

fn write_page(book: &Path, pairs: usize, page: &str) {
    let fitted_on = Calibration::embedded().unwrap().among_others.fitted_on;
    let text = format!(
        "<!-- Written by `calibrate --measure --book`: what is changed here by hand is lost. -->\n\n# Reliability by kind\n\nThe regression was \
         fitted on {fitted_on}.\n\nBelow is what the program says of {pairs} others, of seed {} and other shapes.\n\n{page}",
        SEEDS[1]
    );
    fs::write(book.join("calibration.md"), text).unwrap();
}

/// The answers of all pairs, from the cache as far as they are there.
fn examples(arguments: &Arguments) -> Vec<Example> {
    fs::create_dir_all(&arguments.cache).unwrap();
    let path = arguments.cache.join("answers.jsonl");
    let known: HashMap<String, Example> = fs::read_to_string(&path)
        .unwrap_or_default()
        .lines()
        .filter_map(|line| serde_json::from_str::<Example>(line).ok())
        .map(|example| (example.key.clone(), example))
        .collect();
    let cache = Mutex::new(fs::OpenOptions::new().create(true).append(true).open(&path).unwrap());
    let built_in = [0, 1].map(|part| ProceduralShapes::new(SEEDS[part], 400, None).unwrap());
    let modelnet = arguments.modelnet.as_ref().map(|path| open(path, Split::Train).unwrap());
    let registrars: Mutex<Vec<(Way, &'static Registrar)>> = Mutex::new(Vec::new());

    let answer = |key: String, held_out: bool, make: &dyn Fn() -> Option<Case>| -> Option<Example> {
        if let Some(example) = known.get(&key) {
            return Some(example.clone());
        }
        if arguments.kept {
            return None;
        }
        let case = make()?;
        let registrar = {
            let mut made = registrars.lock().unwrap();
            let known = made.iter().find(|(way, _)| *way == case.way).map(|(_, registrar)| *registrar);
            known.unwrap_or_else(|| {
                // Scales apart are to be answered here, not asked about.
                let options = Options {
                    method: case.way.method,
                    rotation: case.way.rotation,
                    check_scale: false,
                    ..Options::default()
                };
                let registrar: &'static Registrar = Box::leak(Box::new(Registrar::new(options).unwrap()));
                made.push((case.way, registrar));
                registrar
            })
        };
        let request = Request { initial: case.initial, ..Request::new(&case.source, &case.target) };
        let found = registrar.register(&request).ok()?;
        let right = case
            .truth
            .is_some_and(|truth| is_right(&found.target_from_source, &truth, &case.source, &case.target));
        let example = Example {
            key,
            group: case.group,
            kind: case.kind,
            method: case.way.method.name().into(),
            held_out,
            features: found.features,
            probability: found.probability.get(),
            right,
        };
        let line = serde_json::to_string(&example).unwrap() + "\n";
        cache.lock().unwrap().write_all(line.as_bytes()).unwrap();
        Some(example)
    };
    // A quarter as many more to measure, among the others, so that a part of the whole has both.
    let numbers: Vec<(u64, usize)> = (0..arguments.pairs + arguments.pairs / 4)
        .map(|i| if i % 5 == 4 { (i / 5, 1) } else { (i - i / 5, 0) })
        .filter(|(_, part)| *part == 1 || !arguments.measure)
        .collect();
    let mut all: Vec<Example> = numbers
        .into_par_iter()
        .filter_map(|(item, part)| {
            let shapes = Shapes { built_in: &built_in[part], modelnet: modelnet.as_deref() };
            answer(format!("{item}/{part}"), part == 1, &|| case(item, part, &shapes))
        })
        .collect();
    for table in &arguments.scenes {
        for scene in scenes::read(table).unwrap().into_iter().filter(|s| s.held_out() || !arguments.measure) {
            let tries = (0..scene.tries()).filter_map(|number| {
                answer(format!("{} {number}", scene.name), scene.held_out(), &|| Some(scene.case(number)))
            });
            all.extend(tries);
        }
    }
    all
}
