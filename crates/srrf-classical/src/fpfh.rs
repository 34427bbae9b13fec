//! Fast point feature histograms.

use std::f64::consts::PI;

use nalgebra::Vector3;
use rayon::prelude::*;
use srrf_cloud::{CloudError, KnnIndex, estimate_normals};

/// Bins of each of the three angles.
const BINS: usize = 11;
/// Length of a descriptor, padded from 33 for the vector units; the rest is 0.
pub const WIDTH: usize = 36;
/// Most neighbours of a histogram, as in Open3D's examples.
const NEAREST: usize = 100;
/// Most neighbours where they are to represent the whole neighbourhood.
const THROUGHOUT: usize = 200;
/// NeighbourChoice of a normal. Open3D takes up to 30 within 2 voxels, where a thinned surface has about 13.
const NORMAL_NEIGHBOURS: usize = 15;

/// A descriptor: 33 numbers, each block of 11 sums to 100 (0 for a point alone), then zeros.
pub type Descriptor = [f32; WIDTH];

/// The fast point feature histograms of `points` (Rusu, Blodow and Beetz 2009), neighbourhoods within
/// `radius`; one descriptor a point.
///
/// Each pair of neighbours gives three angles of its normals and connecting line; a point's simplified
/// histogram counts those with its neighbours, and the descriptor is the mean of its neighbours' by
/// inverse squared distance, as in Open3D, plus its own. Normals point away from the mean of the cloud, so that the
/// descriptors do not change with the pose.
pub fn fpfh(points: &[[f64; 3]], radius: f64) -> Result<Vec<Descriptor>, CloudError> {
    Ok(Oriented::new(points)?.describe(radius, NeighbourChoice::Nearest))
}

/// Which of the points within the radius make a histogram, where there are very many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NeighbourChoice {
    /// The nearest 100. Beyond some 6 point spacings the radius then says nothing: a surface has more within it.
    Nearest,
    /// 200 at all distances.
    Throughout,
}

/// Indexed points with normals: what descriptors of every radius begin with.
#[derive(Debug)]
pub(crate) struct Oriented {
    index: KnnIndex,
    normals: Vec<Vector3<f64>>,
}

impl Oriented {
    /// # Errors
    /// [`CloudError::TooFew`] under 3 points, [`CloudError::NotFinite`] at the first NaN or infinity.
    pub fn new(points: &[[f64; 3]]) -> Result<Self, CloudError> {
        let normals = estimate_normals(points, NORMAL_NEIGHBOURS)?.into_iter().map(Vector3::from).collect();
        Ok(Self { index: KnnIndex::new(points)?, normals })
    }

    /// As [`fpfh`].
    pub fn describe(&self, radius: f64, of: NeighbourChoice) -> Vec<Descriptor> {
        let (points, normals) = (self.index.points(), &self.normals);
        let neighbours: Vec<Vec<(usize, f64)>> =
            points.par_iter().map(|p| self.neighbours(p, radius, of)).collect();
        let simple: Vec<[f64; 3 * BINS]> = (0..points.len())
            .into_par_iter()
            .map(|i| simplified(i, points, normals, &neighbours[i]))
            .collect();
        (0..points.len()).into_par_iter().map(|i| descriptor(&simple, i, &neighbours[i])).collect()
    }

    fn neighbours(&self, point: &[f64; 3], radius: f64, of: NeighbourChoice) -> Vec<(usize, f64)> {
        if of == NeighbourChoice::Nearest {
            return self.index.within(point, radius, NEAREST);
        }
        let all = self.index.within(point, radius, usize::MAX);
        if all.len() <= THROUGHOUT {
            return all;
        }
        // Sorted by distance.
        (0..THROUGHOUT).map(|k| all[k * all.len() / THROUGHOUT]).collect()
    }
}

/// The mean of the neighbours' histograms by inverse squared distance, plus the point's own.
fn descriptor(simple: &[[f64; 3 * BINS]], i: usize, neighbours: &[(usize, f64)]) -> Descriptor {
    let mut weighted = [0.0; 3 * BINS];
    for &(j, squared) in neighbours.iter().filter(|n| n.1 > 0.0) {
        weighted.iter_mut().zip(&simple[j]).for_each(|(sum, h)| *sum += h / squared);
    }
    let mut descriptor = [0.0; WIDTH];
    for block in 0..3 {
        let range = block * BINS..(block + 1) * BINS;
        let total: f64 = weighted[range.clone()].iter().sum();
        for bin in range {
            let mean = if total > 0.0 { 100.0 * weighted[bin] / total } else { 0.0 };
            descriptor[bin] = (mean + simple[i][bin]) as f32;
        }
    }
    descriptor
}

/// Counts of the angles between a point and each neighbour, each block summing to 100.
fn simplified(
    i: usize,
    points: &[[f64; 3]],
    normals: &[Vector3<f64>],
    neighbours: &[(usize, f64)],
) -> [f64; 3 * BINS] {
    let mut counts = [0.0; 3 * BINS];
    let mut total = 0.0;
    for &(j, squared) in neighbours {
        if squared > 0.0 {
            let line = Vector3::from(points[j]) - Vector3::from(points[i]);
            let features = pair_features(&line, &normals[i], &normals[j]);
            for (block, share) in features.into_iter().enumerate() {
                let bin = ((share * BINS as f64) as usize).min(BINS - 1);
                counts[block * BINS + bin] += 1.0;
            }
            total += 1.0;
        }
    }
    if total > 0.0 {
        counts.iter_mut().for_each(|c| *c *= 100.0 / total);
    }
    counts
}

/// The angles theta, alpha and phi of Rusu et al., each scaled to [0, 1]. The point whose normal is closer
/// to the line is the origin of the frame.
fn pair_features(line: &Vector3<f64>, first: &Vector3<f64>, second: &Vector3<f64>) -> [f64; 3] {
    let direction = line.normalize();
    let (cos_first, cos_second) = (first.dot(&direction), second.dot(&direction));
    let (u, other, d, phi) = if cos_first.abs() < cos_second.abs() {
        (second, first, -direction, -cos_second)
    } else {
        (first, second, direction, cos_first)
    };
    let Some(v) = d.cross(u).try_normalize(1e-12) else { return [0.5, 0.5, (phi + 1.0) / 2.0] };
    let w = u.cross(&v);
    let theta = w.dot(other).atan2(u.dot(other));
    [(theta + PI) / (2.0 * PI), (v.dot(other) + 1.0) / 2.0, (phi + 1.0) / 2.0].map(|f| f.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use srrf_cloud::{EulerXyz, Rigid};

    use super::*;

    fn sheet() -> Vec<[f64; 3]> {
        let point = |i: usize, j: usize| {
            let (u, v) = (i as f64 / 22.0, j as f64 / 16.0);
            [1.3 * u - 0.5, 0.8 * v * (1.0 + 0.3 * u), 0.4 * (3.0 * u).sin() + 0.3 * v * v]
        };
        (0..23).flat_map(|i| (0..17).map(move |j| point(i, j))).collect()
    }

    #[test]
    fn blocks_sum_to_twice_a_hundred() {
        for d in fpfh(&sheet(), 0.2).unwrap() {
            for block in 0..3 {
                let sum: f32 = d[block * BINS..(block + 1) * BINS].iter().sum();
                assert!((sum - 200.0).abs() < 1e-2);
            }
            assert_eq!(d[33..], [0.0; 3]);
        }
    }

    #[test]
    fn the_pose_does_not_matter_and_the_place_does() {
        let pose = Rigid {
            rotation: EulerXyz::from_deg([70.0, -20.0, 130.0]).to_matrix(),
            translation: Vector3::new(5.0, -3.0, 2.0),
        };
        let moved: Vec<[f64; 3]> = sheet().iter().map(|p| pose.apply(p)).collect();
        let (a, b) = (fpfh(&sheet(), 0.25).unwrap(), fpfh(&moved, 0.25).unwrap());
        let distance =
            |x: &Descriptor, y: &Descriptor| -> f32 { x.iter().zip(y).map(|(p, q)| (p - q).abs()).sum() };
        // Values at the edge of a bin may fall on either side.
        let same = a.iter().zip(&b).filter(|(x, y)| distance(x, y) < 30.0).count();
        assert!(same as f64 > 0.95 * a.len() as f64, "{same} of {}", a.len());
        assert!(distance(&a[0], &a[200]) > 30.0);
    }

    #[test]
    fn wide_neighbourhoods_differ_where_they_are_heard_throughout() {
        let flat: Vec<[f64; 3]> = (0..2500).map(|i| [f64::from(i % 50), f64::from(i / 50), 0.0]).collect();
        let oriented = Oriented::new(&flat).unwrap();
        let reach = |radius, of| oriented.neighbours(&flat[1275], radius, of).last().unwrap().1.sqrt();
        assert!(reach(8.0, NeighbourChoice::Nearest) < 6.0 && reach(12.0, NeighbourChoice::Nearest) < 6.0);
        for radius in [8.0, 12.0] {
            let found = oriented.neighbours(&flat[1275], radius, NeighbourChoice::Throughout);
            assert!(found.len() == THROUGHOUT || radius < 8.5 && found.len() > 190, "{}", found.len());
            assert!(reach(radius, NeighbourChoice::Throughout) > 0.9 * radius);
        }
    }

    #[test]
    fn points_alone_and_coinciding_points_are_fine() {
        let far: Vec<[f64; 3]> = (0..9).map(|i| [100.0 * f64::from(i), f64::from(i * i), 0.0]).collect();
        assert!(fpfh(&far, 0.1).unwrap().iter().flatten().all(|v| *v == 0.0));
        assert!(fpfh(&[[1.0; 3]; 20], 0.1).unwrap().iter().flatten().all(|v| v.is_finite()));
    }
}
