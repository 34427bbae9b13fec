//! Optimisers by configuration.

use burn::optim::decay::WeightDecayConfig;
use burn::optim::momentum::MomentumConfig;
use burn::optim::{AdamConfig, AdamWConfig, ModuleOptimizer, SgdConfig};

use crate::config::{OptimizerConfig, OptimizerKind};

/// The optimiser of a configuration.
pub fn optimizer(config: &OptimizerConfig) -> ModuleOptimizer {
    let (beta_2, decay) = (config.beta_2 as f32, config.weight_decay as f32);
    match config.kind {
        OptimizerKind::Adam => {
            let adam = AdamConfig::new().with_beta_2(beta_2).with_epsilon(1e-8);
            adam.with_weight_decay((decay > 0.0).then(|| WeightDecayConfig::new(decay))).init()
        }
        OptimizerKind::Adamw => {
            AdamWConfig::new().with_beta_2(beta_2).with_epsilon(1e-8).with_weight_decay(decay).init()
        }
        OptimizerKind::Sgd => {
            // PyTorch's: no dampening, no Nesterov.
            let momentum = config.momentum.map(|momentum| {
                MomentumConfig::new().with_momentum(momentum).with_dampening(0.0).with_nesterov(false)
            });
            let sgd = SgdConfig::new().with_momentum(momentum);
            sgd.with_weight_decay((decay > 0.0).then(|| WeightDecayConfig::new(decay))).init()
        }
    }
}
