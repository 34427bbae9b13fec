//! The robust stage: nearest neighbours both ways under a Geman-McClure kernel whose scale shrinks.

use srrf_cloud::Rigid;

use crate::matching::{Partners, equations, median_distance, motion};
use crate::prepared::CloudLevel;
use crate::{Metric, RefineConfig};

/// Where a stage ended.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Descent {
    pub pose: Rigid,
    pub iterations: usize,
    pub converged: bool,
}

/// How the kernel's scale runs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ScaleSchedule {
    pub start: f64,
    pub end: f64,
    pub shrink: f64,
    pub iterations: usize,
    /// The first iterations look at every so many-th point.
    pub first_stride: usize,
    /// Matches are kept while the pose moves the cloud by less than this length: looking for them is nearly all the work.
    pub kept_within: f64,
    /// The run ends when a step moves the cloud by less than this length.
    pub tolerance: f64,
}

impl ScaleSchedule {
    /// The schedule of `config` from the residuals at `pose`.
    pub fn new(
        source: &CloudLevel,
        target: &CloudLevel,
        pose: &Rigid,
        radius: f64,
        config: &RefineConfig,
    ) -> Self {
        let spacing = source.spacing.max(target.spacing);
        let median = median_distance(source, target, pose);
        let start = (config.start_residuals * median).max(2.0 * spacing).min((0.25 * radius).max(spacing));
        let end = config.end_spacings * spacing;
        Self {
            start,
            end,
            shrink: config.shrink,
            iterations: config.max_iterations,
            first_stride: 1,
            kept_within: 0.0,
            tolerance: config.tolerance * radius,
        }
    }

    /// Looser, for large clouds: matches are kept within `kept` point spacings, and steps of `tolerance` spacings are none.
    pub fn loosened(self, spacing: f64, kept: f64, tolerance: f64) -> Self {
        Self { kept_within: kept * spacing, tolerance: self.tolerance.max(tolerance * spacing), ..self }
    }
}

/// Runs from `pose`. The weight of a match with residual `r` at scale `s` is
/// `(s^2 / (s^2 + r^2))^2` (Geman and McClure 1985; the kernel of KISS-ICP), `r` the distance of the
/// two points whatever the metric.
pub(crate) fn descend(
    source: &CloudLevel,
    target: &CloudLevel,
    pose: &Rigid,
    radius: f64,
    metric: Metric,
    schedule: &ScaleSchedule,
) -> Descent {
    let (a, b) = metric.weights();
    let mut looked: Option<(Rigid, Partners)> = None;
    let mut stage = Descent { pose: *pose, iterations: 0, converged: false };
    let mut scale = schedule.start;
    while stage.iterations < schedule.iterations {
        let stride = if scale > schedule.end { schedule.first_stride } else { 1 };
        let kept = looked.take().filter(|(at, partners)| {
            partners.stride == stride && motion(at, &stage.pose, radius) < schedule.kept_within
        });
        let fresh = kept.is_none();
        let (at, partners) =
            kept.unwrap_or_else(|| (stage.pose, Partners::find(source, target, &stage.pose, stride)));
        let squared = scale * scale;
        let sums = equations(source, target, &stage.pose, &partners, |m| {
            let w = squared / (squared + (m.moved - m.fixed).norm_squared());
            Some((a * w * w, b * w * w))
        });
        let Some(next) = sums.step(&stage.pose, radius) else { return stage };
        let moved = motion(&stage.pose, &next, radius);
        stage.pose = next;
        stage.iterations += 1;
        let stands = scale <= schedule.end && moved < schedule.tolerance;
        if stands && fresh {
            stage.converged = true;
            return stage;
        }
        // What stands still among kept matches need not among new ones.
        looked = (!stands).then_some((at, partners));
        scale = (scale * schedule.shrink).max(schedule.end);
    }
    stage
}
