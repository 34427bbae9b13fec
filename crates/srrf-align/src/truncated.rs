//! The optimum of a pose graph that leaves out what contradicts it.

use srrf_cloud::Rigid;

use crate::graph::{GraphEdge, optimise};
use crate::loops::CLOSES;
use crate::trees::components;

/// How fast the loss is made less convex, as in the paper.
const HARDER: f64 = 1.4;
const MOST_HARDENINGS: usize = 60;
/// Edges with less weight are left out.
const HALF: f64 = 0.5;

/// The optimum with a truncated quadratic loss by graduated non-convexity, and which edges are within the truncation. Source: Yang,
/// Antonante, Tzoumas and Carlone, "Graduated non-convexity for robust spatial perception", 2020.
pub fn truncated(nodes: usize, poses: &mut Vec<Rigid>, edges: &[GraphEdge], start: Vec<f64>) -> Vec<bool> {
    let used: Vec<usize> = (0..edges.len()).filter(|e| start[*e] > 0.0).collect();
    let mut weights = start;
    let worst = |poses: &[Rigid]| used.iter().map(|e| edges[*e].cost(poses)).fold(0.0, f64::max);
    let first = worst(poses);
    let mut control = CLOSES / (2.0 * first - CLOSES);
    if first > CLOSES && control > 0.0 {
        for _ in 0..MOST_HARDENINGS {
            let mut undecided = false;
            for &e in &used {
                let cost = edges[e].cost(poses);
                weights[e] = if cost >= (control + 1.0) / control * CLOSES {
                    0.0
                } else if cost <= control / (control + 1.0) * CLOSES {
                    1.0
                } else {
                    undecided = true;
                    (CLOSES * control * (control + 1.0) / cost).sqrt() - control
                };
            }
            move_to_optimum(nodes, poses, edges, &weights);
            if !undecided {
                break;
            }
            control *= HARDER;
        }
    } else {
        move_to_optimum(nodes, poses, edges, &weights);
    }
    (0..edges.len()).map(|e| weights[e] > HALF && edges[e].cost(poses) <= CLOSES).collect()
}

pub fn move_to_optimum(nodes: usize, poses: &mut Vec<Rigid>, edges: &[GraphEdge], weights: &[f64]) {
    let used: Vec<bool> = weights.iter().map(|w| *w > 1e-6).collect();
    let held: Vec<usize> = components(nodes, edges, &used).iter().map(|g| g[0]).collect();
    // Where there is no solution the poses stay where the tree put them.
    let _ = optimise(poses, edges, weights, &held);
}
