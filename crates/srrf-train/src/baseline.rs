//! How a learned baseline is trained: every parameter in every stage, with its own losses.

use std::path::Path;

use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::Device;
use serde::{Deserialize, Serialize};
use srrf_baselines::{LearnedConfig, Lesson, embedded};
use srrf_model::ops::{CopyError, HostClouds};
use srrf_model::weights::{WeightsError, parse, read};
use srrf_model::{NetworkConfig, WrongSize};

use crate::config::{SemTraining, StageConfig};
use crate::network::{Found, Shard, Terms, Trained};
use crate::step::Losses;

/// A learned baseline as the loop sees it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent, bound = "")]
pub struct Baseline<C: LearnedConfig>(pub C);

impl<C: LearnedConfig> NetworkConfig for Baseline<C> {
    type Network = C::Network;
    const KEY: &'static str = C::KEY;

    fn check(&self) -> Result<(), WrongSize> {
        self.0.check()
    }

    fn init(&self, device: &Device) -> C::Network {
        self.0.init(device)
    }
}

impl<C: LearnedConfig> Trained for Baseline<C> {
    type LossConfig = C::Losses;
    const METHOD: &'static str = C::NAME;
    const ROWS: &'static [&'static str] = &[C::NAME];
    const CURVES: &'static [&'static str] = C::TERMS;

    fn start(start: &str, device: &Device) -> Result<C::Network, WeightsError> {
        let loaded = match embedded(start) {
            Some(bytes) => parse::<C>(bytes, start, device)?,
            None => read::<C>(Path::new(start), device)?,
        };
        Ok(loaded.model)
    }

    fn wrong_stage(stage: &StageConfig) -> Option<(&'static str, &'static str)> {
        if stage.sem != SemTraining::Frozen {
            return Some(("sem", "is for srrf; a baseline has no skeleton module"));
        }
        (!stage.registration).then_some(("registration", "must be true, or the stage trains nothing"))
    }

    type Layout = ();

    fn layout(&self, _: &StageConfig, _: &HostClouds, _: f32) {}

    fn gradient(
        &self,
        losses: &C::Losses,
        _: &StageConfig,
        network: &C::Network,
        shard: Shard,
        (): (),
    ) -> Result<(GradientsParams, Losses), CopyError> {
        let network = network.clone().train();
        let mut terms = Terms::default();
        for (name, value, weight) in self.0.losses(losses, &network, &lesson(shard))? {
            terms.add(name, value, weight);
        }
        terms.finish(&network)
    }

    fn found(&self, network: &C::Network, shard: Shard) -> Result<Found, CopyError> {
        let (source, target) = (shard.batch.source.clone(), shard.batch.target.clone());
        let pose = self.0.pose(network, source, target)?;
        let poses = vec![shard.batch.poses(&pose.rotation, &pose.translation)?];
        Ok(Found { poses, notes: Vec::new() })
    }
}

fn lesson(shard: Shard) -> Lesson {
    let Shard { batch, rotation, translation, phase } = shard;
    Lesson { source: batch.source, target: batch.target, rotation, translation, phase }
}
