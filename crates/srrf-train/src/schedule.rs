//! Where a run stands: steps, stages, epochs and the learning rate.

use crate::config::TrainConfig;
use crate::seam::Trained;
use crate::stage::{RateSchedule, StageConfig};

/// The steps of a run.
#[derive(Debug, Clone)]
pub struct Plan {
    /// First step of each stage, and one past the last step of the run.
    bounds: Vec<usize>,
    /// Pairs a step.
    batch: usize,
    /// Training shapes, the length of an epoch in pairs.
    shapes: usize,
}

impl Plan {
    /// The plan of `config` over `shapes` training shapes.
    pub fn new<C: Trained>(config: &TrainConfig<C>, shapes: usize) -> Self {
        let batch = config.optimizer.batch;
        let mut bounds = vec![0];
        for stage in &config.stages {
            let steps = ((stage.epochs * shapes as f64) / batch as f64).ceil().max(1.0) as usize;
            bounds.push(bounds[bounds.len() - 1] + steps);
        }
        Self { bounds, batch, shapes }
    }

    /// Number of steps in all.
    pub fn steps(&self) -> usize {
        self.bounds[self.bounds.len() - 1]
    }

    /// Index of the stage that step `step` belongs to.
    pub fn stage(&self, step: usize) -> usize {
        self.bounds.partition_point(|&first| first <= step).saturating_sub(1).min(self.bounds.len() - 2)
    }

    /// Steps in `epochs` epochs, at least 1.
    pub fn steps_in(&self, epochs: f64) -> usize {
        ((epochs * self.shapes as f64 / self.batch as f64).round() as usize).max(1)
    }

    /// Epochs done after `step` steps.
    pub fn epochs(&self, step: usize) -> f64 {
        (step * self.batch) as f64 / self.shapes as f64
    }

    /// The learning rate of step `step`.
    pub fn learning_rate<P>(&self, stage: &StageConfig<P>, step: usize) -> f64 {
        let index = self.stage(step);
        let (first, end) = (self.bounds[index], self.bounds[index + 1]);
        let done = (step - first) as f64 / (end - first) as f64;
        match &stage.schedule {
            RateSchedule::Milestones { at, of_epochs, factor } => {
                let passed = at.iter().filter(|&&epoch| done >= epoch / of_epochs).count();
                stage.learning_rate * factor.powi(passed as i32)
            }
            RateSchedule::Cosine { warmup } => {
                let warm = ((done + 1.0 / (end - first) as f64) / warmup.max(f64::MIN_POSITIVE)).min(1.0);
                let fall = ((done - warmup) / (1.0 - warmup)).clamp(0.0, 1.0);
                stage.learning_rate * warm * 0.5 * (1.0 + (std::f64::consts::PI * fall).cos())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stage(epochs: f64, schedule: RateSchedule) -> StageConfig<()> {
        StageConfig { name: "s".into(), epochs, trains: (), learning_rate: 1e-3, schedule }
    }

    #[test]
    fn the_papers_milestones_and_their_scaling() {
        let paper = RateSchedule::Milestones { at: vec![75.0, 150.0, 200.0], of_epochs: 250.0, factor: 0.1 };
        for (epochs, scale) in [(250.0, 1.0), (25.0, 0.1)] {
            let stage = stage(epochs, paper.clone());
            let shapes = 320;
            let steps = (epochs * 10.0) as usize; // batch 32
            let plan = Plan { bounds: vec![0, steps], batch: 32, shapes };
            let rate = |epoch: f64| plan.learning_rate(&stage, (epoch * scale * 10.0) as usize);
            assert_eq!(rate(74.0), 1e-3);
            assert!((rate(75.0) - 1e-4).abs() < 1e-12);
            assert!((rate(150.0) - 1e-5).abs() < 1e-12);
            assert!((rate(249.0) - 1e-6).abs() < 1e-12);
        }
    }

    #[test]
    fn cosine_rises_and_falls_within_its_stage() {
        let stage = stage(1.0, RateSchedule::Cosine { warmup: 0.1 });
        let plan = Plan { bounds: vec![0, 50, 150], batch: 1, shapes: 1 };
        assert_eq!(plan.stage(49), 0);
        assert_eq!(plan.stage(50), 1);
        assert_eq!(plan.stage(149), 1);
        assert!((plan.learning_rate(&stage, 50) - 1e-4).abs() < 1e-9);
        assert!((plan.learning_rate(&stage, 60) - 1e-3).abs() < 1e-5);
        assert!(plan.learning_rate(&stage, 149) < 1e-6);
    }
}
