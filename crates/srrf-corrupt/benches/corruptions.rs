//! Times of the twelve corruptions on a cloud of 1,024 points at severity 3.
//!
//! ```sh
//! cargo bench --profile dev -p srrf-corrupt --bench corruptions            # shares the build of `cargo run`
//! cargo bench --profile dev -p srrf-corrupt --bench corruptions -- cutout  # one of them
//! ```

#![allow(clippy::expect_used, reason = "a benchmark stops where it cannot start")]

use divan::{Bencher, black_box};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use srrf_corrupt::datasets::ShapeSource;
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::{CorruptionKind, Severity, Variants, corruption};

fn main() {
    divan::main();
}

#[divan::bench(args = CorruptionKind::ALL, max_time = 1)]
fn apply(bencher: Bencher, kind: CorruptionKind) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let shapes = ProceduralShapes::new(1, 1, None).expect("built-in shapes");
    let cloud = shapes.sample(0, 1024, &mut rng).expect("a cloud");
    let corruption = corruption(kind, &Variants::paper());
    bencher.bench_local(|| corruption.apply(black_box(cloud.points()), Severity::ALL[2], &mut rng));
}
