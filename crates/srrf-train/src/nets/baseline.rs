//! How a learned baseline is trained: every parameter in every stage, with its own losses.

use std::path::Path;

use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::Device;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use srrf_baselines::{LearnedConfig, embedded};
use srrf_model::ops::{CopyError, HostClouds};
use srrf_model::weights::{WeightsError, parse, read};
use srrf_model::{NetworkConfig, TrainingBatch, WrongSize};

use crate::seam::{FoundPoses, LossTerms, Losses, Trained};

/// A learned baseline as the loop sees it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent, bound = "")]
#[schemars(bound = "")]
pub struct Baseline<C: LearnedConfig>(pub C);

/// A stage trains the whole of a baseline, so there is nothing to say; files of before may say `sem = "frozen"` and
/// `registration = true`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Whole {
    /// For srrf: a baseline has no skeleton module.
    #[serde(default, rename = "sem", skip_serializing)]
    #[schemars(skip)]
    skeletons: Option<String>,
    /// For srrf: a stage trains the whole of a baseline.
    #[serde(default, skip_serializing)]
    #[schemars(skip)]
    registration: Option<bool>,
}

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
    type Parts = Whole;
    type Layout = ();
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

    fn wrong_parts(parts: &Whole) -> Option<(&'static str, &'static str)> {
        if parts.skeletons.as_deref().is_some_and(|sem| sem != "frozen") {
            return Some(("sem", "is for srrf; a baseline has no skeleton module"));
        }
        (parts.registration == Some(false))
            .then_some(("registration", "must be true, or the stage trains nothing"))
    }

    fn trains_poses(_: &Whole) -> bool {
        true
    }

    fn layout(&self, _: &Whole, _: &HostClouds, _: f32) {}

    fn gradient(
        &self,
        losses: &C::Losses,
        _: &Whole,
        network: &C::Network,
        batch: TrainingBatch,
        (): (),
    ) -> Result<(GradientsParams, Losses), CopyError> {
        let network = network.clone().train();
        let mut terms = LossTerms::default();
        for (name, value, weight) in self.0.losses(losses, &network, &batch)? {
            terms.add(name, value, weight);
        }
        terms.finish(&network)
    }

    fn found(&self, network: &C::Network, batch: TrainingBatch) -> Result<FoundPoses, CopyError> {
        let pose = self.0.pose(network, batch.source, batch.target)?;
        Ok(FoundPoses { poses: vec![(pose.rotation, pose.translation)], notes: Vec::new() })
    }
}
