//! Fits the probability of [`srrf::Outcome`] and prints how reliable it is.
//!
//! `cargo run --release -p srrf-lab --bin calibrate -- [PAIRS] [MODELNET]` makes PAIRS pairs (default 1,200)
//! from built-in shapes and, if MODELNET is given, from the shapes of ModelNet40's training split that the
//! network was validated on; no test shape is looked at. Every fifth pair is held out for the table; the
//! file `crates/srrf/src/calibration.json` is fitted on all the others.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a program that prints")]

use std::path::Path;

use nalgebra::Matrix3;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use srrf::{Features, Logistic, Options, Registrar, Request, RotationRange};
use srrf_cloud::{PointCloud, Rigid, is_right};
use srrf_corrupt::crop::{crop, random_direction, visible};
use srrf_corrupt::datasets::{ShapeSource, Split, held_out, open};
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::{CorruptionKind, PairConfig, PairSynthesizer, PoseDraw, Sampling, Severity, Stream};
use srrf_lab::{VALIDATION_SHAPES, keep};

const SEED: u64 = 77_001;

struct Example {
    row: String,
    features: Features,
    probability: f64,
    right: bool,
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let count: usize = arguments.next().map_or(1200, |n| n.parse().unwrap());
    let modelnet = arguments.next().map(|path| open(Path::new(&path), Split::Train).unwrap());
    let built_in = ProceduralShapes::new(SEED, 400, None).unwrap();
    let registrars = [RotationRange::Within45, RotationRange::Any]
        .map(|rotation| Registrar::new(Options { rotation, ..Options::default() }).unwrap());

    let examples: Vec<Example> = (0..count)
        .into_par_iter()
        .map(|i| {
            let any = i % 2 == 1;
            let pair = pair(i, any, &built_in, modelnet.as_deref());
            let (row, source, target, truth) = pair;
            let found = registrars[usize::from(any)].register(&Request::new(&source, &target)).unwrap();
            let right = is_right(&found.target_from_source, &truth, &source, &target);
            Example { row, features: found.features, probability: found.probability.get(), right }
        })
        .collect();

    let (held_out, fitted): (Vec<_>, Vec<_>) = examples.iter().enumerate().partition(|(i, _)| i % 5 == 4);
    let pairs_of = |part: &[(usize, &Example)]| -> Vec<(Features, bool)> {
        part.iter().map(|(_, e)| (e.features, e.right)).collect()
    };
    let (fitted, held_out) = (fitted.as_slice(), held_out.as_slice());
    let what = format!(
        "{} pairs of {}; 12 corruptions, clean, cropped and seen from one side, severities 1 to 5, seed {SEED}",
        fitted.len(),
        if modelnet.is_some() {
            "built-in shapes and validation shapes of ModelNet40's training split"
        } else {
            "built-in shapes"
        },
    );
    let model = Logistic::fit(&pairs_of(fitted), 10.0, what).unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/srrf/src/calibration.json");
    std::fs::write(&path, serde_json::to_string_pretty(&model).unwrap() + "\n").unwrap();

    println!("the file that was in the program, on all pairs:");
    reliability(examples.iter().map(|e| (e.probability, e.right)));
    println!("the file that was in the program, on the held-out pairs:");
    reliability(held_out.iter().map(|(_, e)| (e.probability, e.right)));
    println!("the new file, on the held-out pairs:");
    reliability(held_out.iter().map(|(_, e)| (model.probability(&e.features).get(), e.right)));
    println!("the new file, by kind, on all pairs:");
    println!(
        "| pairs | right | mean probability | abstained | right of the others | right of the abstained |"
    );
    println!("|---|---|---|---|---|---|");
    let mut rows: Vec<&str> = examples.iter().map(|e| e.row.as_str()).collect();
    rows.sort_unstable();
    rows.dedup();
    for row in rows {
        let of: Vec<(f64, bool)> = examples
            .iter()
            .filter(|e| e.row == row)
            .map(|e| (model.probability(&e.features).get(), e.right))
            .collect();
        let share = |f: &dyn Fn(&(f64, bool)) -> bool, among: &dyn Fn(&(f64, bool)) -> bool| {
            let all: Vec<_> = of.iter().filter(|x| among(x)).collect();
            match all.len() {
                0 => "-".to_owned(),
                n => format!("{:.2}", all.iter().filter(|x| f(x)).count() as f64 / n as f64),
            }
        };
        let mean = of.iter().map(|(p, _)| p).sum::<f64>() / of.len() as f64;
        println!(
            "| {row} ({}) | {} | {mean:.2} | {} | {} | {} |",
            of.len(),
            share(&|x| x.1, &|_| true),
            share(&|x| x.0 < 0.5, &|_| true),
            share(&|x| x.1, &|x| x.0 >= 0.5),
            share(&|x| x.1, &|x| x.0 < 0.5),
        );
    }
}

/// Pair `i`: name of its row in the table, the clouds and the truth.
fn pair(
    i: usize,
    any: bool,
    built_in: &ProceduralShapes,
    modelnet: Option<&dyn ShapeSource>,
) -> (String, PointCloud, PointCloud, Rigid) {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    rng.set_stream(i as u64);
    let kinds = CorruptionKind::ALL;
    let kind = kinds.get(rng.random_range(0..=kinds.len())).copied();
    let severity = Severity::ALL[rng.random_range(0..5)];
    let sampling = if rng.random_bool(0.4) { Sampling::Independent } else { Sampling::Shared };
    let (shapes, points): (&dyn ShapeSource, usize) = match modelnet {
        Some(shapes) if rng.random_bool(0.5) => {
            (shapes, if sampling == Sampling::Shared { 1024 } else { 512 })
        }
        _ => (built_in, 1024),
    };
    let shape = if points == 512 || shapes.len() > 1000 {
        held_out(shapes.len(), VALIDATION_SHAPES)[rng.random_range(0..VALIDATION_SHAPES)]
    } else {
        rng.random_range(0..shapes.len())
    };
    let pose = if any {
        let axis = random_direction(&mut rng) * rng.random_range(0.0..std::f64::consts::PI);
        let rotation = *nalgebra::Rotation3::from_scaled_axis(axis).matrix();
        PoseDraw::Given(Rigid { rotation, translation: random_direction(&mut rng) * 0.5 })
    } else {
        PoseDraw::Seeded
    };
    let config = PairConfig { points, sampling, keep_correspondence: false, ..PairConfig::default() };
    let synthesizer = PairSynthesizer::new(config).unwrap();
    let stream = Stream { seed: SEED, item: i as u64 };
    let pair = synthesizer.pair(shapes, shape, kind.map(|k| (k, severity)), pose, stream).unwrap();
    let (mut source, mut target) = (pair.source, pair.target);
    let mut row = kind.map_or("clean".to_owned(), |k| k.to_string());
    if rng.random_bool(0.25) {
        row = "cropped".to_owned();
        for cloud in [&mut source, &mut target] {
            let kept = crop(cloud.points(), &random_direction(&mut rng), rng.random_range(0.5..1.0));
            keep(cloud, &kept).unwrap();
        }
    } else if rng.random_bool(0.15) {
        // Two cameras some 40 degrees apart.
        row = "one view".to_owned();
        let camera = random_direction(&mut rng);
        for (cloud, frame) in
            [(&mut source, Matrix3::identity()), (&mut target, pair.target_from_source.rotation)]
        {
            let from = frame * (camera + 0.5 * random_direction(&mut rng)).normalize();
            let kept = visible(cloud.points(), &from, 0.1, 0.15);
            keep(cloud, &kept).unwrap();
        }
    }
    (row, source, target, pair.target_from_source)
}

/// Prints the reliability curve in ten bins, the Brier score and the expected calibration error.
fn reliability(pairs: impl Iterator<Item = (f64, bool)>) {
    let pairs: Vec<(f64, bool)> = pairs.collect();
    let n = pairs.len() as f64;
    let value = |right: bool| f64::from(u8::from(right));
    let brier = pairs.iter().map(|(p, r)| (p - value(*r)).powi(2)).sum::<f64>() / n;
    let mut error = 0.0;
    println!("| probability | pairs | mean probability | right |\n|---|---|---|---|");
    for bin in 0..10 {
        let inside: Vec<_> = pairs.iter().filter(|(p, _)| ((p * 10.0) as usize).min(9) == bin).collect();
        if inside.is_empty() {
            continue;
        }
        let k = inside.len() as f64;
        let mean = inside.iter().map(|(p, _)| p).sum::<f64>() / k;
        let right = inside.iter().map(|(_, r)| value(*r)).sum::<f64>() / k;
        error += k / n * (mean - right).abs();
        println!(
            "| {:.1} to {:.1} | {} | {mean:.2} | {right:.2} |",
            bin as f64 / 10.0,
            (bin + 1) as f64 / 10.0,
            inside.len()
        );
    }
    let right = pairs.iter().filter(|(_, r)| *r).count() as f64 / n;
    println!(
        "{} pairs, right {right:.3}, Brier score {brier:.4}, expected calibration error {error:.3}\n",
        pairs.len()
    );
}
