//! Times of the network's stages on one generated pair, with the sizes of `configs/modelnet-small.toml`.
//!
//! ```sh
//! cargo bench --profile dev -p srrf-train --bench network           # shares the build of `cargo run`
//! cargo bench --profile dev -p srrf-train --bench network -- sfe    # one stage
//! ```

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a benchmark stops where it cannot start")]

use std::path::Path;

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use divan::{Bencher, black_box};
use srrf_cloud::PointCloud;
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::{CorruptionKind, Pair, PairConfig, PairSynthesizer, PoseDraw, Severity, Stream};
use srrf_model::ops::{even_subsample, farthest_points, k_nearest, nearest, share_within};
use srrf_model::{
    BranchConfig, PairBatch, SoftMatching, Srrf, SrrfConfig, SrrfOutput, init, keep_freed_memory, procrustes,
};
use srrf_train::TrainConfig;

const PHASE: f32 = 0.5;
const BRANCHES: [&str; 2] = ["dense", "skeleton"];

fn main() {
    keep_freed_memory();
    divan::main();
}

fn pair() -> Pair {
    let shapes = ProceduralShapes::new(1, 1, None).expect("built-in shapes");
    let synthesizer = PairSynthesizer::new(PairConfig::default()).expect("default pairs");
    let corruption = Some((CorruptionKind::Gaussian, Severity::ALL[2]));
    let stream = Stream { seed: 1, item: 0 };
    synthesizer.pair(&shapes, 0, corruption, PoseDraw::Seeded, stream).expect("a pair")
}

/// Neighbours and samples on the host: clouds of 1,024 points.
#[divan::bench_group(sample_count = 20, max_time = 2)]
mod points {
    use super::*;

    fn clouds() -> [Vec<[f32; 3]>; 2] {
        let pair = pair();
        let host = |cloud: &PointCloud| cloud.points().iter().map(|p| p.map(|v| v as f32)).collect();
        [host(&pair.source), host(&pair.target)]
    }

    #[divan::bench]
    fn farthest_256(bencher: Bencher) {
        let [x, _] = clouds();
        bencher.bench_local(|| farthest_points(black_box(&x), 256));
    }

    #[divan::bench]
    fn k_nearest_16_for_256(bencher: Bencher) {
        let [x, y] = clouds();
        bencher.bench_local(|| k_nearest(black_box(&x[..256]), black_box(&y), 16));
    }

    #[divan::bench]
    fn nearest_for_1024(bencher: Bencher) {
        let [x, y] = clouds();
        bencher.bench_local(|| nearest(black_box(&x), black_box(&y)));
    }

    #[divan::bench]
    fn share_within_1024(bencher: Bencher) {
        let [x, y] = clouds();
        bencher.bench_local(|| share_within(black_box(&x), black_box(&y), 0.05));
    }

    #[divan::bench]
    fn even_subsample_128(bencher: Bencher) {
        let [x, _] = clouds();
        bencher.bench_local(|| even_subsample(black_box(&x), 128, PHASE));
    }
}

/// The stages of the forward pass of one pair, and the whole of it; without a graph.
#[divan::bench_group(sample_count = 20, max_time = 2)]
mod network {
    use super::*;

    struct Bench {
        config: SrrfConfig,
        device: Device,
        model: Srrf,
        source: Tensor<3>,
        target: Tensor<3>,
        output: SrrfOutput,
    }

    fn bench() -> Bench {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/modelnet-small.toml"));
        let config = <TrainConfig>::read(path).expect("the configuration of the repository").network;
        let device = Device::flex();
        let model = init::seeded(config.init(&device), 1).valid();
        let pair = pair();
        let batch = PairBatch::new(&[(&pair.source, &pair.target)], &device).expect("one pair");
        let (source, target) = (batch.source, batch.target);
        let output = model.forward(&config.integration, source.clone(), target.clone(), PHASE).unwrap();
        Bench { config, device, model, source, target, output }
    }

    /// A branch's configuration, the clouds that it saw and their tokens.
    fn branch(bench: &Bench, name: &str) -> (BranchConfig, Tensor<3>, Tensor<3>) {
        let (config, output, clouds) = match name {
            "dense" => {
                (&bench.config.dense, &bench.output.dense, [bench.source.clone(), bench.target.clone()])
            }
            _ => {
                let skeletons = [&bench.output.source_skeleton, &bench.output.target_skeleton];
                (&bench.config.skeleton, &bench.output.skeleton, skeletons.map(|s| s.points.clone()))
            }
        };
        let tokens = vec![output.source_points.clone(), output.target_points.clone()];
        (config.clone(), Tensor::cat(clouds.to_vec(), 0), Tensor::cat(tokens, 0))
    }

    #[divan::bench]
    fn forward(bencher: Bencher) {
        let b = bench();
        let run =
            || b.model.forward(&b.config.integration, b.source.clone(), b.target.clone(), PHASE).unwrap();
        bencher.bench_local(run);
    }

    #[divan::bench]
    fn sem_one_cloud(bencher: Bencher) {
        let b = bench();
        bencher.bench_local(|| b.model.sem.forward(b.source.clone()).unwrap());
    }

    #[divan::bench(args = BRANCHES)]
    fn sfe(bencher: Bencher, name: &str) {
        let b = bench();
        let (config, clouds, tokens) = branch(&b, name);
        let sfe = config.sfe.init(&b.device);
        bencher.bench_local(|| sfe.forward(tokens.clone(), clouds.clone()).unwrap());
    }

    #[divan::bench(args = BRANCHES)]
    fn pfi(bencher: Bencher, name: &str) {
        let b = bench();
        let (config, clouds, tokens) = branch(&b, name);
        let features = config.sfe.init(&b.device).forward(tokens.clone(), clouds).unwrap();
        let pfi = config.pfi.init(config.sfe.output_width(), &b.device);
        bencher.bench_local(|| pfi.forward(features.clone(), tokens.clone()));
    }

    #[divan::bench(args = BRANCHES)]
    fn matching(bencher: Bencher, name: &str) {
        let b = bench();
        let (config, clouds, tokens) = branch(&b, name);
        let features = config.sfe.init(&b.device).forward(tokens.clone(), clouds).unwrap().chunk(2, 0);
        let points = tokens.chunk(2, 0)[1].clone();
        let matching = SoftMatching::new(&b.device);
        bencher
            .bench_local(|| matching.forward(features[0].clone(), features[1].clone(), points.clone(), None));
    }

    #[divan::bench(args = BRANCHES)]
    fn svd(bencher: Bencher, name: &str) {
        let b = bench();
        let output = if name == "dense" { &b.output.dense } else { &b.output.skeleton };
        bencher.bench_local(|| procrustes(output.source_points.clone(), output.matches.clone()).unwrap());
    }

    #[divan::bench]
    fn integration(bencher: Bencher) {
        let b = bench();
        let poses = || (b.output.dense.pose(), b.output.skeleton.pose());
        bencher
            .bench_local(|| b.config.integration.fuse(poses().0, poses().1, &b.source, &b.target).unwrap());
    }
}
