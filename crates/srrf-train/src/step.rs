//! One training step: the batch is split into shards, each with its own graph and thread; their
//! gradients are summed in order, checked, clipped and applied.

use burn::module::Module;
use burn::tensor::Device;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use srrf_cloud::{PointCloud, Rigid, profile};
use srrf_corrupt::Pair;
use srrf_model::{HostPairs, PairBatch, SrrfConfig, TrainingBatch};

use crate::config::TrainConfig;
use crate::data::TrainingPairs;
use crate::prefetch::Prefetch;
use crate::rows::RowGradients;
use crate::seam::{Losses, StageOf, Trained};
use crate::workers::Workers;

/// What a step needs to know.
pub struct StepContext<'a, C: Trained = SrrfConfig> {
    /// The run's configuration: network, losses, batches.
    pub config: &'a TrainConfig<C>,
    /// The stage.
    pub stage: &'a StageOf<C>,
    /// The pairs.
    pub pairs: &'a TrainingPairs,
    /// Where the network runs, without autodiff: the shards of a batch go to them in turn. The first one holds
    /// the parameters and the optimiser.
    pub devices: &'a [Device],
    /// Shards by number, where other threads make them; each worker makes its own otherwise.
    pub prefetch: Option<&'a PrefetchOf<C>>,
    /// Whether the run is to stop, looked at before each shard: a step may take minutes.
    pub stopped: &'a (dyn Fn() -> bool + Sync),
}

/// Shards made ahead of their steps.
pub type PrefetchOf<C> = Prefetch<Result<PreparedBatch<<C as Trained>::Layout>, StepError>>;

/// A shard on its device, and its layout.
pub struct PreparedBatch<L> {
    /// The pairs.
    pub batch: TrainingBatch,
    /// What the network has to know of their clouds.
    pub layout: L,
}

/// Makes shard number `number` of a run: pairs and frames, on `device`, and their layout.
///
/// # Errors
/// [`StepError`] when a pair cannot be made.
pub fn prepare<C: Trained>(
    config: &TrainConfig<C>,
    stage: &StageOf<C>,
    pairs: &TrainingPairs,
    number: usize,
    device: &Device,
) -> Result<PreparedBatch<C::Layout>, StepError> {
    let count = config.optimizer.shard;
    let first = number * count;
    let pairs = profile::stage("pairs", || pairs.shard(first, count))?;
    let phase = ChaCha8Rng::seed_from_u64(first as u64).random::<f32>();
    let (pairs, poses) = host_pairs(&pairs).ok_or(StepError::Ragged(first))?;
    let layout = profile::stage("layout", || config.network.layout(&stage.trains, &pairs.clouds, phase));
    Ok(PreparedBatch { batch: TrainingBatch::new(&pairs.upload(device), &poses, phase), layout })
}

impl<L> PreparedBatch<L> {
    /// With what the device can do ahead of the step; see [`Trained::prefetched`].
    ///
    /// # Errors
    /// [`StepError::Copy`] where the device does not give its numbers.
    pub fn prefetched<C: Trained<Layout = L>>(
        self,
        config: &TrainConfig<C>,
        network: &C::Network,
    ) -> Result<Self, StepError> {
        let Self { batch, layout } = self;
        let layout = config.network.prefetched(&config.stages, network, &batch, layout)?;
        Ok(Self { batch, layout })
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
    /// There is no device to run on.
    #[error("no device was given")]
    NoDevice,
    /// A device did not give its numbers.
    #[error(transparent)]
    Copy(#[from] srrf_model::CopyError),
    /// A worker thread panicked.
    #[error("a worker thread stopped; the message above says why")]
    Worker,
}

/// Gradient and losses of step `step` at `model`; `None` where the run is to stop before they are found.
///
/// # Errors
/// [`StepError`] when a pair cannot be made, or a device does not answer.
pub fn gradient<C: Trained>(
    context: &StepContext<C>,
    model: &C::Network,
    step: usize,
    workers: &Workers,
) -> Result<Option<StepOutcome>, StepError> {
    let shards = context.config.optimizer.shards();
    let (first, others) = context.devices.split_first().ok_or(StepError::NoDevice)?;
    let copies: Vec<C::Network> = others.iter().map(|device| model.clone().to_device(device)).collect();
    let run = |i: usize| match device_of(i, context.devices) {
        _ if (context.stopped)() => None,
        0 => Some(shard(context, model, first, step * shards + i)),
        d => Some(shard(context, &copies[d - 1], &others[d - 1], step * shards + i)),
    };
    let parts = workers.map(shards, run).ok_or(StepError::Worker)?;
    let Some(parts) = parts.into_iter().collect::<Option<Vec<_>>>() else { return Ok(None) };

    let mut rows = Vec::with_capacity(shards);
    let mut losses = Losses::new();
    for part in parts {
        let (gradients, part_losses) = part?;
        rows.push(gradients);
        for (name, value) in part_losses {
            *losses.entry(name).or_insert(0.0) += value / shards as f64;
        }
    }
    // By the host's order, not by who is done first, so that the sum is the same in every run.
    let here = |rows: RowGradients| if others.is_empty() { rows } else { rows.to_device(first) };
    let mut gradients = RowGradients::sum(rows.into_iter().map(here));
    if shards > 1 {
        gradients.scale(1.0 / shards as f64);
    }
    let norm = gradients.norm()?;
    Ok(Some(StepOutcome { gradients, norm, losses }))
}

/// Which of the devices takes shard `i` of a batch.
pub fn device_of(i: usize, devices: &[Device]) -> usize {
    i % devices.len()
}

/// `pairs` on `device`, with what the network learns from them; `None` where they differ in their number of points.
pub fn to_batch(pairs: &[Pair], phase: f32, device: &Device) -> Option<(PairBatch, TrainingBatch)> {
    let (pairs, poses) = host_pairs(pairs)?;
    let pairs = pairs.upload(device);
    let batch = TrainingBatch::new(&pairs, &poses, phase);
    Some((pairs, batch))
}

/// Pairs in network units, and their true poses between the clouds as they were given.
fn host_pairs(pairs: &[Pair]) -> Option<(HostPairs, Vec<Rigid>)> {
    let clouds: Vec<(&PointCloud, &PointCloud)> = pairs.iter().map(|p| (&p.source, &p.target)).collect();
    Some((HostPairs::new(&clouds)?, pairs.iter().map(|p| p.target_from_source).collect()))
}

/// Gradient and losses of one shard.
fn shard<C: Trained>(
    context: &StepContext<C>,
    network: &C::Network,
    device: &Device,
    number: usize,
) -> Result<(RowGradients, Losses), StepError> {
    let StepContext { config, stage, pairs, prefetch, .. } = *context;
    let prepared = match prefetch {
        Some(prefetch) => prefetch.take(number).ok_or(StepError::Worker)?,
        None => prepare(config, stage, pairs, number, device),
    };
    let PreparedBatch { batch, layout } = prepared?;
    let (gradients, losses) = profile::stage("network", || {
        config.network.gradient(&config.losses, &stage.trains, network, batch, layout)
    })?;
    Ok((RowGradients::new(gradients, network), losses))
}
