//! Joint refinement on points: all scans of a component at once, point to plane, each against all that it overlaps.

use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;
use srrf_cloud::Rigid;

use crate::graph::{GraphEdge, equations};
use crate::se3::{displacement, exp, tidied};
use crate::sparse::BlockSystem;
use crate::surface::{ALIKE_MATCHES, ScanSurface, SurfaceMatch, row};

const MOST_STEPS: usize = 12;
/// Points of each scan that are matched with each neighbour.
const ASKED: usize = 1200;
/// Weight of the pose graph beside the points: what the points leave open stays where the edges put it.
const GRAPH_WEIGHT: f64 = 0.05;
/// Steps are over when no scan moves by more than this share of the spacing.
const STILL: f64 = 2e-3;

/// A joint refinement.
#[derive(Debug, Clone)]
pub struct Joint {
    /// `map_from_scan` of the centred scans.
    pub poses: Vec<Rigid>,
    /// Root mean square distance of each scan's matches along the normals; NaN without any.
    pub residuals: Vec<f64>,
    /// Covariance of a motion of each scan in its own centred frame, rotation first; zero for held scans.
    pub covariances: Option<Vec<Matrix6<f64>>>,
}

/// What one pair of overlapping scans adds.
struct PairSums {
    source_source: Matrix6<f64>,
    source_target: Matrix6<f64>,
    target_target: Matrix6<f64>,
    source: Vector6<f64>,
    target: Vector6<f64>,
    squares: f64,
    count: usize,
}

impl PairSums {
    fn of(surfaces: &[ScanSurface], poses: &[Rigid], (source, target): (usize, usize), gate: f64) -> Self {
        let target_from_source = poses[target].inverse().compose(&poses[source]);
        let near = gate * surfaces[target].near(&surfaces[source]);
        let (onto, _) = surfaces[target].matches(&surfaces[source], &target_from_source, near, ASKED);
        let (back, _) =
            surfaces[source].matches(&surfaces[target], &target_from_source.inverse(), near, ASKED);
        let mut sums = Self::zero();
        let scale = robust_scale(&onto, &back, surfaces[source].spacing.max(surfaces[target].spacing));
        for m in &onto {
            let own = row(&m.point, &(target_from_source.rotation.transpose() * m.normal));
            sums.add(m, &own, &-row(&m.moved, &m.normal), scale);
        }
        for m in &back {
            let own = row(&m.point, &(target_from_source.rotation * m.normal));
            sums.add(m, &-row(&m.moved, &m.normal), &own, scale);
        }
        sums
    }

    fn zero() -> Self {
        Self {
            source_source: Matrix6::zeros(),
            source_target: Matrix6::zeros(),
            target_target: Matrix6::zeros(),
            source: Vector6::zeros(),
            target: Vector6::zeros(),
            squares: 0.0,
            count: 0,
        }
    }

    /// A match whose distance changes with the twists of the source and of the target by these rows.
    fn add(&mut self, m: &SurfaceMatch, by_source: &Vector6<f64>, by_target: &Vector6<f64>, scale: f64) {
        // Geman and McClure.
        let weight = (1.0 + (m.off / scale).powi(2)).powi(-2) / (ALIKE_MATCHES * scale * scale);
        self.source_source += weight * by_source * by_source.transpose();
        self.source_target += weight * by_source * by_target.transpose();
        self.target_target += weight * by_target * by_target.transpose();
        self.source -= weight * m.off * by_source;
        self.target -= weight * m.off * by_target;
        if m.off.abs() <= 3.0 * scale {
            self.squares += m.off * m.off;
            self.count += 1;
        }
    }
}

/// Three median distances, yet not under a fifth of the spacing.
fn robust_scale(onto: &[SurfaceMatch], back: &[SurfaceMatch], spacing: f64) -> f64 {
    let mut off: Vec<f64> = onto.iter().chain(back).map(|m| m.off.abs()).collect();
    if off.is_empty() {
        return spacing.max(f64::MIN_POSITIVE.sqrt());
    }
    let middle = off.len() / 2;
    let median = *off.select_nth_unstable_by(middle, f64::total_cmp).1;
    (3.0 * median).max(0.2 * spacing).max(f64::MIN_POSITIVE.sqrt())
}

/// Moves the poses (of the centred scans) to where all `pairs` of overlapping scans lie on each other best. `held` scans stay.
pub fn refine_jointly(
    surfaces: &[ScanSurface],
    poses: &[Rigid],
    pairs: &[(usize, usize)],
    edges: &[GraphEdge],
    held: &[usize],
) -> Joint {
    let mut poses = poses.to_vec();
    let graph_weights = vec![GRAPH_WEIGHT; edges.len()];
    let mut last = None;
    for step in 0..=MOST_STEPS {
        // The gate closes as the scans come together.
        let gate = if step < 3 { 1.0 } else { 0.6 };
        let sums: Vec<PairSums> =
            pairs.par_iter().map(|&pair| PairSums::of(surfaces, &poses, pair, gate)).collect();
        let Some(graph) = equations(&poses, edges, &graph_weights, &[]) else { break };
        let mut system = graph;
        for (&(source, target), s) in pairs.iter().zip(&sums) {
            system.add(source, source, &s.source_source);
            system.add(source, target, &s.source_target);
            system.add(target, target, &s.target_target);
            system.right[source] += s.source;
            system.right[target] += s.target;
        }
        held.iter().for_each(|scan| system.hold(*scan));
        let moves = if step < MOST_STEPS {
            system.factor(1e-9).and_then(|factors| factors.solve(&system.right))
        } else {
            None
        };
        last = Some((system, sums));
        let Some(moves) = moves else { break };
        let moved: Vec<Rigid> = poses.iter().zip(&moves).map(|(p, d)| tidied(&p.compose(&exp(d)))).collect();
        let still = (0..poses.len())
            .all(|i| displacement(&exp(&moves[i]), surfaces[i].radius) <= STILL * surfaces[i].spacing);
        poses = moved;
        if still && step >= 3 {
            break;
        }
    }
    let residuals = last
        .as_ref()
        .map_or_else(|| vec![f64::NAN; poses.len()], |(_, sums)| residuals(poses.len(), pairs, sums));
    let covariances = last.and_then(|(system, _)| covariances(&system, held));
    Joint { poses, residuals, covariances }
}

fn residuals(scans: usize, pairs: &[(usize, usize)], sums: &[PairSums]) -> Vec<f64> {
    let mut of = vec![(0.0, 0); scans];
    for (&(source, target), s) in pairs.iter().zip(sums) {
        for scan in [source, target] {
            of[scan].0 += s.squares;
            of[scan].1 += s.count;
        }
    }
    of.into_iter()
        .map(|(squares, count)| if count > 0 { f64::sqrt(squares / count as f64) } else { f64::NAN })
        .collect()
}

fn covariances(system: &BlockSystem, held: &[usize]) -> Option<Vec<Matrix6<f64>>> {
    let mut blocks = system.factor(1e-12)?.inverse_diagonal()?;
    held.iter().for_each(|scan| blocks[*scan] = Matrix6::zeros());
    Some(blocks)
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix6;
    use rand::SeedableRng;
    use rand::rngs::ChaCha8Rng;
    use srrf_cloud::PointCloud;
    use srrf_corrupt::datasets::ShapeSource;
    use srrf_corrupt::shapes::ProceduralShapes;

    use super::*;

    #[test]
    fn scans_that_are_off_come_together() {
        let shapes = ProceduralShapes::new(3, 2, None).unwrap();
        // Three samplings of one shape.
        let clouds: Vec<PointCloud> = (0..3)
            .map(|seed| shapes.sample(0, 4000, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap())
            .collect();
        let surfaces: Vec<ScanSurface> =
            clouds.iter().map(|c| ScanSurface::new(c, 2000, None).unwrap()).collect();
        // The means of the samplings differ a little: truth is in input coordinates.
        let truth: Vec<Rigid> = surfaces.iter().map(|s| crate::se3::shift(&s.centre)).collect();
        let off = |s: f64| exp(&Vector6::new(0.02, -0.03 * s, 0.01, 0.01, 0.02 * s, -0.01));
        let start = vec![truth[0], truth[1].compose(&off(1.0)), truth[2].compose(&off(-1.0))];
        let edges: Vec<GraphEdge> = [(1, 0), (2, 1)]
            .map(|(source, target)| GraphEdge {
                source,
                target,
                target_from_source: start[target].inverse().compose(&start[source]),
                information: Matrix6::identity(),
            })
            .to_vec();
        let found = refine_jointly(&surfaces, &start, &[(1, 0), (2, 1), (2, 0)], &edges, &[0]);
        for i in 0..3 {
            let error = displacement(&truth[i].inverse().compose(&found.poses[i]), surfaces[i].radius);
            assert!(error < 0.2 * surfaces[i].spacing, "{i}: {error} of {}", surfaces[i].spacing);
        }
        assert_eq!(found.poses[0], start[0]);
        let covariances = found.covariances.unwrap();
        assert_eq!(covariances[0], Matrix6::zeros());
        assert!(covariances[1].trace() > 0.0 && found.residuals[1] < surfaces[1].spacing);
    }
}
