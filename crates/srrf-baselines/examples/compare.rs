//! The methods of this crate on corrupted pairs:
//! `cargo run -p srrf-baselines --example compare -- DATA [SHAPES [SEVERITY [ROW]]]`.
//!
//! DATA is ModelNet40 in any accepted layout; SHAPES (50) shapes are spread over its training split, both clouds
//! corrupted at SEVERITY (3). ROW restricts the run to corruptions whose name contains it.

#![allow(clippy::print_stdout, reason = "a program that prints")]

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use srrf_baselines::{Fgr, FpfhRansac, FpfhRansacConfig, Icp, IcpConfig, IcpPlane, IcpRobust, IcpTrimmed};
use srrf_cloud::source::{self, Split};
use srrf_cloud::{EulerXyz, Register, Rigid};
use srrf_corrupt::{CorruptionKind, PairConfig, PairSynthesizer, PoseDraw, Severity, Stream};
use srrf_refine::{RefineConfig, Refined};

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let path = args.next().ok_or("usage: compare DATA [SHAPES [SEVERITY [ROW]]]")?;
    let count: usize = args.next().map_or(Ok(50), |n| n.parse())?;
    let severity: Severity = args.next().as_deref().unwrap_or("3").parse()?;
    let only = args.next().unwrap_or_default();

    let centred = Icp::new(IcpConfig { centred: true, ..IcpConfig::default() });
    let coarse = FpfhRansac::new(FpfhRansacConfig { refine: None, ..FpfhRansacConfig::default() });
    let methods: Vec<(&str, Box<dyn Register>)> = vec![
        ("icp-centred", Box::new(centred)),
        ("icp-centred+refine", Box::new(Refined::new(centred, RefineConfig::default()))),
        ("icp-plane", Box::new(IcpPlane::default())),
        ("icp-trimmed", Box::new(IcpTrimmed::default())),
        ("icp-robust", Box::new(IcpRobust::default())),
        ("fpfh-ransac, coarse", Box::new(coarse)),
        ("fpfh-ransac", Box::new(FpfhRansac::default())),
        ("fgr", Box::new(Fgr::default())),
    ];
    let shapes = source::open(Path::new(&path), Split::Train)?;
    let synthesizer = PairSynthesizer::new(PairConfig::default())?;
    println!("{}, severity {severity:?}", shapes.description());
    println!("median angle (degrees), MAE of the Euler angles, recall (5 degrees, 0.1), ms a pair");
    print!("| {:18} |", "");
    methods.iter().for_each(|(name, _)| print!(" {name:24} |"));
    println!();
    for kind in CorruptionKind::ALL.into_iter().filter(|k| k.name().contains(&only)) {
        print!("| {:18} |", kind.name());
        for (_, method) in &methods {
            let (mut angles, mut mae, mut recalled, mut seconds) = (Vec::new(), 0.0, 0, 0.0);
            for k in 0..count {
                let index = (5 + k * (shapes.len() / count).max(1)) % shapes.len();
                let stream = Stream { seed: 3, item: k as u64 };
                let pair =
                    synthesizer.pair(&*shapes, index, Some((kind, severity)), PoseDraw::Seeded, stream)?;
                let clock = Instant::now();
                let found = method.register(&pair.source, &pair.target);
                seconds += clock.elapsed().as_secs_f64();
                let pose = found.map_or(Rigid::identity(), |f| f.target_from_source);
                let truth = &pair.target_from_source;
                let angle = pose.angle_to_deg(truth);
                let shift = (pose.translation - truth.translation).norm();
                recalled += usize::from(angle < 5.0 && shift < 0.1);
                angles.push(angle);
                let euler = |p: &Rigid| EulerXyz::from_matrix(&p.rotation).to_deg();
                let wrapped = |d: f64| ((d + 180.0).rem_euclid(360.0) - 180.0).abs();
                mae += euler(&pose).iter().zip(euler(truth)).map(|(a, b)| wrapped(a - b)).sum::<f64>() / 3.0;
            }
            angles.sort_by(f64::total_cmp);
            let n = count as f64;
            let (median, recall) = (angles[count / 2], recalled as f64 / n);
            print!(" {median:6.2} {:6.2} {recall:.2} {:5.0} |", mae / n, 1e3 * seconds / n);
        }
        println!();
    }
    Ok(())
}
