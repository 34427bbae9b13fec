//! Corrupts clouds of 1,024 points in all 12 x 5 ways and prints one JSON object: seconds in all and
//! milliseconds a cloud of each corruption. `scripts/speed_corruptions.py` compares it with numpy.
//!
//! ```sh
//! cargo bench --profile dev -p srrf-corrupt --bench test_set -- --clouds 100 --threads 1
//! ```

use std::error::Error;
use std::hint::black_box;
use std::thread;
use std::time::Instant;

use clap::Parser;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use serde_json::{Map, json};
use srrf_cloud::PointCloud;
use srrf_corrupt::datasets::ShapeSource;
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::{CorruptionKind, Severity, Variants, corruption};

#[derive(Parser)]
struct Arguments {
    /// Number of clouds.
    #[arg(long, default_value_t = 100)]
    clouds: usize,
    /// Threads that share them.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// What cargo passes to every benchmark.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Every cloud at every severity; the seconds that each cloud took.
fn corrupt(clouds: &[PointCloud], kind: CorruptionKind) -> Vec<f64> {
    let corruption = corruption(kind, &Variants::paper());
    let mut seconds = Vec::with_capacity(clouds.len());
    for (item, cloud) in clouds.iter().enumerate() {
        let start = Instant::now();
        let mut points = 0;
        for severity in Severity::ALL {
            let mut rng = ChaCha8Rng::seed_from_u64((item * 5) as u64 + u64::from(severity.get()));
            points += black_box(corruption.apply(cloud.points(), severity, &mut rng))
                .map_or(0, |corrupted| corrupted.points.len());
        }
        seconds.push(if points == 0 { f64::NAN } else { start.elapsed().as_secs_f64() });
    }
    seconds
}

#[allow(clippy::print_stdout, reason = "a benchmark that prints its result")]
fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let shapes = ProceduralShapes::new(1, arguments.clouds, None)?;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let clouds: Vec<PointCloud> =
        (0..arguments.clouds).map(|i| shapes.sample(i, 1024, &mut rng)).collect::<Result<_, _>>()?;
    let share = arguments.clouds.div_ceil(arguments.threads.max(1)).max(1);
    let (mut total, mut each) = (0.0, Map::new());
    for kind in CorruptionKind::ALL {
        corrupt(&clouds[..1], kind); // what is built once
        let start = Instant::now();
        let mut of_clouds: Vec<f64> = thread::scope(|scope| {
            let parts: Vec<_> =
                clouds.chunks(share).map(|part| scope.spawn(move || corrupt(part, kind))).collect();
            parts.into_iter().flat_map(|part| part.join().unwrap_or_default()).collect()
        });
        let wall = start.elapsed().as_secs_f64();
        if of_clouds.len() != clouds.len() || of_clouds.iter().any(|s| s.is_nan()) {
            return Err(format!("{kind}: no cloud came out").into());
        }
        of_clouds.sort_by(f64::total_cmp);
        // On one thread the median: a cloud during which the processor did something else counts no more than another.
        let seconds =
            if arguments.threads > 1 { wall } else { of_clouds[clouds.len() / 2] * clouds.len() as f64 };
        total += seconds;
        each.insert(kind.name().into(), json!(seconds * 1e3 / (5 * arguments.clouds) as f64));
    }
    println!(
        "{}",
        json!({"clouds": arguments.clouds, "threads": arguments.threads, "seconds": total, "ms_a_cloud": each})
    );
    Ok(())
}
