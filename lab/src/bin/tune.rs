//! How well the refinement does on corrupted pairs from starts like a network's:
//! `cargo run -p srrf-lab --bin tune -- DATA [SHAPES [OFFSET [ROW [independent]]]]`.
//!
//! DATA is ModelNet40 in any accepted layout; its training split is used. SHAPES (100) are spread over
//! it from shape number OFFSET (3) on, and severities 1 to 5 take turns. ROW restricts the run to corruptions
//! whose name contains it. A start is the oracle's pose (what least squares on the true correspondences gives)
//! turned about a random axis by an angle with median 2.5 degrees, log-normal with sigma 0.9, at most 20
//! degrees, and shifted by a Gaussian of 0.012 an axis.

#![allow(clippy::print_stdout, reason = "a program that prints")]

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use nalgebra::{Rotation3, Unit, Vector3};
use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use rand_distr::StandardNormal;
use srrf_cloud::{EulerXyz, Rigid};
use srrf_corrupt::datasets::{self, ShapeSource, Split};
use srrf_corrupt::{
    CorruptionKind, Pair, PairConfig, PairSynthesizer, PoseDraw, Sampling, Severity, Stream, oracle_pose,
};
use srrf_refine::{RefineConfig, Verdict, refine};

/// Errors of one method on one row.
#[derive(Default)]
struct ErrorRow {
    euler_deg: Vec<f64>,
    angle_deg: Vec<f64>,
    shift: Vec<f64>,
    seconds: f64,
}

impl ErrorRow {
    fn add(&mut self, found: &Rigid, truth: &Rigid) {
        let angles = |pose: &Rigid| EulerXyz::from_matrix(&pose.rotation).to_deg();
        for (a, b) in angles(found).iter().zip(angles(truth)) {
            self.euler_deg.push((a - b + 180.0).rem_euclid(360.0) - 180.0);
        }
        self.angle_deg.push(found.angle_to_deg(truth));
        self.shift.push((found.translation - truth.translation).norm());
    }

    /// RMSE / MAE of the Euler angles, median angle, recall, milliseconds a pair.
    fn text(&mut self) -> String {
        let n = self.euler_deg.len() as f64;
        let rmse = (self.euler_deg.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
        let mae = self.euler_deg.iter().map(|e| e.abs()).sum::<f64>() / n;
        let pairs = self.angle_deg.len();
        let found = self.angle_deg.iter().zip(&self.shift).filter(|(a, t)| **a < 5.0 && **t < 0.1).count();
        self.angle_deg.sort_by(f64::total_cmp);
        let (median, recall) = (self.angle_deg[pairs / 2], found as f64 / pairs as f64);
        format!("{rmse:5.2} /{mae:5.2} /{median:5.2} {recall:.2} {:4.0}", 1e3 * self.seconds / pairs as f64)
    }
}

/// The start of pair number `item`.
fn start(pair: &Pair, item: u64) -> Rigid {
    let mut rng = ChaCha8Rng::seed_from_u64(1000 + item);
    let mut normal = || rng.sample::<f64, _>(StandardNormal);
    let axis = Unit::new_normalize(Vector3::from_fn(|_, _| normal()));
    let angle_deg = (2.5 * (0.9 * normal()).exp()).min(20.0);
    let rotation = Rotation3::from_axis_angle(&axis, angle_deg.to_radians()).into_inner();
    let shift = Vector3::from_fn(|_, _| 0.012 * normal());
    let centre = pair.target.centroid();
    let off = Rigid { rotation, translation: centre + shift - rotation * centre };
    off.compose(&oracle_pose(pair).unwrap_or(pair.target_from_source))
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let path = args.next().ok_or("usage: tune DATA [SHAPES [OFFSET [ROW [independent]]]]")?;
    let count: usize = args.next().map_or(Ok(100), |n| n.parse())?;
    let offset: usize = args.next().map_or(Ok(3), |n| n.parse())?;
    let only = args.next().unwrap_or_default();
    let sampling = if args.next().is_some() { Sampling::Independent } else { Sampling::Shared };

    let shapes: Box<dyn ShapeSource> = datasets::open(Path::new(&path), Split::Train)?;
    let synthesizer = PairSynthesizer::new(PairConfig { sampling, ..PairConfig::default() })?;
    let base = RefineConfig::default();
    let variants = [
        ("refine", base),
        ("no soft stage", RefineConfig { soft: false, check_deformation: false, ..base }),
        ("no check", RefineConfig { check_deformation: false, ..base }),
    ];
    println!("{}", shapes.description());
    println!("RMSE / MAE of the Euler angles / median angle (degrees), recall, ms");
    print!("| {:18} | {:28} |", "", "start");
    variants.iter().for_each(|(name, _)| print!(" {name:28} |"));
    println!(" rigid deformed start | correlation, that of normals, median: 5%, 50%, 95%");
    for kind in CorruptionKind::ALL.into_iter().filter(|k| k.name().contains(&only)) {
        let mut rows: Vec<ErrorRow> = (0..=variants.len()).map(|_| ErrorRow::default()).collect();
        let mut verdicts = [0; 3];
        let mut structure = [const { Vec::new() }; 3];
        for k in 0..count {
            let item = k as u64;
            let index = (offset + k * (shapes.len() / count).max(1)) % shapes.len();
            let corruption = Some((kind, Severity::ALL[k % 5]));
            let stream = Stream { seed: 7, item };
            let pair = synthesizer.pair(&*shapes, index, corruption, PoseDraw::Seeded, stream)?;
            let start = start(&pair, item);
            rows[0].add(&start, &pair.target_from_source);
            for (i, (_, config)) in variants.iter().enumerate() {
                let clock = Instant::now();
                let found = refine(&pair.source, &pair.target, &[start], config)?;
                rows[i + 1].seconds += clock.elapsed().as_secs_f64();
                rows[i + 1].add(&found.target_from_source, &pair.target_from_source);
                if i == 0 {
                    verdicts[found.verdict as usize] += 1;
                    let residuals = &found.residuals;
                    let values = [residuals.correlation, residuals.normal_correlation, residuals.median];
                    structure.iter_mut().zip(values).for_each(|(all, value)| all.push(value));
                }
            }
        }
        print!("| {:18} |", kind.name());
        rows.iter_mut().for_each(|row| print!(" {} |", row.text()));
        let quantiles = |values: &mut Vec<f64>| {
            values.sort_by(f64::total_cmp);
            [5, 50, 95].map(|q| format!("{:.2}", values[values.len() * q / 100])).join(" ")
        };
        let [rigid, deformed, kept] =
            [Verdict::Rigid, Verdict::Deformed, Verdict::Unsupported].map(|v| verdicts[v as usize]);
        println!(" {rigid} {deformed} {kept} | {}", structure.each_mut().map(quantiles).join(" | "));
    }
    Ok(())
}
