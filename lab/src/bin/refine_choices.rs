//! What the refinement makes of the network's own poses, on the shapes of ModelNet40's training split that the
//! network was validated on; no test shape is looked at. One CSV line a pair: the errors of the network, of the full
//! refinement, of a cautious one, of halfway between the network and that, and of the answer by the rule, beside
//! what the rule sees.
//!
//! `cargo run --release -p srrf-lab --bin refine_choices -- MODELNET [EVERY [ROW]] > choices.csv` takes every so many of
//! these shapes (default: each); every other one of the 192 gives its place to a built-in shape, so an even number takes none of those.
//! Beside the corruptions there are the rows `crop` (each cloud keeps 60 to 100 % of itself, on its own side of a plane) and `view`
//! (what two cameras some 40 degrees apart see).
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a program that prints")]

use std::path::Path;

use nalgebra::Matrix3;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use srrf_cloud::{EulerXyz, Register, Rigid, Solid};
use srrf_corrupt::crop::{crop, random_direction, visible};
use srrf_corrupt::datasets::{ShapeSource, Split, held_out, open};
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::{CorruptionKind, Pair, PairConfig, PairSynthesizer, PoseDraw, Sampling, Severity, Stream};
use srrf_lab::{VALIDATION_SHAPES, keep};
use srrf_model::{SrrfRegister, device, embedded};
use srrf_refine::{Metric, RefineConfig, RefineTarget, Verdict};

const SEED: u64 = 77_002;
/// Rows without a corruption.
const PARTIAL: [&str; 2] = ["crop", "view"];

fn main() {
    let mut arguments = std::env::args().skip(1);
    let Some(data) = arguments.next() else {
        println!("usage: refine_choices MODELNET [EVERY [ROW]]");
        return;
    };
    let every: usize = arguments.next().map_or(1, |n| n.parse().unwrap());
    let only = arguments.next();
    let shapes = open(Path::new(&data), Split::Train).unwrap();
    let flex = device("flex").unwrap();
    let network = SrrfRegister::new(embedded::load_default(&flex).unwrap(), flex);
    let built_in = ProceduralShapes::new(SEED, 400, None).unwrap();
    let synthesizers = [Sampling::Shared, Sampling::Independent].map(|sampling| {
        let config = PairConfig { sampling, keep_correspondence: false, ..PairConfig::default() };
        PairSynthesizer::new(config).unwrap()
    });

    println!(
        "corruption,sampling,severity,shape,class,start,full,cautious,halfway,rule,verdict,normal_correlation,correlation,median,\
         support_start,support_full,support_cautious,fitness,inlier_rmse,moved_full,moved_cautious,across,fused_halfway,bend,affine_gain"
    );
    let rows: Vec<&str> = CorruptionKind::ALL.iter().map(|kind| kind.name()).chain(PARTIAL).collect();
    assert!(only.as_deref().is_none_or(|name| rows.contains(&name)), "the rows are {rows:?}");
    let held = held_out(shapes.len(), VALIDATION_SHAPES);
    let pairs: Vec<(usize, usize)> = (0..VALIDATION_SHAPES)
        .step_by(every)
        .flat_map(|shape| (0..rows.len()).map(move |row| (shape, row)))
        .filter(|(_, row)| only.as_deref().is_none_or(|name| rows[*row] == name))
        .collect();
    let lines: Vec<String> = pairs
        .into_par_iter()
        .map(|(shape, row)| {
            let kinds = CorruptionKind::ALL.len();
            let kind = CorruptionKind::ALL.get(row);
            // Numbers that stay when rows are added.
            let i = if row < kinds { shape * kinds + row } else { (VALIDATION_SHAPES + shape) * kinds + row };
            let severity = Severity::ALL[(shape + i) % 5];
            // Every other shape is built in and sampled twice.
            let independent = shape % 2 == 1;
            let shapes: &dyn ShapeSource = if independent { &built_in } else { shapes.as_ref() };
            let synthesizer = &synthesizers[usize::from(independent)];
            let index = if independent { held_out(built_in.len(), VALIDATION_SHAPES)[shape] } else { held[shape] };
            let stream = Stream { seed: SEED, item: i as u64 };
            let mut pair = synthesizer
                .pair(shapes, index, kind.map(|kind| (*kind, severity)), PoseDraw::Seeded, stream)
                .unwrap();
            if kind.is_none() {
                partial(rows[row], &mut pair, stream);
            }
            let found = network.register(&pair.source, &pair.target).unwrap();
            let branches = found.branches.iter().map(|b| b.target_from_source);
            let starts: Vec<Rigid> = std::iter::once(found.target_from_source).chain(branches).collect();
            let rule = RefineConfig::default();
            let full = RefineConfig { check_deformation: false, ..rule };
            let cautious = RefineConfig {
                metric: Metric::PointToPoint,
                end_spacings: 0.3,
                soft: false,
                check_deformation: false,
                ..rule
            };
            let by = |config: &RefineConfig, starts: &[Rigid]| {
                let (source, target) = (Solid::new(&pair.source).unwrap(), Solid::new(&pair.target).unwrap());
                RefineTarget::new(target, config).unwrap().refine(source, starts).unwrap()
            };
            let (rule, full) = (by(&rule, &starts), by(&full, &starts));
            let start = starts[full.start];
            let cautious = by(&cautious, &[start]);
            let halfway = between(&start, &cautious.target_from_source);
            let fused_halfway = between(&found.target_from_source, &cautious.target_from_source);
            let error = |pose: &Rigid| -> f64 {
                let (a, b) = (
                    EulerXyz::from_matrix(&pose.rotation).to_deg(),
                    EulerXyz::from_matrix(&pair.target_from_source.rotation).to_deg(),
                );
                (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>() / 3.0
            };
            format!(
                "{},{},{},{index},{},{:.6},{:.6},{:.6},{:.6},{:.6},{},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},{:.6},{:.4},{:.4},{:.4},{:.6},{:.4},{:.4}",
                rows[row],
                if independent { "independent" } else { "shared" },
                severity.get(),
                shapes.class(index),
                error(&found.target_from_source),
                error(&full.target_from_source),
                error(&cautious.target_from_source),
                error(&halfway),
                error(&rule.target_from_source),
                match rule.verdict {
                    Verdict::Rigid => "rigid",
                    Verdict::Deformed => "deformed",
                    Verdict::Unsupported => "unsupported",
                },
                full.residuals.normal_correlation,
                full.residuals.correlation,
                full.residuals.median,
                full.starts[0].support,
                full.support,
                cautious.support,
                full.evidence.fitness,
                full.evidence.inlier_rmse / full.evidence.spacing,
                start.angle_to_deg(&full.target_from_source),
                start.angle_to_deg(&cautious.target_from_source),
                full.residuals.across_correlation,
                error(&fused_halfway),
                rule.affine.map_or(f64::NAN, |fit| fit.bend),
                rule.affine.map_or(f64::NAN, |fit| fit.gain),
            )
        })
        .collect();
    lines.iter().for_each(|line| println!("{line}"));
}

/// Leaves a part of either cloud.
fn partial(row: &str, pair: &mut Pair, stream: Stream) {
    let mut rng = ChaCha8Rng::seed_from_u64(stream.seed);
    rng.set_stream(stream.item);
    let camera = random_direction(&mut rng);
    for (cloud, frame) in
        [(&mut pair.source, Matrix3::identity()), (&mut pair.target, pair.target_from_source.rotation)]
    {
        let side = random_direction(&mut rng);
        let kept = if row == "crop" {
            crop(cloud.points(), &side, rng.random_range(0.6..1.0))
        } else {
            visible(cloud.points(), &(frame * (camera + 0.5 * side).normalize()), 0.1, 0.15)
        };
        keep(cloud, &kept).unwrap();
    }
}

fn between(a: &Rigid, b: &Rigid) -> Rigid {
    Rigid {
        rotation: Rigid::nearest_rotation(&(0.5 * (a.rotation + b.rotation))).unwrap(),
        translation: 0.5 * (a.translation + b.translation),
    }
}
