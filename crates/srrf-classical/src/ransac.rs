//! Random sample consensus over matches.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use srrf_cloud::Rigid;

use crate::correspond::Correspondences;

/// Hypotheses that one generator draws.
const BATCH: usize = 512;
/// Batches between two looks at the stopping rule. Fixed, so that threads do not matter.
const BATCHES_A_ROUND: usize = 16;

/// How to search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ConsensusSearch {
    pub max_iterations: usize,
    pub confidence: f64,
    pub edge_similarity: f64,
    /// Matches closer than this are inliers.
    pub distance: f64,
    /// Hypotheses to keep.
    pub keep: usize,
    pub seed: u64,
}

/// A pose and the matches that agree with it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hypothesis {
    pub pose: Rigid,
    pub inliers: usize,
    /// Sum of the inliers' squared distances, to tell equals apart.
    squares: f64,
}

impl Hypothesis {
    fn beats(&self, other: &Self) -> bool {
        (self.inliers, -self.squares) > (other.inliers, -other.squares)
    }
}

/// The best hypotheses, best first, and the number of samples drawn.
///
/// A sample is three matches. It is dropped if an edge differs in length between the clouds by more than
/// `edge_similarity` allows, or if its own fit leaves one of the three beyond `distance` (both as in
/// Open3D). The search ends when a better consensus would have been found with probability `confidence`.
pub(crate) fn ransac(matches: &Correspondences, search: &ConsensusSearch) -> (Vec<Hypothesis>, usize) {
    let pairs: Vec<([f64; 3], [f64; 3])> = matches
        .pairs
        .iter()
        .map(|&(i, j)| (matches.source[i as usize], matches.target[j as usize]))
        .collect();
    let mut best: Vec<Hypothesis> = Vec::new();
    let mut drawn = 0;
    if pairs.len() < 3 {
        return (best, drawn);
    }
    let mut needed = search.max_iterations;
    let mut round = 0;
    while drawn < needed.min(search.max_iterations) {
        let found: Vec<Vec<Hypothesis>> = (0..BATCHES_A_ROUND)
            .into_par_iter()
            .map(|batch| run_batch(&pairs, search, (round * BATCHES_A_ROUND + batch) as u64))
            .collect();
        for hypothesis in found.into_iter().flatten() {
            insert(&mut best, hypothesis, search);
        }
        round += 1;
        drawn += BATCH * BATCHES_A_ROUND;
        if let Some(top) = best.first() {
            let share = top.inliers as f64 / pairs.len() as f64;
            // All three of a sample must be inliers.
            let miss = (1.0 - share.powi(3)).max(1e-12);
            if miss < 1.0 {
                needed = ((1.0 - search.confidence).ln() / miss.ln()).ceil().max(1.0) as usize;
            }
        }
    }
    for hypothesis in &mut best {
        *hypothesis = polish(&pairs, *hypothesis, search.distance);
    }
    best.sort_by(|a, b| b.inliers.cmp(&a.inliers).then(a.squares.total_cmp(&b.squares)));
    (best, drawn)
}

fn run_batch(pairs: &[([f64; 3], [f64; 3])], search: &ConsensusSearch, batch: u64) -> Vec<Hypothesis> {
    let mut rng = ChaCha8Rng::seed_from_u64(search.seed);
    rng.set_stream(batch);
    let mut best = Vec::new();
    for _ in 0..BATCH {
        let sample: [usize; 3] = std::array::from_fn(|_| rng.random_range(0..pairs.len()));
        if let Some(pose) = fit_sample(pairs, sample, search) {
            insert(&mut best, score(pairs, &pose, search.distance), search);
        }
    }
    best
}

fn fit_sample(pairs: &[([f64; 3], [f64; 3])], sample: [usize; 3], search: &ConsensusSearch) -> Option<Rigid> {
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

fn score(pairs: &[([f64; 3], [f64; 3])], pose: &Rigid, distance: f64) -> Hypothesis {
    let limit = distance * distance;
    let (mut inliers, mut squares) = (0, 0.0);
    for (x, y) in pairs {
        let r = squared(&pose.apply(x), y);
        if r <= limit {
            inliers += 1;
            squares += r;
        }
    }
    Hypothesis { pose: *pose, inliers, squares }
}

/// Fits to the inliers, twice, while that gains some (locally optimised RANSAC, Chum et al. 2003).
fn polish(pairs: &[([f64; 3], [f64; 3])], mut best: Hypothesis, distance: f64) -> Hypothesis {
    for _ in 0..2 {
        let limit = distance * distance;
        let (x, y): (Vec<_>, Vec<_>) =
            pairs.iter().filter(|(x, y)| squared(&best.pose.apply(x), y) <= limit).copied().unzip();
        let Some(pose) = Rigid::fit(&x, &y, None) else { return best };
        let next = score(pairs, &pose, distance);
        if !next.beats(&best) {
            return best;
        }
        best = next;
    }
    best
}

/// Keeps the best hypotheses that differ by 10 degrees or 10 thresholds.
fn insert(best: &mut Vec<Hypothesis>, new: Hypothesis, search: &ConsensusSearch) {
    let alike = |a: &Hypothesis| {
        a.pose.angle_to_deg(&new.pose) < 10.0
            && (a.pose.translation - new.pose.translation).norm() < 10.0 * search.distance
    };
    if best.len() == search.keep && best.last().is_some_and(|last| !new.beats(last)) {
        return;
    }
    if let Some(place) = best.iter().position(alike) {
        if !new.beats(&best[place]) {
            return;
        }
        best.remove(place);
    }
    let place = best.iter().position(|b| new.beats(b)).unwrap_or(best.len());
    best.insert(place, new);
    best.truncate(search.keep);
}

fn squared(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]) * (a[c] - b[c])).sum()
}

#[cfg(test)]
mod tests {
    use srrf_cloud::EulerXyz;

    use super::*;

    /// `good` right matches and `bad` wrong ones.
    fn matches(good: usize, bad: usize, truth: &Rigid) -> Correspondences {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut point = || -> [f64; 3] { std::array::from_fn(|_| rng.random_range(-1.0..1.0)) };
        let source: Vec<[f64; 3]> = (0..good + bad).map(|_| point()).collect();
        let target =
            source.iter().enumerate().map(|(i, p)| if i < good { truth.apply(p) } else { point() }).collect();
        let pairs = (0..(good + bad) as u32).map(|i| (i, i)).collect();
        Correspondences { source, target, voxel: 0.05, pairs }
    }

    fn search(seed: u64) -> ConsensusSearch {
        ConsensusSearch {
            max_iterations: 100_000,
            confidence: 0.999,
            edge_similarity: 0.9,
            distance: 0.05,
            keep: 4,
            seed,
        }
    }

    #[test]
    fn finds_one_in_five_and_stops_early() {
        let truth = Rigid {
            rotation: EulerXyz::from_deg([100.0, -40.0, 20.0]).to_matrix(),
            translation: [1.0, 2.0, -1.0].into(),
        };
        let (found, drawn) = ransac(&matches(60, 240, &truth), &search(3));
        assert!(found[0].inliers >= 60 && found[0].pose.angle_to_deg(&truth) < 1.0);
        assert!(drawn < 100_000, "{drawn}");
        assert!(found.windows(2).all(|w| w[0].inliers >= w[1].inliers));
        let (again, _) = ransac(&matches(60, 240, &truth), &search(3));
        assert_eq!(found[0].pose, again[0].pose);
    }

    #[test]
    fn too_few_matches_give_nothing() {
        assert!(ransac(&matches(2, 0, &Rigid::identity()), &search(0)).0.is_empty());
        let mut same = matches(5, 0, &Rigid::identity());
        same.source = vec![[1.0; 3]; 5];
        assert!(ransac(&same, &search(0)).0.is_empty());
    }
}
