//! The pose graph: poses that agree best with measured motions between them, by Levenberg and Marquardt on SE(3).

use nalgebra::{Matrix6, Vector6};
use srrf_cloud::Rigid;

use crate::se3::{adjoint, exp, inverse_left_jacobian, log, tidied};
use crate::sparse::BlockSystem;

/// Most steps.
const MOST_STEPS: usize = 60;
/// A step that lowers the cost by less than this share is the last.
const TOLERANCE: f64 = 1e-9;

/// A measured motion between two nodes of the graph.
#[derive(Debug, Clone, PartialEq)]
pub struct GraphEdge {
    /// Node that moves.
    pub source: usize,
    /// Node that it is laid on.
    pub target: usize,
    /// The measurement.
    pub target_from_source: Rigid,
    /// Inverse covariance of a motion `p -> exp(x) p` after the measurement, in the target's frame; rotation first.
    pub information: Matrix6<f64>,
}

/// What an optimisation came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optimised {
    /// `sum w r^T information r` over the edges.
    pub cost: f64,
    /// Steps that were taken.
    pub steps: usize,
}

impl GraphEdge {
    /// What the poses say against the measurement: the twist of `target_from_source(poses) measured^-1`.
    pub fn residual(&self, poses: &[Rigid]) -> Vector6<f64> {
        log(&self.error(poses))
    }

    /// The same as a motion.
    pub fn error(&self, poses: &[Rigid]) -> Rigid {
        let between = poses[self.target].inverse().compose(&poses[self.source]);
        between.compose(&self.target_from_source.inverse())
    }

    /// `r^T information r`.
    pub fn cost(&self, poses: &[Rigid]) -> f64 {
        let r = self.residual(poses);
        r.dot(&(self.information * r))
    }

    /// The residual and its derivatives by small motions of the source and of the target, each in its own frame:
    /// `pose exp(d)`. `None` at a turn where there are none.
    fn linearised(&self, poses: &[Rigid]) -> Option<(Vector6<f64>, Matrix6<f64>, Matrix6<f64>)> {
        let r = self.residual(poses);
        // exp(-d_target) E exp(Ad(measured) d_source), E the error: from the left and from the right.
        let target = -inverse_left_jacobian(&r)?;
        let source = inverse_left_jacobian(&-r)? * adjoint(&self.target_from_source);
        Some((r, source, target))
    }
}

/// Moves the poses (`map_from_node`) to where the weighted edges agree best. Nodes in `held` stay; each connected part needs one.
/// `None` where the equations have no solution, such as for a part that nothing holds.
pub fn optimise(
    poses: &mut Vec<Rigid>,
    edges: &[GraphEdge],
    weights: &[f64],
    held: &[usize],
) -> Option<Optimised> {
    let cost_of =
        |poses: &[Rigid]| -> f64 { edges.iter().zip(weights).map(|(e, w)| w * e.cost(poses)).sum() };
    let (mut cost, mut damping, mut steps) = (cost_of(poses), 1e-6, 0);
    while steps < MOST_STEPS {
        let system = equations(poses, edges, weights, held)?;
        let mut lowered = None;
        // A higher damping always finds a way down, until steps are of the size of rounding.
        while lowered.is_none() && damping < 1e8 {
            if let Some(moves) = system.factor(damping).and_then(|factors| factors.solve(&system.right)) {
                let next: Vec<Rigid> =
                    poses.iter().zip(&moves).map(|(p, d)| tidied(&p.compose(&exp(d)))).collect();
                let next_cost = cost_of(&next);
                if next_cost <= cost {
                    lowered = Some((next, next_cost));
                    damping = (damping * 0.2).max(1e-12);
                    break;
                }
            } else if damping >= 1e6 {
                return None;
            }
            damping = (damping * 8.0).max(1e-9);
        }
        let Some((next, next_cost)) = lowered else { break };
        let gain = cost - next_cost;
        (*poses, cost, steps) = (next, next_cost, steps + 1);
        if gain <= TOLERANCE * cost {
            break;
        }
    }
    Some(Optimised { cost, steps })
}

/// The normal equations about the poses.
pub fn equations(
    poses: &[Rigid],
    edges: &[GraphEdge],
    weights: &[f64],
    held: &[usize],
) -> Option<BlockSystem> {
    let mut system = BlockSystem::new(poses.len());
    for (edge, &weight) in edges.iter().zip(weights) {
        if weight > 0.0 {
            let (r, by_source, by_target) = edge.linearised(poses)?;
            let (from_source, from_target) = (
                weight * by_source.transpose() * edge.information,
                weight * by_target.transpose() * edge.information,
            );
            system.add(edge.source, edge.source, &(from_source * by_source));
            system.add(edge.target, edge.target, &(from_target * by_target));
            system.add(edge.source, edge.target, &(from_source * by_target));
            system.right[edge.source] -= from_source * r;
            system.right[edge.target] -= from_target * r;
        }
    }
    held.iter().for_each(|&node| system.hold(node));
    Some(system)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(s: f64) -> Rigid {
        exp(&Vector6::new(s.sin(), (1.3 * s).cos(), 0.4 * s.cos(), 3.0 * s, -2.0 * s.cos(), (0.7 * s).sin()))
    }

    fn between(poses: &[Rigid], source: usize, target: usize) -> GraphEdge {
        let target_from_source = poses[target].inverse().compose(&poses[source]);
        let spread = Matrix6::from_fn(|i, j| if i == j { 1.0 + i as f64 } else { 0.1 });
        GraphEdge { source, target, target_from_source, information: spread * spread.transpose() }
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        let poses: Vec<Rigid> = (0..2).map(|i| pose(f64::from(i))).collect();
        let mut edge = between(&poses, 0, 1);
        edge.target_from_source =
            exp(&Vector6::new(0.5, -0.8, 0.4, 1.0, 0.3, -2.0)).compose(&edge.target_from_source);
        let (_, by_source, by_target) = edge.linearised(&poses).unwrap();
        for (node, jacobian) in [(0, by_source), (1, by_target)] {
            for i in 0..6 {
                let at = |h: f64| {
                    let mut moved = poses.clone();
                    moved[node] = moved[node].compose(&exp(&(h * Vector6::ith(i, 1.0))));
                    edge.residual(&moved)
                };
                let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
                assert!((slope - jacobian.column(i)).norm() < 1e-6, "node {node}, {i}");
            }
        }
    }

    #[test]
    fn a_ring_with_exact_edges_comes_back_from_afar() {
        let truth: Vec<Rigid> = (0..9).map(|i| pose(f64::from(i))).collect();
        let mut edges: Vec<GraphEdge> = (0..9).map(|i| between(&truth, i, (i + 1) % 9)).collect();
        edges.push(between(&truth, 2, 7));
        let mut poses: Vec<Rigid> = truth
            .iter()
            .enumerate()
            .map(
                |(i, p)| {
                    if i == 0 { *p } else { p.compose(&exp(&(0.3 * Vector6::repeat((i as f64).sin())))) }
                },
            )
            .collect();
        let done = optimise(&mut poses, &edges, &[1.0; 10], &[0]).unwrap();
        assert!(done.cost < 1e-12 && done.steps > 1, "{done:?}");
        for (found, expected) in poses.iter().zip(&truth) {
            assert!((found.to_matrix4() - expected.to_matrix4()).norm() < 1e-6);
        }
    }

    #[test]
    fn a_loop_that_does_not_close_is_shared_by_information() {
        // Three nodes on a line; the edge 0-2 says 2.3 where the chain says 2.
        let at = |x: f64| crate::se3::shift(&nalgebra::Vector3::new(x, 0.0, 0.0));
        let edge = |source, target, x: f64, w: f64| GraphEdge {
            source,
            target,
            target_from_source: at(x),
            information: w * Matrix6::identity(),
        };
        let edges = [edge(1, 0, 1.0, 1.0), edge(2, 1, 1.0, 1.0), edge(2, 0, 2.3, 2.0)];
        let mut poses = vec![at(0.0), at(1.0), at(2.0)];
        let done = optimise(&mut poses, &edges, &[1.0; 3], &[0]).unwrap();
        // The chain's information is 1/2, the chord's is 2: minus 0.3 falls 4 : 1.
        assert!((poses[2].translation.x - (2.0 + 0.3 * 0.8)).abs() < 1e-9, "{}", poses[2].translation.x);
        assert!((poses[1].translation.x - 1.12).abs() < 1e-9);
        assert!((done.cost - (2.0 * 0.12f64.powi(2) + 2.0 * 0.06f64.powi(2))).abs() < 1e-9, "{done:?}");
    }

    #[test]
    fn a_part_that_nothing_holds_has_no_solution() {
        let truth: Vec<Rigid> = (0..4).map(|i| pose(f64::from(i))).collect();
        let edges = [between(&truth, 0, 1)];
        assert_eq!(optimise(&mut truth.clone(), &edges, &[1.0], &[0]), None);
        assert!(optimise(&mut truth.clone(), &edges, &[1.0], &[0, 2, 3]).is_some());
    }
}
