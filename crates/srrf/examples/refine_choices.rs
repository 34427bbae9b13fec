//! What the refinement makes of the network's own poses, on the shapes of ModelNet40's training split that the
//! network was validated on; no test shape is looked at. One CSV line a pair: the errors of the network, of the full
//! refinement, of a cautious one, of halfway between the network and that, and of the answer by the rule, beside
//! what the rule sees.
//!
//! `cargo run --release -p srrf --example refine_choices -- MODELNET [EVERY [CORRUPTION]] > choices.csv` takes every so many of
//! these shapes (default: each); every other one of the 192 gives its place to a built-in shape, so an even number takes none of those.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example")]

use std::path::Path;

use rayon::prelude::*;
use srrf_cloud::shapes::ProceduralShapes;
use srrf_cloud::source::{ShapeSource, Split, VALIDATION_SHAPES, held_out, open};
use srrf_cloud::{EulerXyz, Register, Rigid};
use srrf_corrupt::{CorruptionKind, PairConfig, PairSynthesizer, PoseDraw, Sampling, Severity, Stream};
use srrf_model::{SrrfRegister, device, embedded};
use srrf_refine::{Metric, RefineConfig, RefineTarget, Verdict};

const SEED: u64 = 77_002;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let Some(data) = arguments.next() else {
        println!("usage: refine_choices MODELNET [EVERY [CORRUPTION]]");
        return;
    };
    let every: usize = arguments.next().map_or(1, |n| n.parse().unwrap());
    let only: Option<CorruptionKind> = arguments.next().map(|name| name.parse().unwrap());
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
         support_start,support_full,support_cautious,fitness,inlier_rmse,moved_full,moved_cautious,wide,fused_halfway,bend,affine_gain"
    );
    let lines: Vec<String> = (0..VALIDATION_SHAPES * CorruptionKind::ALL.len())
        .into_par_iter()
        .filter(|i| (i / CorruptionKind::ALL.len()).is_multiple_of(every))
        .filter(|i| only.is_none_or(|kind| CorruptionKind::ALL[i % 12] == kind))
        .map(|i| {
            let (shape, kind) = (i / CorruptionKind::ALL.len(), CorruptionKind::ALL[i % 12]);
            let severity = Severity::ALL[(shape + i) % 5];
            // Every other shape is built in and sampled twice.
            let independent = shape % 2 == 1;
            let shapes: &dyn ShapeSource = if independent { &built_in } else { shapes.as_ref() };
            let synthesizer = &synthesizers[usize::from(independent)];
            let index = held_out(shapes.len(), VALIDATION_SHAPES)[shape];
            let stream = Stream { seed: SEED, item: i as u64 };
            let pair = synthesizer
                .pair(shapes, index, Some((kind, severity)), PoseDraw::Seeded, stream)
                .unwrap();
            let found = network.register(&pair.source, &pair.target).unwrap();
            let mut starts: Vec<(&str, Rigid)> = vec![("answer", found.target_from_source)];
            starts.extend(found.branches.iter().map(|b| (b.name, b.target_from_source)));
            let rule = RefineConfig::default();
            let full = RefineConfig { check_deformation: false, ..rule };
            let cautious = RefineConfig {
                metric: Metric::PointToPoint,
                end_spacings: 0.3,
                soft: false,
                check_deformation: false,
                ..rule
            };
            let by = |config: &RefineConfig, starts: &[(&str, Rigid)]| {
                RefineTarget::new(&pair.target, config).unwrap().refine(&pair.source, starts).unwrap()
            };
            let (rule, full) = (by(&rule, &starts), by(&full, &starts));
            let cautious = by(&cautious, &[("start", winner(&full, &starts))]);
            let start = winner(&full, &starts);
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
                kind.name(),
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
                full.residuals.wide_correlation,
                error(&fused_halfway),
                rule.affine.map_or(f64::NAN, |fit| fit.bend),
                rule.affine.map_or(f64::NAN, |fit| fit.gain),
            )
        })
        .collect();
    lines.iter().for_each(|line| println!("{line}"));
}

fn between(a: &Rigid, b: &Rigid) -> Rigid {
    Rigid {
        rotation: Rigid::nearest_rotation(&(0.5 * (a.rotation + b.rotation))).unwrap(),
        translation: 0.5 * (a.translation + b.translation),
    }
}

/// The start that won, as it was given.
fn winner(refined: &srrf_refine::Refinement, starts: &[(&str, Rigid)]) -> Rigid {
    starts.iter().find(|(name, _)| *name == refined.start).map_or(starts[0].1, |(_, pose)| *pose)
}
