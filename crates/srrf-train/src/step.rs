//! One training step: the batch is split into shards, each with its own graph and thread; their
//! gradients are summed in order, checked, clipped and applied.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use burn::module::{Module, ModuleVisitor, Param};
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use srrf_cloud::{PointCloud, Rigid};
use srrf_corrupt::Pair;
use srrf_model::{
    BranchOutput, IntegrationConfig, PairBatch, Skeleton, Srrf, chamfer, correspondence_loss,
    registration_loss, skeleton_loss, spread,
};

use crate::config::{LossConfig, SemTraining, StageConfig};
use crate::data::TrainingPairs;

/// Named means over the pairs of a batch.
pub type Losses = BTreeMap<&'static str, f64>;

/// What a step needs to know.
pub struct StepContext<'a> {
    /// The stage.
    pub stage: &'a StageConfig,
    /// Weights of the losses.
    pub losses: &'a LossConfig,
    /// The blend of the two poses.
    pub integration: &'a IntegrationConfig,
    /// The pairs.
    pub pairs: &'a TrainingPairs,
    /// Device of the network, without autodiff.
    pub device: &'a Device,
    /// Pairs a step, and pairs a shard.
    pub batch: usize,
    /// Pairs a shard.
    pub shard: usize,
}

/// What a step found.
pub struct StepOutcome {
    /// The summed gradient.
    pub gradients: GradientsParams,
    /// Its norm before clipping; not finite if anything went wrong.
    pub norm: f64,
    /// The losses.
    pub losses: Losses,
}

/// Why a step failed.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// A pair could not be made.
    #[error(transparent)]
    Pair(#[from] srrf_corrupt::PairError),
    /// The pairs of a shard differ in their number of points.
    #[error("pairs {0}.. differ in their number of points")]
    Ragged(usize),
    /// A worker thread panicked.
    #[error("a worker thread stopped; the message above says why")]
    Worker,
}

/// A pool of single-threaded rayon pools: shards run side by side, and nothing inside a shard is
/// split, so that results do not depend on the number of threads.
pub struct Workers(Vec<rayon::ThreadPool>);

impl Workers {
    /// `threads` workers.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub fn new(threads: usize) -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = |_| rayon::ThreadPoolBuilder::new().num_threads(1).build();
        (0..threads.max(1)).map(pool).collect::<Result<_, _>>().map(Self)
    }

    /// `job(0) .. job(count - 1)`, in order.
    pub fn map<T: Send>(&self, count: usize, job: impl Fn(usize) -> T + Sync) -> Option<Vec<T>> {
        let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::with_capacity(count)));
        let work = || loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= count {
                break;
            }
            let result = job(i);
            if let Ok(mut done) = done.lock() {
                done.push((i, result));
            }
        };
        std::thread::scope(|scope| {
            for pool in &self.0 {
                scope.spawn(|| pool.install(work));
            }
        });
        let mut done = done.into_inner().ok()?;
        done.sort_by_key(|(i, _)| *i);
        (done.len() == count).then(|| done.into_iter().map(|(_, result)| result).collect())
    }
}

/// Gradient and losses of step `step` at `model`.
///
/// # Errors
/// [`StepError`] when a pair cannot be made.
pub fn gradient(
    context: &StepContext,
    model: &Srrf,
    step: usize,
    workers: &Workers,
) -> Result<StepOutcome, StepError> {
    let shards = context.batch / context.shard;
    let run = |i: usize| shard(context, model, step * context.batch + i * context.shard);
    let parts = workers.map(shards, run).ok_or(StepError::Worker)?;

    let mut sum = SumVisitor {
        parts: Vec::new(),
        sum: GradientsParams::new(),
        squares: 0.0,
        scale: 1.0 / shards as f64,
    };
    let mut losses = Losses::new();
    for part in parts {
        let (gradients, part_losses) = part?;
        sum.parts.push(gradients);
        for (name, value) in part_losses {
            *losses.entry(name).or_insert(0.0) += value / shards as f64;
        }
    }
    model.visit(&mut sum);
    Ok(StepOutcome { gradients: sum.sum, norm: sum.squares.sqrt(), losses })
}

/// Sums the shards' gradients, in order, into their mean, and its norm.
struct SumVisitor {
    parts: Vec<GradientsParams>,
    sum: GradientsParams,
    squares: f64,
    scale: f64,
}

impl ModuleVisitor for SumVisitor {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let grads = self.parts.iter_mut().filter_map(|part| part.remove::<D>(param.id));
        if let Some(total) = grads.reduce(|a, b| a + b) {
            let mean = total * self.scale;
            self.squares += mean.clone().square().sum().into_scalar::<f64>();
            self.sum.register(param.id, mean);
        }
    }
}

/// Scales every gradient of `model` in `gradients`.
pub fn scale(model: &Srrf, gradients: &mut GradientsParams, factor: f64) {
    struct Scale<'a>(&'a mut GradientsParams, f64);
    impl ModuleVisitor for Scale<'_> {
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            if let Some(gradient) = self.0.remove::<D>(param.id) {
                self.0.register(param.id, gradient * self.1);
            }
        }
    }
    model.visit(&mut Scale(gradients, factor));
}

/// Clouds of `pairs` as a batch on `device`, with the true poses.
pub fn to_batch(pairs: &[Pair], device: &Device) -> Option<(PairBatch, Tensor<3>, Tensor<2>)> {
    let clouds: Vec<(&PointCloud, &PointCloud)> = pairs.iter().map(|p| (&p.source, &p.target)).collect();
    let poses: Vec<Rigid> = pairs.iter().map(|p| p.target_from_source).collect();
    let batch = PairBatch::new(&clouds, device)?;
    let (rotation, translation) = batch.truth(&poses);
    Some((batch, rotation, translation))
}

/// Gradient and losses of one shard, on a graph of its own.
fn shard(context: &StepContext, model: &Srrf, first: usize) -> Result<(GradientsParams, Losses), StepError> {
    let pairs = context.pairs.shard(first, context.shard)?;
    let (batch, rotation, translation) = to_batch(&pairs, context.device).ok_or(StepError::Ragged(first))?;
    let phase = ChaCha8Rng::seed_from_u64(first as u64).random::<f32>();

    // Only what the stage trains is on the graph.
    let stage = context.stage;
    let trains_sem = stage.sem != SemTraining::Frozen;
    let mut fork = model.clone();
    fork.sem = if trains_sem { fork.sem.train() } else { fork.sem.valid() };
    fork.dense = if stage.registration { fork.dense.train() } else { fork.dense.valid() };
    fork.skeleton = if stage.registration { fork.skeleton.train() } else { fork.skeleton.valid() };

    let (source, target) = (batch.source.clone(), batch.target.clone());
    let mut terms = Terms::default();
    let (source_skeleton, target_skeleton) = if stage.registration {
        let output = fork.forward(context.integration, source.clone(), target.clone(), phase);
        for (names, branch) in [(DENSE, &output.dense), (SKELETON, &output.skeleton)] {
            branch_terms(&mut terms, names, branch, context.losses.correspondence, &rotation, &translation);
        }
        let fused = (output.fused.rotation, output.fused.translation);
        terms.add("fused", registration_loss(fused.0, fused.1, rotation.clone(), translation.clone()), 1.0);
        (output.source_skeleton, output.target_skeleton)
    } else {
        (fork.sem.forward(source.clone()), fork.sem.forward(target.clone()))
    };
    if trains_sem {
        let (x, y) = ((source, &source_skeleton), (target, &target_skeleton));
        skeleton_terms(&mut terms, stage.sem, context.losses, x, y, rotation, translation);
    }

    let (total, losses) = terms.finish();
    let gradients = match total {
        Some(total) => GradientsParams::from_grads(total.backward(), &fork),
        None => GradientsParams::new(),
    };
    Ok((gradients, losses))
}

const DENSE: [&str; 2] = ["dense", "dense_correspondence"];
const SKELETON: [&str; 2] = ["skeleton", "skeleton_correspondence"];

/// `L_reg` of a branch and its correspondence loss.
fn branch_terms(
    terms: &mut Terms,
    [name, correspondence]: [&'static str; 2],
    branch: &BranchOutput,
    weight: f64,
    rotation: &Tensor<3>,
    translation: &Tensor<2>,
) {
    let (r, t) = (branch.rotation.clone(), branch.translation.clone());
    terms.add(name, registration_loss(r, t, rotation.clone(), translation.clone()), 1.0);
    let (points, matches) = (branch.source_points.clone(), branch.matches.clone());
    terms.add(
        correspondence,
        correspondence_loss(points, matches, rotation.clone(), translation.clone()),
        weight,
    );
}

/// The losses of the skeleton module.
fn skeleton_terms(
    terms: &mut Terms,
    training: SemTraining,
    losses: &LossConfig,
    (source, source_skeleton): (Tensor<3>, &Skeleton),
    (target, target_skeleton): (Tensor<3>, &Skeleton),
    rotation: Tensor<3>,
    translation: Tensor<2>,
) {
    terms.add("spread", spread(target_skeleton.points.clone().detach()), 0.0);
    if training == SemTraining::Chamfer {
        let points = Tensor::cat(vec![source_skeleton.points.clone(), target_skeleton.points.clone()], 0);
        terms.add("chamfer", chamfer(points, Tensor::cat(vec![source, target], 0)), 1.0);
        return;
    }
    let (x, y) = ((source, source_skeleton), (target, target_skeleton));
    let loss = skeleton_loss(&losses.skeleton, x, y, rotation, translation);
    terms.add("sampling", loss.sampling, 0.0);
    terms.add("point_to_sphere", loss.point_to_sphere, 0.0);
    terms.add("radius", loss.radius, 0.0);
    terms.add("distribution", loss.distribution, 0.0);
    terms.add("index_match", loss.index_match, 0.0);
    terms.add("sem", loss.total, 1.0);
}

/// The weighted sum of the loss terms, and their values.
#[derive(Default)]
struct Terms {
    total: Option<Tensor<1>>,
    values: Vec<(&'static str, Tensor<1>)>,
}

impl Terms {
    fn add(&mut self, name: &'static str, value: Tensor<1>, weight: f64) {
        self.values.push((name, value.clone().detach()));
        if weight != 0.0 {
            let term = value * weight;
            self.total = Some(match self.total.take() {
                Some(total) => total + term,
                None => term,
            });
        }
    }

    fn finish(self) -> (Option<Tensor<1>>, Losses) {
        let mut losses: Losses =
            self.values.into_iter().map(|(name, value)| (name, value.into_scalar::<f64>())).collect();
        if let Some(total) = &self.total {
            losses.insert("total", total.clone().detach().into_scalar::<f64>());
        }
        (self.total, losses)
    }
}
