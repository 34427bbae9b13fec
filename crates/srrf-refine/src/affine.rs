//! Whether an affine map fits where no rigid motion does: a shear, or one axis longer than in the other cloud.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use serde::Serialize;
use srrf_cloud::Rigid;

use crate::Metric;
use crate::matching::{median_distance, support_of};
use crate::prepared::CloudLevel;

/// Iterations of the fit.
const ITERATIONS: usize = 20;
/// Factor of the kernel's scale at each iteration.
const SHRINK: f64 = 0.85;
/// Last scale of the kernel, in point spacings, as [`crate::RefineConfig::end_spacings`].
const END: f64 = 0.5;
/// Pull towards the rigid pose, as a share of the mean diagonal: keeps directions that no match tells.
const PULL: f64 = 1e-3;

/// What an affine map fits better than a rigid pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AffineFit {
    /// How far the affine map moves the source points away from where the nearest rigid motion moves them (root mean
    /// square), in point spacings.
    pub bend: f64,
    /// Support of the affine map less that of the rigid pose, as in [`crate::StartSupport::support`].
    pub gain: f64,
}

/// An affine map `x -> linear x + shift`.
#[derive(Debug, Clone, Copy)]
struct Affine {
    linear: Matrix3<f64>,
    shift: Vector3<f64>,
}

impl Affine {
    fn apply(&self, point: &[f64; 3]) -> Vector3<f64> {
        self.linear * Vector3::from(*point) + self.shift
    }
}

/// Fits an affine map from `pose` on and compares; `support` is that of the pose.
pub(crate) fn affine_fit(source: &CloudLevel, target: &CloudLevel, pose: &Rigid, support: f64) -> AffineFit {
    let spacing = source.spacing.max(target.spacing);
    let end = END * spacing;
    let mut scale = (2.0 * median_distance(source, target, pose)).max(2.0 * spacing);
    let rigid = Affine { linear: pose.rotation, shift: pose.translation };
    let mut map = rigid;
    for _ in 0..ITERATIONS {
        let Some(next) = step(source, target, &map, &rigid, scale) else { break };
        map = next;
        scale = (scale * SHRINK).max(end);
    }
    AffineFit {
        bend: bend(source, &map) / spacing,
        gain: support_of_map(source, target, &map, spacing) - support,
    }
}

/// The matches of both sides: source point, moved point, target point, normal in the target frame. None where the map has no inverse.
fn matches(source: &CloudLevel, target: &CloudLevel, map: &Affine) -> Option<Vec<[Vector3<f64>; 4]>> {
    let inverse = map.linear.try_inverse()?;
    let from_source = source.points().iter().map(|x| {
        let moved = map.apply(x);
        let (j, _) = target.index.nearest(&moved.into());
        [Vector3::from(*x), moved, Vector3::from(target.points()[j]), target.normals[j]]
    });
    let from_target = target.points().iter().map(|y| {
        let fixed = Vector3::from(*y);
        let (j, _) = source.index.nearest(&(inverse * (fixed - map.shift)).into());
        let x = &source.points()[j];
        // Normals move with the inverse transpose.
        let normal = (inverse.transpose() * source.normals[j]).try_normalize(0.0).unwrap_or_default();
        [Vector3::from(*x), map.apply(x), fixed, normal]
    });
    Some(from_source.chain(from_target).collect())
}

fn step(
    source: &CloudLevel,
    target: &CloudLevel,
    map: &Affine,
    rigid: &Affine,
    scale: f64,
) -> Option<Affine> {
    let mut hessian = SMatrix::<f64, 12, 12>::zeros();
    let mut right = SVector::<f64, 12>::zeros();
    let squared = scale * scale;
    let (a, b) = Metric::Both.weights();
    for [x, moved, fixed, normal] in matches(source, target, map)? {
        let w = squared / (squared + (moved - fixed).norm_squared());
        let (a, b) = (a * w * w, b * w * w);
        // The unknowns are the rows of [linear | shift]: r = U h - y with h = (x, 1).
        let h = x.push(1.0);
        let metric = a * Matrix3::identity() + b * normal * normal.transpose();
        let outer = h * h.transpose();
        let wanted = metric * fixed;
        for i in 0..3 {
            for j in 0..3 {
                let mut block = hessian.fixed_view_mut::<4, 4>(4 * i, 4 * j);
                block += metric[(i, j)] * outer;
            }
            let mut part = right.fixed_rows_mut::<4>(4 * i);
            part += wanted[i] * h;
        }
    }
    // Pull on the linear part alone, relative to its own diagonal.
    let diagonal: f64 = (0..12).filter(|i| i % 4 < 3).map(|i| hessian[(i, i)]).sum::<f64>() / 9.0;
    let pull = PULL * diagonal;
    if pull.is_nan() || pull <= 0.0 {
        return None;
    }
    for i in 0..3 {
        for j in 0..3 {
            hessian[(4 * i + j, 4 * i + j)] += pull;
            right[4 * i + j] += pull * rigid.linear[(i, j)];
        }
    }
    let x = hessian.cholesky()?.solve(&right);
    let linear = Matrix3::from_fn(|i, j| x[4 * i + j]);
    let shift = Vector3::from_fn(|i, _| x[4 * i + 3]);
    x.iter().all(|v| v.is_finite()).then_some(Affine { linear, shift })
}

/// Root mean square distance between where the map moves the points and where the nearest rigid motion does.
fn bend(source: &CloudLevel, map: &Affine) -> f64 {
    let n = source.points().len() as f64;
    let mean = source.points().iter().map(|p| Vector3::from(*p)).sum::<Vector3<f64>>() / n;
    let covariance: Matrix3<f64> = source
        .points()
        .iter()
        .map(|p| Vector3::from(*p) - mean)
        .map(|p| p * p.transpose())
        .sum::<Matrix3<f64>>()
        / n;
    let Some(rotation) = Rigid::nearest_rotation(&(map.linear * covariance)) else { return 0.0 };
    let rest = map.linear - rotation;
    (rest * covariance * rest.transpose()).trace().max(0.0).sqrt()
}

/// [`crate::matching::support`] of an affine map.
fn support_of_map(source: &CloudLevel, target: &CloudLevel, map: &Affine, spacing: f64) -> f64 {
    let Some(matches) = matches(source, target, map) else { return 0.0 };
    let squared: Vec<f64> =
        matches.iter().map(|[_, moved, fixed, _]| (moved - fixed).norm_squared()).collect();
    let (from_source, from_target) = squared.split_at(source.points().len());
    support_of(from_source, from_target, spacing)
}

#[cfg(test)]
mod tests {
    use srrf_cloud::PointCloud;
    use srrf_corrupt::shapes::ProceduralShapes;
    use srrf_corrupt::{
        CorruptionKind, Pair, PairConfig, PairSynthesizer, PoseDraw, Sampling, Severity, Stream,
    };

    use super::*;
    use crate::matching::{both_sides, support};
    use crate::prepared::RefineCloud;

    /// A pair that samples one shape twice.
    fn pair(corruption: Option<(CorruptionKind, Severity)>, item: u64) -> Pair {
        let shapes = ProceduralShapes::new(11, 9, None).unwrap();
        let config = PairConfig {
            sampling: Sampling::Independent,
            keep_correspondence: false,
            ..PairConfig::default()
        };
        let stream = Stream { seed: 5, item };
        let synthesizer = PairSynthesizer::new(config).unwrap();
        synthesizer.pair(&shapes, item as usize % 9, corruption, PoseDraw::Seeded, stream).unwrap()
    }

    /// The fit from its true pose.
    fn fit(kind: CorruptionKind, severity: u8, item: u64) -> AffineFit {
        let pair = pair(Some((kind, Severity::try_from(severity).unwrap())), item);
        between(&pair.source, &pair.target, &pair.target_from_source)
    }

    fn between(source: &PointCloud, target: &PointCloud, pose: &Rigid) -> AffineFit {
        let (source, target) = (RefineCloud::of(source), RefineCloud::of(target));
        let pose = source.frame_to(&target).pose(pose);
        let (source, target) = (source.coarse(), target.coarse());
        let support = support(&both_sides(source, target, &pose), source.spacing.max(target.spacing));
        affine_fit(source, target, &pose, support)
    }

    #[test]
    fn a_shear_is_told_from_noise_and_holes() {
        for item in 0..4 {
            let sheared = fit(CorruptionKind::Shear, 5, item);
            assert!(sheared.bend > 1.0 && sheared.gain > 0.02, "{item}: {sheared:?}");
            for kind in [CorruptionKind::Gaussian, CorruptionKind::Cutout, CorruptionKind::DensityDec] {
                let rigid = fit(kind, 4, item);
                assert!(rigid.bend < 0.8 && rigid.gain < 0.02, "{kind} {item}: {rigid:?}");
            }
        }
    }

    #[test]
    fn finds_the_map_that_was_applied() {
        let source = pair(None, 3).source;
        let linear = Matrix3::new(1.1, 0.2, 0.0, 0.0, 0.95, -0.1, 0.0, 0.0, 1.0);
        let moved = source.points().iter().map(|p| (linear * Vector3::from(*p)).into()).collect();
        let target = PointCloud::new(moved).unwrap();
        let found = between(&source, &target, &Rigid::identity());
        let n = source.points().len() as f64;
        let spread = source.points().iter().map(|p| Vector3::from(*p).norm_squared()).sum::<f64>() / n;
        // What the map bends, by its definition, in root mean square over the points.
        let prepared = RefineCloud::of(&source);
        let spacing = RefineCloud::of(&target).coarse().spacing;
        let spacing = spacing.max(prepared.coarse().spacing);
        let want = bend(prepared.coarse(), &Affine { linear, shift: Vector3::zeros() }) / spacing;
        assert!(
            want * spacing > 0.05 * spread.sqrt() && (found.bend - want).abs() < 0.02 * want,
            "{found:?}, {want}"
        );
        assert!(found.gain > 0.5, "{found:?}");
    }

    #[test]
    fn flat_and_tiny_clouds_have_an_answer() {
        let flat: Vec<[f64; 3]> = (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]).collect();
        let flat = PointCloud::new(flat).unwrap();
        let found = between(&flat, &flat, &Rigid::identity());
        assert!(found.bend < 1e-6 && found.gain.abs() < 1e-6, "{found:?}");
        let few = PointCloud::new(vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]])
            .unwrap();
        let found = between(&few, &few, &Rigid::identity());
        assert!(found.bend.is_finite() && found.gain.is_finite(), "{found:?}");
    }
}
