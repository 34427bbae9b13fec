//! The loop that the variants of ICP share: match, weigh, step.

use nalgebra::Vector3;
use srrf_cloud::{
    KnnIndex, PairFrame, RegisterError, Registration, Rigid, Solid, estimate_normals, spacing_of,
};
use srrf_refine::{Match, NormalEquations};

/// A target made ready, and a source.
pub(crate) struct Scene {
    source: Vec<Vector3<f64>>,
    index: KnnIndex,
    normals: Option<Vec<Vector3<f64>>>,
    /// The target is about its mean; the source is where it was given.
    frame: PairFrame,
    /// Median distance between neighbouring target points.
    pub spacing: f64,
    /// Root mean square distance of the target from its mean.
    pub radius: f64,
}

impl Scene {
    /// With normals from `neighbours` points each, if asked for.
    pub fn new(
        source: Solid<'_>,
        target: Solid<'_>,
        neighbours: Option<usize>,
    ) -> Result<Self, RegisterError> {
        let frame = PairFrame::about(Vector3::zeros(), target.centroid());
        let centred: Vec<[f64; 3]> = target.points().iter().map(|p| frame.target(p)).collect();
        let index = KnnIndex::new(&centred).map_err(RegisterError::Target)?;
        let normals = match neighbours {
            Some(k) => Some(estimate_normals(&centred, k).map_err(RegisterError::Target)?),
            None => None,
        };
        let squares: f64 = centred.iter().map(|p| Vector3::from(*p).norm_squared()).sum();
        Ok(Self {
            source: source.points().iter().map(|p| Vector3::from(*p)).collect(),
            spacing: spacing_of(&index),
            radius: (squares / centred.len() as f64).sqrt(),
            normals: normals.map(|n| n.into_iter().map(Vector3::from).collect()),
            index,
            frame,
        })
    }

    /// Iterates from the identity. `weigh` gives each match a weight from the squared distances of all
    /// matches.
    pub fn run(
        &self,
        max_iterations: usize,
        tolerance: f64,
        weigh: impl Fn(&[f64], usize) -> Vec<f64>,
    ) -> Result<Registration, RegisterError> {
        let metric = if self.normals.is_some() { (0.01, 1.0) } else { (1.0, 0.0) };
        let mut pose = self.frame.pose(&Rigid::identity());
        let (mut converged, mut iterations) = (false, 0);
        while iterations < max_iterations && !converged {
            let matches: Vec<Match> =
                self.source.iter().map(|p| self.nearest(&(pose.rotation * p + pose.translation))).collect();
            let squared: Vec<f64> = matches.iter().map(|m| (m.moved - m.fixed).norm_squared()).collect();
            let weights = weigh(&squared, iterations);
            let mut sums = NormalEquations::default();
            for (m, w) in matches.iter().zip(&weights).filter(|(_, w)| **w > 0.0) {
                sums.add(m, metric.0 * w, metric.1 * w);
            }
            let next = sums.step(&pose, self.radius).ok_or_else(|| {
                RegisterError::NoPose(
                    format!("iteration {}: the matches determine no step", iterations + 1).into(),
                )
            })?;
            iterations += 1;
            // How far the source moves, against the size of the target.
            let change: f64 = self
                .source
                .iter()
                .map(|p| {
                    ((next.rotation - pose.rotation) * p + next.translation - pose.translation).norm_squared()
                })
                .sum();
            converged = (change / self.source.len() as f64).sqrt() <= tolerance * self.radius;
            pose = next;
        }
        Ok(Registration { converged, iterations, ..Registration::from_pose(self.frame.undo_pose(&pose)) })
    }

    fn nearest(&self, moved: &Vector3<f64>) -> Match {
        let (j, _) = self.index.nearest(&(*moved).into());
        let normal = self.normals.as_ref().map_or_else(Vector3::zeros, |n| n[j]);
        Match { moved: *moved, fixed: self.index.points()[j].into(), normal }
    }
}
