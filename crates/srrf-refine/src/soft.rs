//! The soft stage: every point is matched with all its near neighbours, by probability.

use nalgebra::Vector3;
use srrf_cloud::Rigid;

use crate::matching::motion;
use crate::prepared::CloudLevel;
use crate::robust::Descent;
use crate::solve::{Match, NormalEquations};

/// Candidates of a point. At the end of the robust stage the true match is nearly always among the
/// eight nearest.
const CANDIDATES: usize = 8;
/// Candidates are looked up this often.
const ROUNDS: usize = 2;
/// Steps between look-ups.
const STEPS: usize = 5;
/// Weight of "no match", against 1 for a candidate at distance 0.
const OUTLIER: f64 = 0.01;

/// Expectation maximisation over matches, with the noise estimated on the way: the model of
/// coherent point drift (Myronenko and Song 2010) and EM-ICP (Granger and Pennec 2002), both ways,
/// restricted to the nearest candidates.
///
/// A point at `x` belongs to candidate `q` with probability `exp(-|x - q|^2 / 2 s^2)`, normalised
/// with the weight of an outlier; `s` follows from the matches, starts at 0.7 of the point spacing, and
/// goes to zero where points coincide. Nearest neighbours, in contrast, always choose the candidate
/// that agrees with the current pose, and so hardly move it.
pub(crate) fn soft(
    source: &CloudLevel,
    target: &CloudLevel,
    pose: &Rigid,
    radius: f64,
    tolerance: f64,
) -> Descent {
    let spacing = source.spacing.max(target.spacing);
    let smallest = 1e-3 * spacing;
    let mut deviation = 0.7 * spacing;
    let mut stage = Descent { pose: *pose, iterations: 0, converged: false };
    for _ in 0..ROUNDS {
        let inverse = stage.pose.inverse();
        let forth = candidates(target, source.points(), &stage.pose);
        let back = candidates(source, target.points(), &inverse);
        for _ in 0..STEPS {
            let moved: Vec<[f64; 3]> = source.points().iter().map(|p| stage.pose.apply(p)).collect();
            let mut sums = SoftSums { scale: 0.5 / (deviation * deviation), ..SoftSums::default() };
            for (x, near) in moved.iter().zip(&forth) {
                if let Some((mean, w)) = sums.expect(x, near, target.points()) {
                    let found = Match { moved: (*x).into(), fixed: mean, normal: Vector3::zeros() };
                    sums.equations.add(&found, w, 0.0);
                }
            }
            for (y, near) in target.points().iter().zip(&back) {
                if let Some((mean, w)) = sums.expect(y, near, &moved) {
                    let found = Match { moved: mean, fixed: (*y).into(), normal: Vector3::zeros() };
                    sums.equations.add(&found, w, 0.0);
                }
            }
            let Some(next) = sums.equations.step(&stage.pose, radius) else { return stage };
            let step = motion(&stage.pose, &next, radius);
            stage.pose = next;
            stage.iterations += 1;
            deviation = (sums.squares / sums.weight / 3.0).sqrt().max(smallest);
            stage.converged = step < 100.0 * tolerance * radius;
        }
    }
    stage
}

/// The nearest points of `level` to each of `points` moved by `pose`.
fn candidates(level: &CloudLevel, points: &[[f64; 3]], pose: &Rigid) -> Vec<Vec<(usize, f64)>> {
    points.iter().map(|p| level.index.k_nearest(&pose.apply(p), CANDIDATES)).collect()
}

#[derive(Default)]
struct SoftSums {
    /// `1 / 2 s^2`.
    scale: f64,
    equations: NormalEquations,
    /// Sum of the probabilities.
    weight: f64,
    /// Sum of the squared distances, by probability.
    squares: f64,
}

impl SoftSums {
    /// The mean of the candidates by probability, and the probability of being matched at all.
    fn expect(
        &mut self,
        x: &[f64; 3],
        near: &[(usize, f64)],
        points: &[[f64; 3]],
    ) -> Option<(Vector3<f64>, f64)> {
        let x = Vector3::from(*x);
        let (mut total, mut mean, mut squares) = (0.0, Vector3::zeros(), 0.0);
        for &(j, _) in near {
            let q = Vector3::from(points[j]);
            let squared = (q - x).norm_squared();
            let likelihood = (-squared * self.scale).exp();
            total += likelihood;
            mean += q * likelihood;
            squares += squared * likelihood;
        }
        if total < 1e-12 {
            return None;
        }
        self.weight += total / (total + OUTLIER);
        self.squares += squares / (total + OUTLIER);
        Some((mean / total, total / (total + OUTLIER)))
    }
}
