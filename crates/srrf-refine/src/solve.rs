//! One Gauss-Newton step on SE(3): normal equations of weighted matches, and their solution.

use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3, Vector6};
use srrf_cloud::Rigid;

/// A moved source point, the target point it is matched with, and a normal for the two.
#[derive(Debug, Clone, Copy)]
pub struct Match {
    /// The moved source point, target frame.
    pub moved: Vector3<f64>,
    /// The matched target point.
    pub fixed: Vector3<f64>,
    /// Unit normal in the target frame; zero where there is none.
    pub normal: Vector3<f64>,
}

/// The sums `H = sum w J^T M J` and `g = sum w J^T M r` over matches.
///
/// The unknown is `(omega, v)`: the motion `p -> exp(omega) p + v` after the current pose, in the
/// target frame. `r = moved - fixed` and `J = [-[moved]x | I]`. The metric of a match is
/// `M = a I + b n n^T`: `(a, b) = (1, 0)` is point to point, `(0, 1)` point to plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalEquations {
    /// `H`, symmetric, rotation first.
    pub hessian: Matrix6<f64>,
    /// `g`.
    pub gradient: Vector6<f64>,
}

impl Default for NormalEquations {
    fn default() -> Self {
        Self { hessian: Matrix6::zeros(), gradient: Vector6::zeros() }
    }
}

impl NormalEquations {
    /// Adds one match with the metric `a I + b n n^T`.
    pub fn add(&mut self, m: &Match, a: f64, b: f64) {
        let (p, r) = (&m.moved, m.moved - m.fixed);
        if a > 0.0 {
            let cross = p.cross_matrix();
            let mut rotation = self.hessian.fixed_view_mut::<3, 3>(0, 0);
            rotation += a * (Matrix3::identity() * p.norm_squared() - p * p.transpose());
            let mut upper = self.hessian.fixed_view_mut::<3, 3>(0, 3);
            upper += a * cross;
            let mut lower = self.hessian.fixed_view_mut::<3, 3>(3, 0);
            lower -= a * cross;
            for i in 3..6 {
                self.hessian[(i, i)] += a;
            }
            let moment = p.cross(&r);
            for i in 0..3 {
                self.gradient[i] += a * moment[i];
                self.gradient[i + 3] += a * r[i];
            }
        }
        if b > 0.0 {
            let moment = p.cross(&m.normal);
            let j = Vector6::new(moment.x, moment.y, moment.z, m.normal.x, m.normal.y, m.normal.z);
            self.hessian += (b * j) * j.transpose();
            self.gradient += j * (b * m.normal.dot(&r));
        }
    }

    /// Adds the sums of another part.
    pub fn merge(&mut self, other: &Self) {
        self.hessian += other.hessian;
        self.gradient += other.gradient;
    }

    /// The motion that minimises the quadratic model, applied after `pose`; `None` where the
    /// equations have no finite solution.
    ///
    /// Directions that the matches leave open (a plane slides in itself) are damped by `1e-6` of
    /// the mean diagonal, in units in which `radius` is 1, so that they stay where they are.
    pub fn step(&self, pose: &Rigid, radius: f64) -> Option<Rigid> {
        let scale = Vector6::from_fn(|i, _| if i < 3 { 1.0 / radius } else { 1.0 });
        let scaled = Matrix6::from_fn(|i, j| self.hessian[(i, j)] * scale[i] * scale[j]);
        let damping = 1e-6 * scaled.trace() / 6.0;
        if damping.is_nan() || damping <= 0.0 {
            return None;
        }
        let rhs = -self.gradient.component_mul(&scale);
        let x = (scaled + Matrix6::identity() * damping).cholesky()?.solve(&rhs).component_mul(&scale);
        if !x.iter().all(|v| v.is_finite()) {
            return None;
        }
        let turn = Rotation3::new(Vector3::new(x[0], x[1], x[2])).into_inner();
        let shift = Vector3::new(x[3], x[4], x[5]);
        // The product of two rotations drifts from SO(3) by rounding only, yet over many steps.
        let rotation = Rigid::nearest_rotation(&(turn * pose.rotation))?;
        Some(Rigid { rotation, translation: turn * pose.translation + shift })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matches() -> Vec<Match> {
        let point = |s: f64| Vector3::new(s.sin(), (1.7 * s).cos(), (0.3 * s * s).sin());
        (0..13)
            .map(|i| {
                let s = f64::from(i);
                let fixed = point(s) + 0.1 * point(s + 20.0);
                Match { moved: point(s), fixed, normal: point(s + 7.0).normalize() }
            })
            .collect()
    }

    /// `sum r^T M r / 2` after a motion.
    fn cost(matches: &[Match], x: &Vector6<f64>, a: f64, b: f64) -> f64 {
        let turn = Rotation3::new(Vector3::new(x[0], x[1], x[2]));
        matches
            .iter()
            .map(|m| {
                let r = turn * m.moved + Vector3::new(x[3], x[4], x[5]) - m.fixed;
                0.5 * (a * r.norm_squared() + b * m.normal.dot(&r).powi(2))
            })
            .sum()
    }

    #[test]
    fn gradient_agrees_with_finite_differences() {
        let mut sums = NormalEquations::default();
        matches().iter().for_each(|m| sums.add(m, 0.3, 0.7));
        for i in 0..6 {
            let h = 1e-5 * Vector6::ith(i, 1.0);
            let slope = (cost(&matches(), &h, 0.3, 0.7) - cost(&matches(), &-h, 0.3, 0.7)) / 2e-5;
            assert!((slope - sums.gradient[i]).abs() < 1e-7, "{i}: {slope} {}", sums.gradient[i]);
        }
        assert!((sums.hessian - sums.hessian.transpose()).norm() < 1e-12);
    }

    #[test]
    fn steps_go_down_and_open_directions_stay() {
        let turn = Rotation3::new(Vector3::new(0.1, 0.05, -0.08));
        let shifted = |m: &Match| turn * m.moved + Vector3::new(0.1, -0.2, 0.05);
        let before: Vec<Match> = matches().iter().map(|m| Match { fixed: shifted(m), ..*m }).collect();
        for (a, b) in [(1.0, 0.0), (0.1, 1.0), (0.0, 1.0)] {
            let mut sums = NormalEquations::default();
            before.iter().for_each(|m| sums.add(m, a, b));
            let next = sums.step(&Rigid::identity(), 1.0).unwrap();
            let moved = |m: &Match| next.rotation * m.moved + next.translation;
            let after: Vec<Match> = before.iter().map(|m| Match { moved: moved(m), ..*m }).collect();
            let zero = Vector6::zeros();
            assert!(cost(&after, &zero, a, b) < 0.01 * cost(&before, &zero, a, b));
        }
        // Points on the plane z = 0 against z = 0.5: only z may change.
        let mut plane = NormalEquations::default();
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let moved = Vector3::new(x, y, 0.0);
            let fixed = Vector3::new(x + 0.2, y, 0.5);
            plane.add(&Match { moved, fixed, normal: Vector3::z() }, 0.0, 1.0);
        }
        let next = plane.step(&Rigid::identity(), 1.0).unwrap();
        assert!((next.translation - Vector3::new(0.0, 0.0, 0.5)).norm() < 1e-4);
        assert!((next.rotation - Matrix3::identity()).norm() < 1e-4);
        assert_eq!(NormalEquations::default().step(&Rigid::identity(), 1.0), None);
    }
}
