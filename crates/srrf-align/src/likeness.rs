//! Which pairs of scans look as if they overlap: descriptors of few points a scan, matched and asked for consistent distances.

use rayon::prelude::*;
use srrf_classical::fpfh::{Descriptor, WIDTH, fpfh};
use srrf_classical::nearest_descriptors;
use srrf_cloud::{CloudError, PointCloud, Rigid, farthest_point_sampling, thin_to};

use crate::surface::ScanSurface;
use crate::verify::{Laid, laid, settled};

/// Points of a scan that are described.
const DESCRIBED: usize = 1200;
/// Those that are kept: the least common.
const KEPT: usize = 256;
/// Radius of the descriptors, in spacings of the thinned scans.
const FEATURE_SPACINGS: f64 = 5.0;
/// Words that descriptors are sorted into.
const WORDS: usize = 64;
const WORD_ROUNDS: usize = 6;
/// Most descriptors that the words are made from.
const WORD_SAMPLE: usize = 8192;

/// A scan in few descriptors.
#[derive(Debug, Clone)]
pub struct ScanDigest {
    points: Vec<[f64; 3]>,
    descriptors: Vec<Descriptor>,
    /// How often each word comes, rare words more; sums to 1.
    words: Vec<f32>,
}

/// The common voxel: what the median scan needs to come down to its points.
fn common_size(surfaces: &[ScanSurface]) -> f64 {
    // A surface of this radius has about 4 pi (radius / size)^2 voxels.
    let mut sizes: Vec<f64> = surfaces.iter().map(|s| s.radius * (12.0 / DESCRIBED as f64).sqrt()).collect();
    let middle = sizes.len() / 2;
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The digests of all scans.
///
/// # Errors
/// [`CloudError`] for a scan of fewer than three points, with its number.
pub fn digests(surfaces: &[ScanSurface]) -> Result<Vec<ScanDigest>, (usize, CloudError)> {
    if surfaces.is_empty() {
        return Ok(Vec::new());
    }
    let size = common_size(surfaces);
    let described: Vec<(Vec<[f64; 3]>, Vec<Descriptor>)> = surfaces
        .par_iter()
        .enumerate()
        .map(|(number, surface)| described(surface, size).map_err(|e| (number, e)))
        .collect::<Result<_, _>>()?;
    let total: usize = described.iter().map(|d| d.1.len()).sum();
    let sample: Vec<Descriptor> =
        described.iter().flat_map(|d| &d.1).step_by(total.div_ceil(WORD_SAMPLE).max(1)).copied().collect();
    let mean = mean(&sample);
    let words = words(&sample);
    let counts: Vec<Vec<f32>> = described.par_iter().map(|(_, d)| counted(d, &words)).collect();
    let rarity: Vec<f32> = (0..words.len())
        .map(|w| {
            let with = counts.iter().filter(|c| c[w] > 0.0).count();
            (1.0 + counts.len() as f32 / (1 + with) as f32).ln()
        })
        .collect();
    Ok(described
        .into_par_iter()
        .zip(counts)
        .map(|((points, descriptors), mut words)| {
            words.iter_mut().zip(&rarity).for_each(|(w, r)| *w *= r);
            let sum: f32 = words.iter().sum();
            words.iter_mut().for_each(|w| *w /= sum.max(f32::MIN_POSITIVE));
            let kept = uncommon(&points, &descriptors, &mean);
            ScanDigest {
                points: kept.iter().map(|&i| points[i]).collect(),
                descriptors: kept.iter().map(|&i| descriptors[i]).collect(),
                words,
            }
        })
        .collect())
}

fn described(surface: &ScanSurface, size: f64) -> Result<(Vec<[f64; 3]>, Vec<Descriptor>), CloudError> {
    let all = PointCloud::new(surface.points().to_vec())?;
    let thin = match srrf_cloud::voxel_downsample(&all, size) {
        Ok(thin) if thin.len() >= 16 => thin,
        _ => thin_to(&all, DESCRIBED, surface.radius),
    };
    let descriptors = fpfh(thin.points(), FEATURE_SPACINGS * size)?;
    Ok((thin.into_points(), descriptors))
}

fn mean(sample: &[Descriptor]) -> Descriptor {
    let mut mean = [0.0; WIDTH];
    for d in sample {
        mean.iter_mut().zip(d).for_each(|(m, v)| *m += v / sample.len() as f32);
    }
    mean
}

fn squared(a: &Descriptor, b: &Descriptor) -> f32 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum()
}

/// Cluster centres by Lloyd's rounds from every n-th descriptor of the sample.
fn words(sample: &[Descriptor]) -> Vec<Descriptor> {
    let mut centres: Vec<Descriptor> =
        sample.iter().step_by(sample.len().div_ceil(WORDS).max(1)).copied().collect();
    for _ in 0..WORD_ROUNDS {
        let near = nearest_descriptors(sample, &centres);
        let mut sums = vec![([0.0f32; WIDTH], 0.0f32); centres.len()];
        for (d, &word) in sample.iter().zip(&near) {
            let (sum, count) = &mut sums[word as usize];
            sum.iter_mut().zip(d).for_each(|(s, v)| *s += v);
            *count += 1.0;
        }
        for (centre, (sum, count)) in centres.iter_mut().zip(&sums) {
            if *count > 0.0 {
                centre.iter_mut().zip(sum).for_each(|(c, s)| *c = s / count);
            }
        }
    }
    centres
}

fn counted(descriptors: &[Descriptor], words: &[Descriptor]) -> Vec<f32> {
    let mut counts = vec![0.0; words.len()];
    nearest_descriptors(descriptors, words).iter().for_each(|w| counts[*w as usize] += 1.0);
    counts
}

/// Numbers of the points that are kept: of the half farthest from the mean descriptor, an even part.
fn uncommon(points: &[[f64; 3]], descriptors: &[Descriptor], mean: &Descriptor) -> Vec<usize> {
    let mut order: Vec<(f32, usize)> =
        descriptors.iter().enumerate().map(|(i, d)| (squared(d, mean), i)).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    order.truncate((points.len() / 2).max(KEPT.min(points.len())));
    let half: Vec<[f64; 3]> = order.iter().map(|(_, i)| points[*i]).collect();
    farthest_point_sampling(&half, KEPT.min(half.len()), 0).into_iter().map(|i| order[i].1).collect()
}

/// How alike two scans are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likeness {
    /// About how many matches agree.
    pub value: f64,
    /// Where those would put this scan, about the means of both.
    pub other_from_this: Option<Rigid>,
}

impl Likeness {
    const NONE: Self = Self { value: 0.0, other_from_this: None };
}

impl ScanDigest {
    /// Similarity of the words, in [0, 1].
    pub fn shared_words(&self, other: &Self) -> f32 {
        self.words.iter().zip(&other.words).map(|(a, b)| a.min(*b)).sum()
    }

    /// About how many matches keep their distances to each other: the largest eigenvalue of the graph of consistent matches, by
    /// which a few that agree stand out of many that do not. Source: Leordeanu and Hebert, "A spectral technique for
    /// correspondence problems using pairwise constraints", 2005.
    pub fn likeness(&self, other: &Self, tolerance: f64) -> Likeness {
        let forth = nearest_descriptors(&self.descriptors, &other.descriptors);
        let back = nearest_descriptors(&other.descriptors, &self.descriptors);
        let matches: Vec<([f64; 3], [f64; 3])> = forth
            .iter()
            .enumerate()
            .filter(|(i, j)| back[**j as usize] as usize == *i)
            .map(|(i, &j)| (self.points[i], other.points[j as usize]))
            .collect();
        let n = matches.len();
        if n < 4 {
            return Likeness::NONE;
        }
        let mut graph = vec![Vec::new(); n];
        for i in 0..n {
            for j in 0..i {
                let (a, b) = (distance(&matches[i].0, &matches[j].0), distance(&matches[i].1, &matches[j].1));
                if (a - b).abs() <= tolerance && a > 2.0 * tolerance {
                    graph[i].push(j);
                    graph[j].push(i);
                }
            }
        }
        let (mut x, mut value) = (vec![1.0; n], 0.0);
        for _ in 0..12 {
            let next: Vec<f64> = graph.iter().map(|row| row.iter().map(|j| x[*j]).sum()).collect();
            let norm = next.iter().map(|v| v * v).sum::<f64>().sqrt();
            if norm == 0.0 {
                return Likeness::NONE;
            }
            value = norm / x.iter().map(|v| v * v).sum::<f64>().sqrt();
            x = next.into_iter().map(|v| v / norm).collect();
        }
        Likeness { value, other_from_this: pose_of(&matches, &graph, &x) }
    }
}

/// The motion of the matches that agree with the strongest one and with each other, the strongest first.
fn pose_of(matches: &[([f64; 3], [f64; 3])], graph: &[Vec<usize>], strength: &[f64]) -> Option<Rigid> {
    let mut order: Vec<usize> = (0..matches.len()).collect();
    order.sort_by(|a, b| strength[*b].total_cmp(&strength[*a]).then(a.cmp(b)));
    let mut kept: Vec<usize> = Vec::new();
    for i in order {
        if kept.iter().all(|k| graph[*k].contains(&i)) {
            kept.push(i);
        }
    }
    let (a, b): (Vec<_>, Vec<_>) = kept.iter().map(|k| matches[*k]).unzip();
    Rigid::fit(&a, &b, None)
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// How many words a scan compares before it looks at matches.
pub const COMPARED: usize = 48;
/// Of the poses of a pair, so many are refined exactly.
const SETTLED: usize = 2;
/// Scans that share less than this by their walls say too little: many poses agree on so little.
const LEAST_OVERLAP: f64 = 0.25;
/// Likeness of scans whose walls lie on each other wholly: more than that of any that share points alone.
const BY_LAYOUT: f64 = 256.0;
/// Pairs of each scan that are laid on each other for a look.
const LOOKED_AT: usize = 32;
/// Up to so many scans, all pairs are compared by their matches.
pub const ALL_COMPARED: usize = 160;

/// Two scans that may overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LikelyPair {
    /// The scans, the lower number first.
    pub scans: (usize, usize),
    /// How alike they are: only a comparison with other pairs means something.
    pub value: f64,
    /// The second's frame from the first's, both centred; none where nothing told it.
    pub pose: Option<Rigid>,
}

/// Pairs and their likeness, the most alike first.
pub fn likely_pairs(surfaces: &[ScanSurface], digests: &[ScanDigest]) -> Vec<LikelyPair> {
    let n = digests.len();
    let tolerance = if n > 0 { common_size(surfaces) } else { 0.0 };
    let mut pairs: Vec<(usize, usize)> = if n <= ALL_COMPARED {
        (0..n).flat_map(|b| (0..b).map(move |a| (a, b))).collect()
    } else {
        let near: Vec<Vec<(usize, usize)>> = (0..n)
            .into_par_iter()
            .map(|i| {
                let mut others: Vec<(f32, usize)> =
                    (0..n).filter(|j| *j != i).map(|j| (digests[i].shared_words(&digests[j]), j)).collect();
                others.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
                others.truncate(COMPARED);
                others.into_iter().map(|(_, j)| (i.min(j), i.max(j))).collect()
            })
            .collect();
        near.into_iter().flatten().collect()
    };
    pairs.sort_unstable();
    pairs.dedup();
    let scored: Vec<(usize, usize, Likeness)> =
        pairs.into_par_iter().map(|(a, b)| (a, b, digests[a].likeness(&digests[b], tolerance))).collect();
    let mut sorted = looked_at(surfaces, scored);
    sorted.sort_by(|a, b| b.value.total_cmp(&a.value).then(a.scans.cmp(&b.scans)));
    sorted
}

/// The likeness of pairs after a look at how the scans lie on each other: of the best few of each scan; others keep a tenth of theirs.
/// Scans with walls of which no pose fits are no pair.
fn looked_at(surfaces: &[ScanSurface], mut pairs: Vec<(usize, usize, Likeness)>) -> Vec<LikelyPair> {
    pairs.sort_by(|a, b| b.2.value.total_cmp(&a.2.value).then((a.0, a.1).cmp(&(b.0, b.1))));
    let mut count = vec![0; surfaces.len()];
    let look: Vec<bool> = pairs
        .iter()
        .map(|&(a, b, _)| {
            let few = count[a] < LOOKED_AT || count[b] < LOOKED_AT;
            count[a] += usize::from(few);
            count[b] += usize::from(few);
            few
        })
        .collect();
    pairs
        .into_par_iter()
        .zip(look)
        .filter_map(|((a, b, alike), look)| {
            let by_points = alike.other_from_this.filter(|_| look);
            let (one, other) = (&surfaces[a], &surfaces[b]);
            let (value, found) = match other.poses_by_walls(one) {
                Some(mut poses) => {
                    poses.extend(by_points.filter(|pose| other.stands(one, pose)));
                    let found = best(one, other, &poses).filter(|laid| laid.overlap >= LEAST_OVERLAP)?;
                    (BY_LAYOUT * found.value, Some(found))
                }
                None => match best(one, other, by_points.as_slice()) {
                    Some(found) => (alike.value * found.value, Some(found)),
                    None => (0.1 * alike.value, None),
                },
            };
            Some(LikelyPair { scans: (a, b), value, pose: found.map(|laid| laid.target_from_source) })
        })
        .collect()
}

/// The pose in which two scans lie on each other best.
fn best(source: &ScanSurface, target: &ScanSurface, poses: &[Rigid]) -> Option<Laid> {
    let mut found: Vec<Laid> = poses.iter().filter_map(|pose| laid(source, target, pose)).collect();
    found.sort_by(|x, y| y.value.total_cmp(&x.value));
    let exact = found.iter().take(SETTLED).map(|rough| settled(source, target, rough));
    exact.max_by(|x, y| x.value.total_cmp(&y.value))
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};
    use srrf_corrupt::datasets::ShapeSource;
    use srrf_corrupt::shapes::ProceduralShapes;

    use super::*;
    use crate::se3::exp;

    #[test]
    fn scans_of_one_shape_come_before_those_of_two() {
        let shapes = ProceduralShapes::new(5, 4, None).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        // Four shapes, three samplings each, anywhere.
        let clouds: Vec<PointCloud> = (0..12)
            .map(|i| {
                let twist = nalgebra::Vector6::from_fn(|_, _| rng.random_range(-2.0..2.0));
                let cloud = shapes.sample(i / 3, 3000, &mut rng).unwrap();
                PointCloud::new(cloud.points().iter().map(|p| exp(&twist).apply(p)).collect()).unwrap()
            })
            .collect();
        let surfaces: Vec<ScanSurface> =
            clouds.iter().map(|c| ScanSurface::new(c, 2000, None).unwrap()).collect();
        let digests = digests(&surfaces).unwrap();
        let pairs = likely_pairs(&surfaces, &digests);
        assert_eq!(pairs.len(), 66);
        let first: usize = pairs[..12].iter().filter(|p| p.scans.0 / 3 == p.scans.1 / 3).count();
        assert_eq!(first, 12, "{:?}", &pairs[..16]);
        let words = |a: usize, b: usize| digests[a].shared_words(&digests[b]);
        assert!(words(0, 1) > words(0, 4) && (words(3, 3) - 1.0).abs() < 1e-5);
    }
}
