//! Random sample consensus over matches.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use srrf_cloud::Rigid;

use crate::consensus::{Correspondences, SupportedPose, keep_diverse, squared};

/// Hypotheses that one generator draws.
const BATCH: usize = 512;
/// Batches between two looks at the stopping rule. Fixed, so that threads do not matter.
const BATCHES_A_ROUND: usize = 16;

/// Random sample consensus over matches (Fischler and Bolles 1981).
///
/// A sample is three matches. It is dropped if an edge differs in length between the clouds by more than `edge_similarity` allows, or
/// if its own fit leaves one of the three beyond `distance` (both as in Open3D). The search ends when a better consensus would have
/// been found with probability `confidence`, and the best poses are fitted to their inliers (locally optimised RANSAC, Chum et al.
/// 2003). The same matches give the same poses, with any number of threads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RansacConsensus {
    /// Most samples. Default 100,000, as in Open3D.
    pub max_iterations: usize,
    /// Default 0.999, as in Open3D.
    pub confidence: f64,
    /// Least ratio of an edge's lengths in the two clouds. Default 0.9, as in Open3D's tutorial.
    pub edge_similarity: f64,
    /// Matches closer than this are inliers, in the unit of the points. Default 1: set it.
    pub distance: f64,
    /// Poses to find: each differs from the others by 10 degrees or 10 distances. Default 4.
    pub keep: usize,
    /// Seed of the samples. Default 0.
    pub seed: u64,
}

impl Default for RansacConsensus {
    fn default() -> Self {
        Self {
            max_iterations: 100_000,
            confidence: 0.999,
            edge_similarity: 0.9,
            distance: 1.0,
            keep: 4,
            seed: 0,
        }
    }
}

/// Source and target point of each match.
type MatchedPoints = [([f64; 3], [f64; 3])];

impl RansacConsensus {
    /// The best poses, best first, and the number of samples drawn.
    pub fn poses(&self, matches: &Correspondences) -> (Vec<SupportedPose>, usize) {
        let pairs: Vec<_> = matches.source().iter().copied().zip(matches.target().iter().copied()).collect();
        let mut best: Vec<SupportedPose> = Vec::new();
        let mut drawn = 0;
        if pairs.len() < 3 {
            return (best, drawn);
        }
        let mut needed = self.max_iterations;
        let mut round = 0;
        while drawn < needed.min(self.max_iterations) {
            let found: Vec<Vec<SupportedPose>> = (0..BATCHES_A_ROUND)
                .into_par_iter()
                .map(|batch| run_batch(&pairs, self, (round * BATCHES_A_ROUND + batch) as u64))
                .collect();
            for pose in found.into_iter().flatten() {
                keep_diverse(&mut best, pose, self.keep.max(1), self.distance);
            }
            round += 1;
            drawn += BATCH * BATCHES_A_ROUND;
            if let Some(top) = best.first() {
                let share = top.inliers as f64 / pairs.len() as f64;
                // All three of a sample must be inliers.
                let miss = (1.0 - share.powi(3)).max(1e-12);
                if miss < 1.0 {
                    needed = ((1.0 - self.confidence).ln() / miss.ln()).ceil().max(1.0) as usize;
                }
            }
        }
        for pose in &mut best {
            *pose = polish(&pairs, *pose, self.distance);
        }
        best.sort_by(SupportedPose::by_support);
        (best, drawn)
    }
}

fn run_batch(pairs: &MatchedPoints, search: &RansacConsensus, batch: u64) -> Vec<SupportedPose> {
    let mut rng = ChaCha8Rng::seed_from_u64(search.seed);
    rng.set_stream(batch);
    let mut best = Vec::new();
    for _ in 0..BATCH {
        let sample: [usize; 3] = std::array::from_fn(|_| rng.random_range(0..pairs.len()));
        if let Some(pose) = fit_sample(pairs, sample, search) {
            let pose = score(pairs, &pose, search.distance);
            keep_diverse(&mut best, pose, search.keep.max(1), search.distance);
        }
    }
    best
}

fn fit_sample(pairs: &MatchedPoints, sample: [usize; 3], search: &RansacConsensus) -> Option<Rigid> {
    let [a, b, c] = sample;
    for (i, j) in [(a, b), (b, c), (c, a)] {
        let (in_source, in_target) = (squared(&pairs[i].0, &pairs[j].0), squared(&pairs[i].1, &pairs[j].1));
        let least = search.edge_similarity * search.edge_similarity;
        // Samples with a repeated match have an edge of length 0.
        if i == j || in_source < least * in_target || in_target < least * in_source || in_source == 0.0 {
            return None;
        }
    }
    let pose = Rigid::fit(&sample.map(|i| pairs[i].0), &sample.map(|i| pairs[i].1), None)?;
    let limit = search.distance * search.distance;
    sample.iter().all(|&i| squared(&pose.apply(&pairs[i].0), &pairs[i].1) <= limit).then_some(pose)
}

fn score(pairs: &MatchedPoints, pose: &Rigid, distance: f64) -> SupportedPose {
    let limit = distance * distance;
    let (mut inliers, mut squares) = (0, 0.0);
    for (x, y) in pairs {
        let r = squared(&pose.apply(x), y);
        if r <= limit {
            inliers += 1;
            squares += r;
        }
    }
    SupportedPose { target_from_source: *pose, inliers, squares }
}

/// Fits to the inliers, twice, while that gains some (locally optimised RANSAC, Chum et al. 2003).
fn polish(pairs: &MatchedPoints, mut best: SupportedPose, distance: f64) -> SupportedPose {
    for _ in 0..2 {
        let limit = distance * distance;
        let (x, y): (Vec<_>, Vec<_>) = pairs
            .iter()
            .filter(|(x, y)| squared(&best.target_from_source.apply(x), y) <= limit)
            .copied()
            .unzip();
        let Some(pose) = Rigid::fit(&x, &y, None) else { return best };
        let next = score(pairs, &pose, distance);
        if !next.beats(&best) {
            return best;
        }
        best = next;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic;

    #[test]
    fn finds_one_in_five_and_stops_early() {
        let (matches, truth) = synthetic(300, 0.2, 0.0, 1).unwrap();
        let search = RansacConsensus { distance: 0.05, seed: 3, ..RansacConsensus::default() };
        let (found, drawn) = search.poses(&matches);
        assert!(found[0].inliers >= 60 && found[0].target_from_source.angle_to_deg(&truth) < 1.0);
        assert!(drawn < 100_000, "{drawn}");
        assert!(found.windows(2).all(|w| w[0].inliers >= w[1].inliers));
        assert_eq!(found, search.poses(&matches).0);
    }

    #[test]
    fn too_few_matches_give_nothing() {
        let search = RansacConsensus { distance: 0.05, ..RansacConsensus::default() };
        let matches = |n| Correspondences::new(vec![[1.0; 3]; n], vec![[2.0; 3]; n]).unwrap();
        assert!(search.poses(&matches(2)).0.is_empty());
        assert!(search.poses(&matches(5)).0.is_empty());
    }
}
