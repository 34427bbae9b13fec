//! [`GraphConsensus`]: poses from matches of which few are right, by the graph of those that can be right together.

use rayon::prelude::*;
use srrf_cloud::Rigid;

use crate::compatibility::CompatibilityGraph;
use crate::consensus::{Correspondences, SupportedPose, keep_diverse};

/// Edges that one match may give.
const EDGES_OF_EACH: usize = 3;
/// Factor of the kernel's scale at each step of the robust fit.
const SHRINK: f64 = 0.7;
/// Steps of the robust fit: from three distances down to one.
const STEPS: usize = 5;

/// Finds poses by a compatibility graph. Matches are nodes, and two are joined where one motion can carry both; edges with many common
/// neighbours ([SC2-PCR]) are grown to sets that agree with each other (the cheapest of the cliques of [MAC] and [TurboReg]), each set gives a
/// pose, and the best poses are fitted anew to all matches by graduated non-convexity ([Yang et al. 2020]).
///
/// Where random samples of three need about `1 / ratio^3` draws, this takes the same time for every ratio of right matches: it
/// works from some ten right matches on, be it one in a hundred. Time and memory grow with the square of the matches, which
/// [`GraphConsensus::most`] bounds.
///
/// The same matches give the same poses, with any number of threads; nothing is drawn by chance.
///
/// ```
/// use srrf_classical::{Correspondences, GraphConsensus};
///
/// let source: Vec<[f64; 3]> = (0..40).map(|i| [(i * i % 17) as f64, (i * 7 % 11) as f64, (i % 5) as f64]).collect();
/// let target = source.iter().map(|p| [-p[1] + 2.0, p[0], p[2] - 1.0]).collect();
/// let matches = Correspondences::new(source, target)?;
/// let poses = GraphConsensus { distance: 0.1, ..GraphConsensus::default() }.poses(&matches);
/// assert_eq!(poses[0].inliers, 40);
/// # Ok::<(), srrf_classical::CorrespondencesError>(())
/// ```
///
/// [SC2-PCR]: https://doi.org/10.1109/CVPR52688.2022.01287
/// [MAC]: https://doi.org/10.1109/CVPR52729.2023.01702
/// [TurboReg]: https://arxiv.org/abs/2507.01439
/// [Yang et al. 2020]: https://doi.org/10.1109/LRA.2020.2965893
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraphConsensus {
    /// How far the target point of a right match may be from where the pose puts its source point, in the unit of the points.
    /// Default 1: set it.
    pub distance: f64,
    /// Of more matches than this, the first so many are looked at: put the most likely first. Default 2,500: 0.8 MB.
    pub most: usize,
    /// Edges that are grown to sets. Default 400.
    pub edges: usize,
    /// Poses to find: each differs from the others by 10 degrees or 10 distances. Default 4.
    pub keep: usize,
}

impl Default for GraphConsensus {
    fn default() -> Self {
        Self { distance: 1.0, most: 2500, edges: 400, keep: 4 }
    }
}

impl GraphConsensus {
    /// The poses on which most matches agree, best first; none where no three agree.
    pub fn poses(&self, matches: &Correspondences) -> Vec<SupportedPose> {
        let n = matches.len().min(self.most);
        let (source, target) = (&matches.source()[..n], &matches.target()[..n]);
        let graph = CompatibilityGraph::new(source, target, self.distance);
        let edges = graph.best_edges(EDGES_OF_EACH, self.edges);
        let found: Vec<Option<SupportedPose>> = edges
            .par_iter()
            .map(|edge| {
                let set = graph.around(edge);
                let part =
                    |points: &[[f64; 3]]| -> Vec<[f64; 3]> { set.iter().map(|&i| points[i]).collect() };
                let (x, y) = (part(source), part(target));
                let first = Rigid::fit(&x, &y, None)?;
                let pose = fit_robustly(&x, &y, first, self.distance);
                Some(SupportedPose::of(source, target, pose, self.distance)).filter(|p| p.inliers >= 3)
            })
            .collect();
        let mut best = Vec::new();
        for pose in found.into_iter().flatten() {
            keep_diverse(&mut best, pose, self.keep.max(1), self.distance);
        }
        for supported in &mut best {
            let pose = fit_robustly(source, target, supported.target_from_source, self.distance);
            let again = SupportedPose::of(source, target, pose, self.distance);
            if again.beats(supported) {
                *supported = again;
            }
        }
        best.sort_by(SupportedPose::by_support);
        best
    }
}

/// Fits with the weights of Geman and McClure, whose scale shrinks to `distance`.
fn fit_robustly(source: &[[f64; 3]], target: &[[f64; 3]], mut pose: Rigid, distance: f64) -> Rigid {
    let mut scale = 3.0 * distance;
    for _ in 0..STEPS {
        let squared = scale * scale;
        let weight = |(x, y): (&[f64; 3], &[f64; 3])| {
            let moved = pose.apply(x);
            let r: f64 = (0..3).map(|c| (moved[c] - y[c]).powi(2)).sum();
            (squared / (squared + r)).powi(2)
        };
        let weights: Vec<f64> = source.iter().zip(target).map(weight).collect();
        match Rigid::fit(source, target, Some(&weights)) {
            Some(next) => pose = next,
            None => return pose,
        }
        scale = (SHRINK * scale).max(distance);
    }
    pose
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic;

    #[test]
    fn finds_few_right_matches_among_many() {
        for (ratio, count) in [(0.5, 200), (0.2, 400), (0.1, 600), (0.05, 1000), (0.02, 2000), (0.01, 2500)] {
            for seed in 0..3 {
                let (matches, truth) = synthetic(count, ratio, 0.01, seed).unwrap();
                let search = GraphConsensus { distance: 0.03, ..GraphConsensus::default() };
                let found = search.poses(&matches);
                let best = &found[0].target_from_source;
                let far = (best.translation - truth.translation).norm();
                assert!(
                    best.angle_to_deg(&truth) < 2.0 && far < 0.05,
                    "{ratio} {seed}: {}",
                    best.angle_to_deg(&truth)
                );
                assert!(found[0].inliers as f64 > 0.8 * ratio * count as f64);
            }
        }
    }

    #[test]
    fn threads_do_not_matter_and_poses_differ() {
        let (matches, _) = synthetic(700, 0.05, 0.01, 5).unwrap();
        let search = GraphConsensus { distance: 0.03, keep: 6, ..GraphConsensus::default() };
        let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        let [one, three] = [1, 3].map(|n| pool(n).install(|| search.poses(&matches)));
        assert_eq!(one, three);
        assert!(one.len() > 1 && one.len() <= 6 && one.windows(2).all(|w| w[0].inliers >= w[1].inliers));
        for (i, a) in one.iter().enumerate() {
            for b in &one[..i] {
                let [a, b] = [a, b].map(|p| p.target_from_source);
                assert!(a.angle_to_deg(&b) > 5.0 || (a.translation - b.translation).norm() > 0.15);
            }
        }
    }

    #[test]
    fn two_instances_are_both_found() {
        let (one, first) = synthetic(300, 0.3, 0.005, 8).unwrap();
        let (other, second) = synthetic(300, 0.3, 0.005, 9).unwrap();
        let both = |a: &[[f64; 3]], b: &[[f64; 3]]| [a, b].concat();
        let matches =
            Correspondences::new(both(one.source(), other.source()), both(one.target(), other.target()))
                .unwrap();
        let found = GraphConsensus { distance: 0.03, ..GraphConsensus::default() }.poses(&matches);
        for truth in [first, second] {
            assert!(found[..2].iter().any(|p| p.target_from_source.angle_to_deg(&truth) < 1.0));
        }
    }

    #[test]
    fn what_no_motion_explains_gives_nothing() {
        let search = GraphConsensus::default();
        assert!(search.poses(&Correspondences::new(vec![], vec![]).unwrap()).is_empty());
        let same = Correspondences::new(vec![[1.0; 3]; 9], vec![[2.0; 3]; 9]).unwrap();
        assert!(search.poses(&same).is_empty());
        let apart: Vec<[f64; 3]> = (0..5).map(|i| [10f64.powi(i), 0.0, 0.0]).collect();
        let swapped: Vec<[f64; 3]> = apart.iter().rev().map(|p| [3.0 * p[0], 1.0, p[0]]).collect();
        assert!(search.poses(&Correspondences::new(apart, swapped).unwrap()).is_empty());
    }

    #[test]
    fn only_the_first_matches_count_where_there_are_too_many() {
        let (matches, truth) = synthetic(500, 0.4, 0.01, 4).unwrap();
        let search = GraphConsensus { distance: 0.03, most: 250, ..GraphConsensus::default() };
        let found = search.poses(&matches);
        assert!(found[0].inliers <= 250 && found[0].target_from_source.angle_to_deg(&truth) < 2.0);
    }
}
