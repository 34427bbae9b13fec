//! One training step: the batch is split into shards, each with its own graph and thread; their
//! gradients are summed in order, checked, clipped and applied.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use burn::module::Module;
use burn::tensor::Device;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use srrf_cloud::{PointCloud, Rigid, profile};
use srrf_corrupt::Pair;
use srrf_model::{HostPairs, SrrfConfig};

use crate::ahead::Ahead;
use crate::config::{Reduce, StageConfig, TrainConfig};
use crate::data::TrainingPairs;
use crate::network::{Shard, Trained};
use crate::rows::RowGradients;

/// Named means over the pairs of a batch.
pub type Losses = BTreeMap<&'static str, f64>;

/// What a step needs to know.
pub struct StepContext<'a, C: Trained = SrrfConfig> {
    /// The run's configuration: network, losses, batches.
    pub config: &'a TrainConfig<C>,
    /// The stage.
    pub stage: &'a StageConfig,
    /// The pairs.
    pub pairs: &'a TrainingPairs,
    /// Where the network runs, without autodiff: the shards of a batch go to them in turn. The first one holds
    /// the parameters and the optimiser.
    pub devices: &'a [Device],
    /// Shards by number, where other threads make them; each worker makes its own otherwise.
    pub ahead: Option<&'a AheadOf<C>>,
}

/// Shards made ahead of their steps.
pub type AheadOf<C> = Ahead<Result<Prepared<<C as Trained>::Layout>, StepError>>;

/// A shard on its device, and its layout.
pub struct Prepared<L> {
    /// The pairs.
    pub shard: Shard,
    /// What the network has to know of their clouds.
    pub layout: L,
}

/// Makes shard number `number` of a run: pairs and frames, on `device`, and their layout.
///
/// # Errors
/// [`StepError`] when a pair cannot be made.
pub fn prepare<C: Trained>(
    config: &TrainConfig<C>,
    stage: &StageConfig,
    pairs: &TrainingPairs,
    number: usize,
    device: &Device,
) -> Result<Prepared<C::Layout>, StepError> {
    let count = config.optimizer.shard;
    let first = number * count;
    let pairs = profile::stage("pairs", || pairs.shard(first, count))?;
    let phase = ChaCha8Rng::seed_from_u64(first as u64).random::<f32>();
    let (pairs, poses) = host_pairs(&pairs).ok_or(StepError::Ragged(first))?;
    let layout = profile::stage("layout", || config.network.layout(stage, &pairs.clouds, phase));
    Ok(Prepared { shard: upload(&pairs, &poses, phase, device), layout })
}

impl<L> Prepared<L> {
    /// With what the device can do ahead of the step; see [`Trained::ahead`].
    ///
    /// # Errors
    /// [`StepError::Copy`] where the device does not give its numbers.
    pub fn ahead<C: Trained<Layout = L>>(
        self,
        config: &TrainConfig<C>,
        network: &C::Network,
    ) -> Result<Self, StepError> {
        let Self { shard, layout } = self;
        let layout = config.network.ahead(&config.stages, network, &shard, layout)?;
        Ok(Self { shard, layout })
    }
}

/// What a step found.
pub struct StepOutcome {
    /// The mean gradient.
    pub gradients: RowGradients,
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
    /// A device did not give its numbers.
    #[error(transparent)]
    Copy(#[from] srrf_model::CopyError),
    /// There is no device to run on.
    #[error("no device was given")]
    NoDevice,
    /// A worker thread panicked.
    #[error("a worker thread stopped; the message above says why")]
    Worker,
}

/// A pool of rayon pools: shards run side by side. On the CPU each pool has one thread: nothing inside a
/// shard is split, so that results do not depend on the number of threads.
pub struct Workers(Vec<rayon::ThreadPool>);

impl Workers {
    /// `threads` workers.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub fn new(threads: usize) -> Result<Self, rayon::ThreadPoolBuildError> {
        Self::wide(threads, 1)
    }

    /// `workers` workers, each of which may split what the host does for its shard among `threads`
    /// threads.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub fn wide(workers: usize, threads: usize) -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = |_| rayon::ThreadPoolBuilder::new().num_threads(threads.max(1)).build();
        (0..workers.max(1)).map(pool).collect::<Result<_, _>>().map(Self)
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
pub fn gradient<C: Trained>(
    context: &StepContext<C>,
    model: &C::Network,
    step: usize,
    workers: &Workers,
) -> Result<StepOutcome, StepError> {
    let shards = context.config.optimizer.shards();
    let (first, others) = context.devices.split_first().ok_or(StepError::NoDevice)?;
    let copies: Vec<C::Network> = others.iter().map(|device| model.clone().to_device(device)).collect();
    let run = |i: usize| match device_of(i, context.devices) {
        0 => shard(context, model, first, step * shards + i),
        d => shard(context, &copies[d - 1], &others[d - 1], step * shards + i),
    };
    let parts = workers.map(shards, run).ok_or(StepError::Worker)?;

    let mut rows = Vec::with_capacity(shards);
    let mut losses = Losses::new();
    for part in parts {
        let (gradients, part_losses) = part?;
        rows.push(gradients);
        for (name, value) in part_losses {
            *losses.entry(name).or_insert(0.0) += value / shards as f64;
        }
    }
    let mut gradients = match context.config.reduce {
        // By the host's order, not by who is done first, so that the sum is the same in every run.
        Reduce::Ordered => {
            let here = |rows: RowGradients| if others.is_empty() { rows } else { rows.to_device(first) };
            RowGradients::sum(rows.into_iter().map(here))
        }
        Reduce::Collective => {
            let mut each: Vec<Vec<RowGradients>> = context.devices.iter().map(|_| Vec::new()).collect();
            for (i, rows) in rows.into_iter().enumerate() {
                each[device_of(i, context.devices)].push(rows);
            }
            RowGradients::all_reduce(each.into_iter().map(RowGradients::sum).collect(), context.devices)
        }
    };
    if shards > 1 {
        gradients.scale(1.0 / shards as f64);
    }
    let norm = gradients.norm()?;
    Ok(StepOutcome { gradients, norm, losses })
}

/// Which of the devices takes shard `i` of a batch.
pub fn device_of(i: usize, devices: &[Device]) -> usize {
    i % devices.len()
}

/// `pairs` as a shard on `device`.
pub fn to_shard(pairs: &[Pair], phase: f32, device: &Device) -> Option<Shard> {
    let (pairs, poses) = host_pairs(pairs)?;
    Some(upload(&pairs, &poses, phase, device))
}

/// Pairs in network units, and their true poses between the clouds as they were given.
fn host_pairs(pairs: &[Pair]) -> Option<(HostPairs, Vec<Rigid>)> {
    let clouds: Vec<(&PointCloud, &PointCloud)> = pairs.iter().map(|p| (&p.source, &p.target)).collect();
    Some((HostPairs::new(&clouds)?, pairs.iter().map(|p| p.target_from_source).collect()))
}

fn upload(pairs: &HostPairs, poses: &[Rigid], phase: f32, device: &Device) -> Shard {
    let batch = pairs.upload(device);
    let (rotation, translation) = batch.truth(poses);
    Shard { batch, rotation, translation, phase }
}

/// Gradient and losses of one shard.
fn shard<C: Trained>(
    context: &StepContext<C>,
    network: &C::Network,
    device: &Device,
    number: usize,
) -> Result<(RowGradients, Losses), StepError> {
    let StepContext { config, stage, pairs, ahead, .. } = *context;
    let prepared = match ahead {
        Some(ahead) => ahead.take(number).ok_or(StepError::Worker)?,
        None => prepare(config, stage, pairs, number, device),
    };
    let Prepared { shard, layout } = prepared?;
    let (gradients, losses) =
        profile::stage("network", || config.network.gradient(&config.losses, stage, network, shard, layout))?;
    Ok((RowGradients::new(gradients, network), losses))
}
