//! Microseconds per corruption of 1,024 points, and per pair, on one thread:
//! `cargo run -p srrf-corrupt --example timing`.

#![allow(clippy::print_stdout, reason = "a program that prints")]

use std::error::Error;
use std::time::Instant;

use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use srrf_cloud::PointCloud;
use srrf_corrupt::{
    Bases, CorruptionKind, Label, PairConfig, PairSynthesizer, PoseDraw, Severity, Stream, Variants,
    corruption,
};

const ROUNDS: u32 = 400;

fn main() -> Result<(), Box<dyn Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let points = (0..1024).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect();
    let (cloud, _) = PointCloud::new(points)?.to_unit_sphere();
    let synthesizer = PairSynthesizer::new(PairConfig::default())?;
    let severity = Severity::try_from(5)?;
    println!("{:20} {:>12} {:>12}", "severity 5", "us a cloud", "us a pair");
    for kind in CorruptionKind::ALL {
        let corruption = corruption(kind, &Variants::paper());
        corruption.apply(cloud.points(), severity, &mut rng)?; // factors the RBF system
        let start = Instant::now();
        for _ in 0..ROUNDS {
            std::hint::black_box(corruption.apply(cloud.points(), severity, &mut rng)?);
        }
        let cloud_time = start.elapsed() / ROUNDS;
        let start = Instant::now();
        for item in 0..u64::from(ROUNDS) {
            let stream = Stream { seed: 0, item };
            let choice = Some((kind, severity));
            let bases = Bases::Shared(&cloud);
            std::hint::black_box(synthesizer.pair_from_bases(
                bases,
                Label::default(),
                choice,
                PoseDraw::Seeded,
                stream,
            )?);
        }
        let pair_time = start.elapsed() / ROUNDS;
        println!("{kind:20} {:>12} {:>12}", cloud_time.as_micros(), pair_time.as_micros());
    }
    Ok(())
}
