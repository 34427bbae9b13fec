//! [`PpfModel`]: a part made ready to be found in scenes, by the features of its pairs of points.

mod cluster;
mod feature;
mod sample;

use nalgebra::Vector3;
use rayon::prelude::*;
use srrf_cloud::{CloudError, KnnIndex, RegisterError, Solid};

pub use cluster::VotedPose;
use cluster::cluster;
use feature::{KEYS, LocalFrame, PairFeature};
use sample::OrientedSample;

/// Settings of [`PpfModel`]. Lengths are shares of the part's diameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PpfConfig {
    /// Distance between the points that both clouds are thinned to. Default 0.05, as in Drost et al.
    pub step: f64,
    /// Of the scene's thinned points, at most so many vote. Default 600.
    pub references: usize,
    /// A scene is thinned to at most so many points. Default 12,000.
    pub scene_points: usize,
    /// Poses to find. Default 16.
    pub keep: usize,
}

impl Default for PpfConfig {
    fn default() -> Self {
        Self { step: 0.05, references: 600, scene_points: 12_000, keep: 16 }
    }
}

/// Bins of the turn about a normal.
const TURNS: usize = 30;
/// Peaks that one point of a scene may give.
const PEAKS: usize = 2;
/// A part is thinned to at most so many points.
const MODEL_POINTS: usize = 1500;

/// A part made ready to be found in scenes: all pairs of its thinned points, in a table by their features ([Drost et al. 2010]). A pair
/// of the scene looks up the pairs of the part that are like it; each votes for the pose that lays it there. Where features of
/// neighbourhoods know a place by what is around it, pairs span the part: clutter around it takes nothing away.
///
/// Normals have no sign here, so that neither cloud needs to know its inside. A pair votes the less, the more pairs of the part are like it:
/// two points of one plane say little, and scenes are full of planes.
///
/// The same clouds give the same poses, with any number of threads; nothing is drawn by chance.
///
/// [Drost et al. 2010]: https://doi.org/10.1109/CVPR.2010.5540108
#[derive(Debug)]
pub struct PpfModel {
    config: PpfConfig,
    diameter: f64,
    /// The step of the settings, in the unit of the points.
    step: f64,
    sample: OrientedSample,
    /// The entries of feature `k` are those from `begins[k]` to `begins[k + 1]`.
    begins: Vec<u32>,
    entries: Vec<PartPair>,
}

/// A pair of the part: its first point (twice its number, one more where the normal is turned over), and the turn about its normal.
#[derive(Debug, Clone, Copy)]
struct PartPair {
    point: u32,
    turn: f32,
}

impl PpfModel {
    /// Makes a part ready: `part` is its surface, all of it or what is known.
    ///
    /// # Errors
    /// Those of [`KnnIndex::new`], of which solid clouds have none.
    pub fn new(part: Solid<'_>, config: PpfConfig) -> Result<Self, CloudError> {
        let centre = part.middle();
        let far = |p: &[f64; 3]| (Vector3::from(*p) - centre).norm();
        let diameter = 2.0 * part.points().iter().map(far).fold(0.0, f64::max);
        let step = config.step * diameter;
        let sample = OrientedSample::new(&part, step, MODEL_POINTS)?;
        let count = sample.cloud.len();
        let mut keyed = Vec::with_capacity(2 * count * (count - 1));
        for (i, (point, normal)) in sample.iter().enumerate() {
            for (side, normal) in [normal, -normal].into_iter().enumerate() {
                let frame = LocalFrame::at(&point, &normal);
                for (j, (other, other_normal)) in sample.iter().enumerate() {
                    if i == j {
                        continue;
                    }
                    let feature = PairFeature::of(&point, &normal, &other, &other_normal);
                    let Some(key) = feature.and_then(|feature| feature.key(step)) else { continue };
                    let entry = PartPair { point: (2 * i + side) as u32, turn: frame.turn(&other) as f32 };
                    keyed.push((key as u32, entry));
                }
            }
        }
        let (begins, entries) = by_key(keyed);
        Ok(Self { config, diameter, step, sample, begins, entries })
    }

    /// Twice the distance of the part's farthest point from its middle.
    pub fn diameter(&self) -> f64 {
        self.diameter
    }

    /// Where the part may be in `scene`: `scene ~ R part + t`, most votes first.
    ///
    /// # Errors
    /// Those of [`KnnIndex::new`] as [`RegisterError::Target`], of which solid clouds have none.
    pub fn poses(&self, scene: Solid<'_>) -> Result<Vec<VotedPose>, RegisterError> {
        let sample = OrientedSample::new(&scene, self.step, self.config.scene_points)
            .map_err(RegisterError::Target)?;
        let index = KnnIndex::new(sample.cloud.points()).map_err(RegisterError::Target)?;
        let stride = sample.cloud.len().div_ceil(self.config.references.max(1));
        let references: Vec<usize> = (0..sample.cloud.len()).step_by(stride).collect();
        let found: Vec<Vec<VotedPose>> = references
            .par_iter()
            .map_init(
                || vec![0.0_f32; 2 * self.sample.cloud.len() * TURNS],
                |votes, &reference| self.vote(&sample, &index, reference, votes),
            )
            .collect();
        let centre = self.sample.cloud.centroid();
        Ok(cluster(found.concat(), centre.into(), self.diameter, self.config.keep))
    }

    /// The poses that one point of the scene votes for.
    fn vote(
        &self,
        scene: &OrientedSample,
        index: &KnnIndex,
        reference: usize,
        votes: &mut [f32],
    ) -> Vec<VotedPose> {
        votes.fill(0.0);
        let (point, normal) = scene.at(reference);
        let frame = LocalFrame::at(&point, &normal);
        for (other, _) in index.within(&point.into(), self.diameter, usize::MAX) {
            if other == reference {
                continue;
            }
            let (second, second_normal) = scene.at(other);
            let feature = PairFeature::of(&point, &normal, &second, &second_normal);
            let Some(key) = feature.and_then(|feature| feature.key(self.step)) else { continue };
            let alike = &self.entries[self.begins[key] as usize..self.begins[key + 1] as usize];
            if alike.is_empty() {
                continue;
            }
            let weight = 1.0 / (alike.len() as f32).sqrt();
            let turn = frame.turn(&second) as f32;
            for entry in alike {
                let bin = turn_bin(turn - entry.turn);
                votes[entry.point as usize * TURNS + bin] += weight;
            }
        }
        let pose = |(votes, of, bin): (f32, usize, usize)| {
            let (model_point, model_normal) = self.sample.at(of / 2);
            let model_normal = if of % 2 == 0 { model_normal } else { -model_normal };
            let model = LocalFrame::at(&model_point, &model_normal);
            let turn = (bin as f64 + 0.5) / TURNS as f64 * std::f64::consts::TAU;
            VotedPose { target_from_source: frame.onto(&model, turn), votes: f64::from(votes) }
        };
        peaks(votes).into_iter().map(pose).collect()
    }
}

/// Entries in the order of their keys, after where those of each key begin.
fn by_key(keyed: Vec<(u32, PartPair)>) -> (Vec<u32>, Vec<PartPair>) {
    let mut begins = vec![0_u32; KEYS + 1];
    for (key, _) in &keyed {
        begins[*key as usize + 1] += 1;
    }
    for key in 0..KEYS {
        begins[key + 1] += begins[key];
    }
    let mut next = begins.clone();
    let mut entries = vec![PartPair { point: 0, turn: 0.0 }; keyed.len()];
    for (key, entry) in keyed {
        let place = &mut next[key as usize];
        entries[*place as usize] = entry;
        *place += 1;
    }
    (begins, entries)
}

/// The best places of a table of votes, one for an oriented point of the part: sum of the votes, point, bin of the turn. Turns between two bins
/// have their votes in both.
fn peaks(votes: &[f32]) -> Vec<(f32, usize, usize)> {
    let mut best: Vec<(f32, usize, usize)> = Vec::new();
    for (of, row) in votes.chunks_exact(TURNS).enumerate() {
        let sum = |bin: usize| row[bin] + 0.5 * (row[(bin + 1) % TURNS] + row[(bin + TURNS - 1) % TURNS]);
        let Some((bin, sum)) =
            (0..TURNS).map(|bin| (bin, sum(bin))).reduce(|a, b| if b.1 > a.1 { b } else { a })
        else {
            continue;
        };
        if sum > best.get(PEAKS - 1).map_or(0.0, |least| least.0) {
            let place = best.iter().position(|known| sum > known.0).unwrap_or(best.len());
            best.insert(place, (sum, of, bin));
            best.truncate(PEAKS);
        }
    }
    best
}

fn turn_bin(turn: f32) -> usize {
    let share = (turn / std::f32::consts::TAU).rem_euclid(1.0);
    ((share * TURNS as f32) as usize).min(TURNS - 1)
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};
    use srrf_cloud::{EulerXyz, PointCloud, Rigid};

    use super::*;

    /// The surface of a box with these corners, by chance.
    fn surface(rng: &mut ChaCha8Rng, low: [f64; 3], high: [f64; 3], count: usize) -> Vec<[f64; 3]> {
        let face = |_| {
            let mut p: [f64; 3] = std::array::from_fn(|c| rng.random_range(low[c]..high[c]));
            let axis = rng.random_range(0..3);
            p[axis] = if rng.random() { low[axis] } else { high[axis] };
            p
        };
        (0..count).map(face).collect()
    }

    /// Three boxes in one, none of them in the middle of another: no turn brings it onto itself.
    fn part(rng: &mut ChaCha8Rng) -> PointCloud {
        let boxes = [
            ([0.0, 0.0, 0.0], [1.0, 0.4, 0.3]),
            ([0.7, 0.0, 0.3], [1.0, 0.3, 0.9]),
            ([0.0, 0.4, 0.0], [0.25, 0.75, 0.2]),
        ];
        PointCloud::new(boxes.map(|(low, high)| surface(rng, low, high, 3000)).concat()).unwrap()
    }

    /// The part from above, on a floor, among boxes; and where it is.
    fn scene(rng: &mut ChaCha8Rng) -> (PointCloud, Rigid) {
        let rotation = EulerXyz::from_deg([20.0, -35.0, 140.0]).to_matrix();
        let pose = Rigid { rotation, translation: [1.3, -0.8, 0.9].into() };
        let mut points = part(rng).transformed(&pose).into_points();
        points.retain(|p| (p[0] * 3.1).sin() < 0.8);
        points.extend(surface(rng, [-2.0, -2.5, -0.02], [3.0, 2.0, 0.0], 9000));
        points.extend(surface(rng, [-1.0, -1.0, 0.0], [-0.2, -0.3, 0.9], 3000));
        points.extend(surface(rng, [0.5, 0.9, 0.0], [1.9, 1.4, 0.5], 3000));
        (PointCloud::new(points).unwrap(), pose)
    }

    #[test]
    fn a_part_is_found_among_others() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let (part, (scene, pose)) = (part(&mut rng), scene(&mut rng));
        let model = PpfModel::new(Solid::new(&part).unwrap(), PpfConfig::default()).unwrap();
        let found = model.poses(Solid::new(&scene).unwrap()).unwrap();
        assert_eq!(found.len(), 16);
        let (best, next) = (found[0], found[1]);
        let centre = part.centroid().into();
        let off = (0..3).map(|c| best.target_from_source.apply(&centre)[c] - pose.apply(&centre)[c]);
        let off = off.map(|d| d * d).sum::<f64>().sqrt();
        let turned = best.target_from_source.angle_to_deg(&pose);
        assert!(turned < 12.0 && off < 0.1, "{turned} degrees, {off}");
        assert!(best.votes > 1.5 * next.votes, "{} {}", best.votes, next.votes);
    }

    #[test]
    fn votes_do_not_depend_on_threads() {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let (part, (scene, _)) = (part(&mut rng), scene(&mut rng));
        let config = PpfConfig { step: 0.08, references: 150, keep: 5, ..PpfConfig::default() };
        let model = PpfModel::new(Solid::new(&part).unwrap(), config).unwrap();
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| model.poses(Solid::new(&scene).unwrap()).unwrap())
        };
        let one = with(1);
        assert_eq!((one.len(), &one), (5, &with(3)));
    }

    #[test]
    fn a_peak_is_one_of_its_point_and_counts_its_neighbours() {
        let mut votes = vec![0.0; 4 * TURNS];
        (votes[5], votes[8]) = (3.0, 2.9);
        (votes[2 * TURNS], votes[2 * TURNS + TURNS - 1]) = (2.0, 4.0);
        votes[3 * TURNS + 7] = 1.0;
        assert_eq!(peaks(&votes), [(5.0, 2, TURNS - 1), (3.0, 0, 5)]);
        assert_eq!(peaks(&[0.0; 2 * TURNS]), []);
    }
}
