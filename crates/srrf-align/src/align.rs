//! [`align`]: the way from scans to a [`Map`], one statement a stage.

use rayon::prelude::*;
use srrf_cloud::Rigid;

use crate::consensus::{Consensus, EdgeVerdict};
use crate::graph::GraphEdge;
use crate::joint::{Joint, refine_jointly};
use crate::loops::CLOSES;
use crate::map::{Map, PairChoice};
use crate::near::overlapping;
use crate::options::{AlignError, AlignOptions, AlignProgress, AlignStage};
use crate::pair::{PairStore, RegisterPairs, Scans};
use crate::placed::{Finished, place};
use crate::pool::{PairPool, Workplace};
use crate::rounds::Rounds;
use crate::surface::ScanSurface;

/// Thinned points of all scans together, where they are many.
const POINTS_IN_ALL: usize = 600_000;
const MOST_POINTS: usize = 8_000;
const LEAST_POINTS: usize = 1_500;
/// Scans that share this much are refined on each other.
const JOINT_OVERLAP: f64 = 0.08;
/// Neighbours that one scan is refined on, in the median.
const JOINT_NEIGHBOURS: usize = 6;
/// An edge that agreed before the joint refinement may be off by this much more after it.
const LOOSER: f64 = 2.0;

/// Lays all scans in one frame, or those of each component in one.
///
/// # Errors
/// [`AlignError`] for fewer than two scans, for scans that cannot be read or used, and for first guesses that are not one a scan.
pub fn align<S: Scans + ?Sized, R: RegisterPairs>(
    scans: &S,
    method: &R,
    options: &AlignOptions,
    store: &dyn PairStore,
    progress: &(dyn Fn(AlignProgress) + Sync),
) -> Result<Map, AlignError<S::Error, R::Error>> {
    check(scans.count(), options)?;
    let surfaces = surfaces(scans, progress)?;
    let at_once = options.at_once.unwrap_or_else(rayon::current_num_threads).max(1);
    let workplace = Workplace { scans, method, store, progress, surfaces: &surfaces, at_once };
    let mut rounds = Rounds {
        options,
        place: &workplace,
        pool: PairPool::default(),
        compared: 0,
        sizes: Vec::new(),
        pair_seconds: 0.0,
    };
    let consensus = rounds.run()?;
    let Rounds { pool, compared, sizes, pair_seconds, .. } = rounds;
    let n = surfaces.len();
    let choice = PairChoice {
        possible: n * (n - 1) / 2,
        compared,
        tried: pool.tried.len(),
        rounds: sizes,
        pair_seconds,
    };
    progress(AlignProgress { stage: AlignStage::Joint, done: 0, total: 1 });
    let joint = refined(&surfaces, &consensus, &pool, options);
    progress(AlignProgress { stage: AlignStage::Joint, done: 1, total: 1 });
    Ok(place(&Finished {
        surfaces: &surfaces,
        consensus: &consensus,
        pool: &pool,
        joint: &joint,
        options,
        choice,
    }))
}

fn check<S: std::error::Error, R: std::error::Error>(
    count: usize,
    options: &AlignOptions,
) -> Result<(), AlignError<S, R>> {
    if count < 2 {
        return Err(AlignError::TooFew(count));
    }
    let guesses = options.initial.len();
    if guesses != 0 && guesses != count {
        return Err(AlignError::Guesses { guesses, scans: count });
    }
    let finite = |g: &Rigid| g.rotation.iter().chain(g.translation.iter()).all(|v| v.is_finite());
    match options.initial.iter().position(|g| g.as_ref().is_some_and(|g| !finite(g))) {
        Some(number) => Err(AlignError::Guess(number)),
        None => Ok(()),
    }
}

fn surfaces<S: Scans + ?Sized, R: std::error::Error + Send>(
    scans: &S,
    progress: &(dyn Fn(AlignProgress) + Sync),
) -> Result<Vec<ScanSurface>, AlignError<S::Error, R>> {
    let total = scans.count();
    let most = (POINTS_IN_ALL / total).clamp(LEAST_POINTS, MOST_POINTS);
    let done = std::sync::atomic::AtomicUsize::new(0);
    (0..total)
        .into_par_iter()
        .map(|number| {
            let cloud = scans.cloud(number).map_err(|source| AlignError::Scan { number, source })?;
            let surface = ScanSurface::new(&cloud, most, scans.viewpoint(number))
                .map_err(|source| AlignError::Cloud { number, source })?;
            let done = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            progress(AlignProgress { stage: AlignStage::Read, done, total });
            Ok(surface)
        })
        .collect()
}

/// The joint refinement; the poses of the graph where it is switched off or leaves what the edges agree on.
fn refined(surfaces: &[ScanSurface], found: &Consensus, pool: &PairPool, options: &AlignOptions) -> Joint {
    let holding: Vec<GraphEdge> = pool
        .tried
        .iter()
        .zip(&found.verdicts)
        .filter(|(_, verdict)| **verdict == EdgeVerdict::Holds)
        .map(|(pair, _)| pair.edge.clone())
        .collect();
    let held: Vec<usize> = found.components.iter().map(|group| group[0]).collect();
    let mut pairs = Vec::new();
    for group in &found.components {
        pairs.extend(overlapping(surfaces, &found.poses, group, JOINT_OVERLAP));
    }
    let pairs = neighbours(surfaces.len(), pairs, &holding);
    let joint = refine_jointly(surfaces, &found.poses, &pairs, &holding, &held);
    let agrees = |poses: &[Rigid]| holding.iter().all(|e| e.cost(poses) <= LOOSER * CLOSES);
    if options.refine && agrees(&joint.poses) { joint } else { Joint { poses: found.poses.clone(), ..joint } }
}

/// The pairs that overlap most, up to a number a scan; those of edges always.
fn neighbours(scans: usize, mut pairs: Vec<(usize, usize, f64)>, edges: &[GraphEdge]) -> Vec<(usize, usize)> {
    pairs.sort_by(|x, y| y.2.total_cmp(&x.2).then((x.0, x.1).cmp(&(y.0, y.1))));
    let mut count = vec![0; scans];
    let mut chosen: Vec<(usize, usize)> =
        edges.iter().map(|e| (e.source.min(e.target), e.source.max(e.target))).collect();
    for (a, b, _) in pairs {
        if count[a] < JOINT_NEIGHBOURS || count[b] < JOINT_NEIGHBOURS {
            count[a] += 1;
            count[b] += 1;
            chosen.push((a, b));
        }
    }
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}
