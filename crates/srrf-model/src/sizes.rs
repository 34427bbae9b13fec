//! The sizes with which a network can be built.

use std::fmt::Debug;

use burn::module::Module;
use burn::tensor::Device;
use schemars::{JsonSchema, schema_for};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::branch::BranchConfig;
use crate::ranges::out_of_range;
use crate::sem::SemConfig;
use crate::srrf::{Srrf, SrrfConfig};

/// The sizes of a network: what it is built from, and what stands beside its weights.
pub trait NetworkConfig:
    Clone + Debug + PartialEq + Serialize + DeserializeOwned + JsonSchema + Send + Sync
{
    /// The network.
    type Network: Module + Send + Sync;
    /// Key of the sizes in the header of a weights file.
    const KEY: &'static str;

    /// Checks that [`NetworkConfig::init`] and the forward pass can work with these sizes.
    ///
    /// # Errors
    /// [`WrongSize`] for the first one that cannot be.
    fn check(&self) -> Result<(), WrongSize>;

    /// Checks that every number is in its range, before anything is built with it; then as [`NetworkConfig::check`].
    ///
    /// # Errors
    /// [`WrongSize`] for the first one that is not.
    fn check_ranges(&self) -> Result<(), WrongSize> {
        let value = toml::Value::try_from(self).map_err(|e| WrongSize::new("(all)", e.to_string()))?;
        match out_of_range(&schema_for!(Self), &value) {
            Some((key, why)) => Err(WrongSize { key, why }),
            None => self.check(),
        }
    }

    /// A new network; see [`crate::init::seeded`] for weights that do not depend on the backend.
    fn init(&self, device: &Device) -> Self::Network;
}

impl NetworkConfig for SrrfConfig {
    type Network = Srrf;
    const KEY: &'static str = "srrf_config";

    fn check(&self) -> Result<(), WrongSize> {
        self.check()
    }

    fn init(&self, device: &Device) -> Srrf {
        self.init(device)
    }
}

/// A size with which the network cannot be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{key}` {why}")]
pub struct WrongSize {
    /// Where it stands in the [`SrrfConfig`], such as `dense.sfe.heads`.
    pub key: String,
    /// What it must be.
    pub why: String,
}

impl WrongSize {
    /// The error for the value at `key`.
    pub fn new(key: impl Into<String>, why: impl Into<String>) -> Self {
        Self { key: key.into(), why: why.into() }
    }
}

impl SrrfConfig {
    /// Checks that [`SrrfConfig::init`] and the forward pass can work with these sizes.
    ///
    /// # Errors
    /// [`WrongSize`] for the first one that cannot be.
    pub fn check(&self) -> Result<(), WrongSize> {
        check_sem(&self.sem)?;
        check_branch("dense", &self.dense)?;
        check_branch("skeleton", &self.skeleton)?;
        if self.inference.passes == 0 {
            return wrong("inference.passes".into(), "must be 1 or more");
        }
        if let Some((key, why)) = self.integration.wrong() {
            return wrong(format!("integration.{key}"), why);
        }
        if self.inference.prior.is_some_and(|deviation| !(deviation.is_finite() && deviation > 0.0)) {
            return wrong("inference.prior".into(), "must be a number above 0; leave it out for no prior");
        }
        Ok(())
    }
}

fn wrong(key: String, why: impl Into<String>) -> Result<(), WrongSize> {
    Err(WrongSize { key, why: why.into() })
}

fn check_sem(sem: &SemConfig) -> Result<(), WrongSize> {
    if sem.levels.is_empty() {
        return wrong("sem.levels".into(), "needs 1 level or more");
    }
    for (i, level) in sem.levels.iter().enumerate() {
        if level.points == 0 || level.neighbours == 0 {
            return wrong(format!("sem.levels[{i}]"), "needs 1 point and 1 neighbour or more");
        }
        if level.widths.is_empty() || level.widths.contains(&0) {
            return wrong(format!("sem.levels[{i}].widths"), "needs 1 layer or more, each 1 wide or more");
        }
    }
    if sem.global == 0 || sem.head.contains(&0) {
        return wrong("sem.head".into(), "and sem.global must be 1 wide or more");
    }
    if sem.skeleton_points < 3 {
        return wrong("sem.skeleton_points".into(), "must be 3 or more");
    }
    Ok(())
}

fn check_branch(name: &str, branch: &BranchConfig) -> Result<(), WrongSize> {
    let (sfe, pfi) = (&branch.sfe, &branch.pfi);
    if sfe.layers == 0 || sfe.neighbours == 0 || sfe.width == 0 || sfe.mlp == 0 {
        return wrong(format!("{name}.sfe"), "needs 1 layer, neighbour and channel or more");
    }
    if sfe.heads == 0 || !sfe.width.is_multiple_of(sfe.heads) {
        return wrong(format!("{name}.sfe.heads"), format!("must divide the width, {}", sfe.width));
    }
    let width = sfe.output_width();
    if pfi.heads == 0 || !width.is_multiple_of(pfi.heads) {
        return wrong(format!("{name}.pfi.heads"), format!("must divide layers * width, {width}"));
    }
    if pfi.feed_forward == 0 || pfi.position_hidden == 0 || pfi.squeeze == 0 {
        return wrong(format!("{name}.pfi"), "needs widths and a squeeze of 1 or more");
    }
    if (1..3).contains(&branch.tokens) {
        return wrong(format!("{name}.tokens"), "must be 0 (all) or 3 or more");
    }
    Ok(())
}
