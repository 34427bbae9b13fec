//! Where the time of one shard goes, on one thread.

use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::Tensor;
use serde_json::{Map, Value, json};
use srrf_corrupt::Pair;
use srrf_model::{
    BranchConfig, BranchOutput, SoftMatching, Srrf, SrrfOutput, correspondence_loss, procrustes,
    registration_loss, skeleton_loss,
};
use srrf_train::config::TrainConfig;
use srrf_train::network::Shard;
use srrf_train::optimizer::optimizer;
use srrf_train::step::to_shard;

use crate::clock::{clock, median};
use crate::{Arguments, Bench, Failure, PHASE};

/// Times of named parts.
struct Parts<'a> {
    arguments: &'a Arguments,
    found: Map<String, Value>,
}

impl Parts<'_> {
    /// Times `job` alone.
    fn time<T>(&mut self, name: &str, mut job: impl FnMut() -> T) {
        self.rounds(&[name], || vec![clock(&mut job).1]);
    }

    /// Times parts that follow each other; `round` gives the seconds of each.
    fn rounds(&mut self, names: &[&str], mut round: impl FnMut() -> Vec<f64>) {
        for _ in 0..self.arguments.warmup {
            round();
        }
        let rounds: Vec<Vec<f64>> = (0..self.arguments.repeats.max(1)).map(|_| round()).collect();
        for (i, name) in names.iter().enumerate() {
            let times: Vec<f64> = rounds.iter().map(|round| round[i]).collect();
            self.found.insert(format!("{name}_s"), json!(median(&times)));
        }
    }
}

/// Each stage's forward pass apart, without a graph; then both training stages with their graphs.
pub fn profile(bench: &Bench, arguments: &Arguments) -> Result<Map<String, Value>, Failure> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let count = bench.config.optimizer.shard;
    let pairs = bench.pairs.shard(0, count)?;
    let mut parts = Parts { arguments, found: Map::new() };
    parts.found.insert("pairs_a_shard".into(), json!(count));
    pool.install(|| -> Result<(), Failure> {
        parts.time("pairs", || bench.pairs.shard(0, count).map(|pairs: Vec<Pair>| pairs.len()));
        let ragged = "the pairs differ in their number of points";
        let shard = to_shard(&pairs, PHASE, &bench.device).ok_or(ragged)?;
        stages(&mut parts, bench, &shard);
        registration_stage(&mut parts, &bench.config, &bench.model, &shard);
        skeleton_stage(&mut parts, &bench.config, &bench.model, &shard);
        Ok(())
    })?;
    Ok(parts.found)
}

/// The stages of the forward pass; features come from modules of the same sizes.
fn stages(parts: &mut Parts, bench: &Bench, shard: &Shard) {
    let network = &bench.config.network;
    let (source, target) = (&shard.batch.source, &shard.batch.target);
    parts.time("sem", || (bench.model.sem.forward(source.clone()), bench.model.sem.forward(target.clone())));
    let output = bench.model.forward(&network.integration, source.clone(), target.clone(), PHASE);
    let (x, y) = (&output.source_skeleton.points, &output.target_skeleton.points);
    branch(parts, bench, "dense", &network.dense, &output.dense, [source, target]);
    branch(parts, bench, "skeleton", &network.skeleton, &output.skeleton, [x, y]);
    parts.time("integration", || {
        network.integration.fuse(output.dense.pose(), output.skeleton.pose(), source, target)
    });
}

fn branch(
    parts: &mut Parts,
    bench: &Bench,
    name: &str,
    config: &BranchConfig,
    output: &BranchOutput,
    clouds: [&Tensor<3>; 2],
) {
    let clouds = Tensor::cat(clouds.map(Tensor::clone).to_vec(), 0);
    let tokens = Tensor::cat(vec![output.source_points.clone(), output.target_points.clone()], 0);
    let sfe = config.sfe.init(&bench.device);
    parts.time(&format!("{name}_sfe"), || sfe.forward(tokens.clone(), clouds.clone()));
    let features = sfe.forward(tokens.clone(), clouds);
    let pfi = config.pfi.init(config.sfe.output_width(), &bench.device);
    parts.time(&format!("{name}_pfi"), || pfi.forward(features.clone(), tokens.clone()));
    let features = pfi.forward(features, tokens);
    let halves = features.chunk(2, 0);
    let matching = SoftMatching::new(&bench.device);
    parts.time(&format!("{name}_matching"), || {
        matching.forward(halves[0].clone(), halves[1].clone(), output.target_points.clone())
    });
    parts.time(&format!("{name}_svd"), || procrustes(output.source_points.clone(), output.matches.clone()));
}

/// The registration stage of training; SEM is not on the graph.
fn registration_stage(parts: &mut Parts, config: &TrainConfig, model: &Srrf, shard: &Shard) {
    let mut fork = model.clone();
    (fork.dense, fork.skeleton) = (fork.dense.train(), fork.skeleton.train());
    let truth = || (shard.rotation.clone(), shard.translation.clone());
    let loss = |output: &SrrfOutput| {
        let fused = (output.fused.rotation.clone(), output.fused.translation.clone());
        let mut total = registration_loss(fused.0, fused.1, truth().0, truth().1);
        for branch in [&output.dense, &output.skeleton] {
            let pose = (branch.rotation.clone(), branch.translation.clone());
            let matches = (branch.source_points.clone(), branch.matches.clone());
            total = total
                + registration_loss(pose.0, pose.1, truth().0, truth().1)
                + correspondence_loss(matches.0, matches.1, truth().0, truth().1)
                    * config.losses.correspondence;
        }
        total
    };
    let (mut optimizer, mut model) = (optimizer(&config.optimizer), model.clone());
    let names =
        ["registration_forward", "registration_losses", "registration_backward", "registration_optimizer"];
    parts.rounds(&names, || {
        let (source, target) = (shard.batch.source.clone(), shard.batch.target.clone());
        let (output, forward) = clock(|| fork.forward(&config.network.integration, source, target, PHASE));
        let (total, losses) = clock(|| loss(&output));
        let (gradients, backward) = clock(|| GradientsParams::from_grads(total.backward(), &fork));
        let (next, update) = clock(|| optimizer.step(1e-5, model.clone().train(), gradients).valid());
        model = next;
        vec![forward, losses, backward, update]
    });
}

/// The skeleton stage of training.
fn skeleton_stage(parts: &mut Parts, config: &TrainConfig, model: &Srrf, shard: &Shard) {
    let sem = model.sem.clone().train();
    let (source, target) = (&shard.batch.source, &shard.batch.target);
    parts.rounds(&["skeleton_forward", "skeleton_losses", "skeleton_backward"], || {
        let (skeletons, forward) = clock(|| (sem.forward(source.clone()), sem.forward(target.clone())));
        let (loss, losses) = clock(|| {
            let (x, y) = ((source.clone(), &skeletons.0), (target.clone(), &skeletons.1));
            let truth = (shard.rotation.clone(), shard.translation.clone());
            skeleton_loss(&config.losses.skeleton, x, y, truth.0, truth.1)
        });
        let (_, backward) = clock(|| GradientsParams::from_grads(loss.total.backward(), &sem));
        vec![forward, losses, backward]
    });
}
