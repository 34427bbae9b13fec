//! [`Similarity`]: seven parameters fitted to two clouds that lie nearly on each other.
//!
//! Point to plane, from both clouds to the other: a cloud that shrinks to a point of the other pays for it on the way back.

use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, Vector3};
use rayon::prelude::*;
use srrf_cloud::{CloudError, KnnIndex, PointCloud, Rigid, estimate_normals};

/// Points of each cloud that are asked for their nearest neighbour.
const ASKED: usize = 5_000;
/// Points of each cloud that can be neighbours.
const KEPT: usize = 60_000;
/// Neighbours that give a normal.
const NORMAL_POINTS: usize = 12;
const ITERATIONS: usize = 40;
/// Smallest step, as a share of the radius and of a turn of one radian.
const STILL: f64 = 1e-7;
/// A scale whose lever, the root mean square of a point's distance along its normal from the middle, is under this share of the radius
/// is undetermined: all points lie in one plane.
const LEAST_LEVER: f64 = 1e-3;

type Matrix7 = SMatrix<f64, 7, 7>;
type Vector7 = SVector<f64, 7>;

/// A motion with a scale: `target ~ rotation * (scale * source) + translation`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Similarity {
    pub scale: f64,
    /// Of the source that has been scaled.
    pub pose: Rigid,
}

/// A fitted similarity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fitted {
    pub similarity: Similarity,
    /// Standard error of the scale: how much it changes where each eighth of the space is left out in turn (jackknife). Infinite where
    /// the clouds do not determine it.
    pub spread: f64,
    /// Geometric mean of the shares of source and target that lie on each other.
    pub overlap: f64,
}

/// A cloud made ready, about its own middle.
struct FitSide {
    middle: Vector3<f64>,
    index: KnnIndex,
    normals: Vec<[f64; 3]>,
    asked: Vec<usize>,
    spacing: f64,
    radius: f64,
}

impl FitSide {
    fn new(cloud: &PointCloud) -> Result<Self, CloudError> {
        let middle = cloud.middle();
        let step = cloud.len().div_ceil(KEPT);
        let points: Vec<[f64; 3]> =
            cloud.points().iter().step_by(step).map(|p| (Vector3::from(*p) - middle).into()).collect();
        let normals = estimate_normals(&points, NORMAL_POINTS)?;
        let index = KnnIndex::new(&points)?;
        let asked = (0..points.len()).step_by(points.len().div_ceil(ASKED)).collect();
        let squares: f64 = points.iter().map(|p| Vector3::from(*p).norm_squared()).sum();
        let radius = (squares / points.len() as f64).sqrt();
        Ok(Self { middle, spacing: srrf_cloud::spacing_of(&index), index, normals, asked, radius })
    }

    fn point(&self, i: usize) -> Vector3<f64> {
        self.index.points()[i].into()
    }
}

/// Two clouds made ready.
pub(crate) struct SimilarityFit {
    source: FitSide,
    target: FitSide,
}

/// A moved source point, its match in the target, and the normal there, all about the middle of the target.
#[derive(Debug, Clone, Copy)]
struct Pairing {
    moved: Vector3<f64>,
    fixed: Vector3<f64>,
    normal: Vector3<f64>,
    from_source: bool,
}

/// `target = scale * rotation * source + shift`, both about their middles.
#[derive(Debug, Clone, Copy)]
struct Local {
    scale: f64,
    rotation: Matrix3<f64>,
    shift: Vector3<f64>,
}

impl Local {
    fn apply(&self, p: Vector3<f64>) -> Vector3<f64> {
        self.scale * (self.rotation * p) + self.shift
    }

    fn undo(&self, q: Vector3<f64>) -> Vector3<f64> {
        self.rotation.transpose() * (q - self.shift) / self.scale
    }

    /// A further turn, shift and growth about `centre`.
    fn then(&self, step: &Vector7, centre: Vector3<f64>) -> Self {
        let turn = Rotation3::new(Vector3::new(step[0], step[1], step[2])).into_inner();
        let growth = step[6].exp();
        let shift = Vector3::new(step[3], step[4], step[5]);
        Self {
            scale: growth * self.scale,
            rotation: turn * self.rotation,
            shift: centre + growth * (turn * (self.shift - centre)) + shift,
        }
    }
}

impl SimilarityFit {
    /// Makes both clouds ready.
    ///
    /// # Errors
    /// [`CloudError`] for clouds of fewer than three points.
    pub fn new(source: &PointCloud, target: &PointCloud) -> Result<Self, CloudError> {
        Ok(Self { source: FitSide::new(source)?, target: FitSide::new(target)? })
    }

    /// Improves a similarity that is nearly right; none where the numbers give out.
    pub fn fit(&self, start: &Similarity) -> Option<Fitted> {
        let mut local = self.local(start);
        for _ in 0..ITERATIONS {
            let pairings = self.pairings(&local);
            let (step, centre) = self.step(&pairings, &local)?;
            local = local.then(&step, centre);
            let shift = Vector3::new(step[3], step[4], step[5]).norm() / self.target.radius;
            if step.fixed_rows::<3>(0).norm().max(shift).max(step[6].abs()) < STILL {
                break;
            }
        }
        let pairings = self.pairings(&local);
        Some(Fitted {
            similarity: self.global(&local),
            spread: local.scale * self.spread(&pairings, &local),
            overlap: self.overlap(&pairings, &local),
        })
    }

    fn local(&self, given: &Similarity) -> Local {
        let Rigid { rotation, translation } = given.pose;
        let shift = given.scale * (rotation * self.source.middle) + translation - self.target.middle;
        Local { scale: given.scale, rotation, shift }
    }

    fn global(&self, local: &Local) -> Similarity {
        let translation =
            self.target.middle + local.shift - local.scale * (local.rotation * self.source.middle);
        Similarity { scale: local.scale, pose: Rigid { rotation: local.rotation, translation } }
    }

    /// Each asked point of either cloud with the nearest of the other.
    fn pairings(&self, local: &Local) -> Vec<Pairing> {
        let (source, target) = (&self.source, &self.target);
        let there = source.asked.par_iter().map(|&i| {
            let moved = local.apply(source.point(i));
            let (j, _) = target.index.nearest(&moved.into());
            Pairing { moved, fixed: target.point(j), normal: target.normals[j].into(), from_source: true }
        });
        let back = target.asked.par_iter().map(|&j| {
            let fixed = target.point(j);
            let (i, _) = source.index.nearest(&local.undo(fixed).into());
            let normal = local.rotation * Vector3::from(source.normals[i]);
            Pairing { moved: local.apply(source.point(i)), fixed, normal, from_source: false }
        });
        there.chain(back).collect()
    }

    /// The spacing of the sparser cloud, in the target's unit.
    fn spacing(&self, local: &Local) -> f64 {
        self.target.spacing.max(local.scale * self.source.spacing)
    }

    /// The normal equations of some pairings, weighted by how near they are (Geman and McClure).
    fn equations<'a>(
        pairings: impl Iterator<Item = &'a Pairing>,
        width: f64,
        centre: Vector3<f64>,
    ) -> (Matrix7, Vector7, f64) {
        let (mut hessian, mut gradient, mut weights) = (Matrix7::zeros(), Vector7::zeros(), 0.0);
        for p in pairings {
            let off = p.moved - p.fixed;
            let weight = (width * width / (width * width + off.norm_squared())).powi(2);
            let arm = p.moved - centre;
            let turn = arm.cross(&p.normal);
            let n = p.normal;
            let row = Vector7::from([turn.x, turn.y, turn.z, n.x, n.y, n.z, n.dot(&arm)]);
            hessian += weight * row * row.transpose();
            gradient += weight * n.dot(&off) * row;
            weights += weight;
        }
        (hessian, gradient, weights)
    }

    fn width(&self, pairings: &[Pairing], local: &Local) -> f64 {
        let mut away: Vec<f64> = pairings.iter().map(|p| (p.moved - p.fixed).norm()).collect();
        let middle = away.len() / 2;
        let median =
            if away.is_empty() { 0.0 } else { *away.select_nth_unstable_by(middle, f64::total_cmp).1 };
        (1.5 * median).max(self.spacing(local))
    }

    /// The next step, and the centre that it turns about.
    fn step(&self, pairings: &[Pairing], local: &Local) -> Option<(Vector7, Vector3<f64>)> {
        let (width, centre) = (self.width(pairings, local), local.shift);
        let (hessian, gradient, _) = Self::equations(pairings.iter(), width, centre);
        let step = solve(hessian, &gradient)?;
        step.iter().all(|v| v.is_finite()).then_some((step, centre))
    }

    /// Relative standard error of the scale.
    fn spread(&self, pairings: &[Pairing], local: &Local) -> f64 {
        let (width, centre) = (self.width(pairings, local), local.shift);
        let (hessian, gradient, weights) = Self::equations(pairings.iter(), width, centre);
        let Some(inverse) = damped(hessian).try_inverse() else { return f64::INFINITY };
        let lever = (1.0 / inverse[(6, 6)] / weights).sqrt();
        if lever.is_nan() || lever < LEAST_LEVER * self.target.radius {
            return f64::INFINITY;
        }
        let octant = |p: &&Pairing| {
            let d = p.fixed - centre;
            usize::from(d.x > 0.0) + 2 * usize::from(d.y > 0.0) + 4 * usize::from(d.z > 0.0)
        };
        let without: Vec<f64> = (0..8)
            .filter_map(|part| {
                let of_part = pairings.iter().filter(|p| octant(p) == part);
                let (h, g, w) = Self::equations(of_part, width, centre);
                let step = (w > 0.0).then(|| solve(hessian - h, &(gradient - g)))??;
                Some(step[6])
            })
            .collect();
        let count = without.len() as f64;
        if count < 2.0 {
            return f64::INFINITY;
        }
        let mean = without.iter().sum::<f64>() / count;
        ((count - 1.0) / count * without.iter().map(|s| (s - mean).powi(2)).sum::<f64>()).sqrt()
    }

    fn overlap(&self, pairings: &[Pairing], local: &Local) -> f64 {
        let limit = 2.0 * self.spacing(local);
        let share = |from_source: bool| {
            let of = || pairings.iter().filter(move |p| p.from_source == from_source);
            let near = of().filter(|p| (p.moved - p.fixed).norm() <= limit).count();
            near as f64 / of().count().max(1) as f64
        };
        (share(true) * share(false)).sqrt()
    }
}

/// A little is added to the diagonal, so that what the clouds leave open stays as it is.
fn damped(mut hessian: Matrix7) -> Matrix7 {
    for i in 0..7 {
        hessian[(i, i)] += 1e-9 * hessian[(i, i)].max(1e-300);
    }
    hessian
}

fn solve(hessian: Matrix7, gradient: &Vector7) -> Option<Vector7> {
    Some(-damped(hessian).cholesky()?.solve(gradient))
}

#[cfg(test)]
mod tests {
    use rand::{SeedableRng, rngs::ChaCha8Rng};
    use srrf_cloud::EulerXyz;
    use srrf_corrupt::{datasets::ShapeSource, shapes::ProceduralShapes};

    use super::*;

    /// Two samples of a shape; the second scaled and moved, and the similarity between them.
    fn pair(scale: f64) -> (PointCloud, PointCloud, Similarity) {
        let shapes = ProceduralShapes::new(7, 3, None).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let (source, other) = shapes.sample_two(1, 6000, &mut rng).unwrap();
        let rotation = EulerXyz::from_deg([20.0, -35.0, 110.0]).to_matrix();
        let pose = Rigid { rotation, translation: Vector3::new(5e5, -3e4, 70.0) };
        let target = other.scaled(scale).unwrap().transformed(&pose);
        (source, target, Similarity { scale, pose })
    }

    #[test]
    fn the_scale_is_found_and_its_spread_holds_it() {
        for scale in [0.001, 1.0, 25.4] {
            let (source, target, truth) = pair(scale);
            let fit = SimilarityFit::new(&source, &target).unwrap();
            let by =
                Rigid { rotation: EulerXyz::from_deg([2.0, -1.0, 2.0]).to_matrix(), ..Rigid::identity() };
            let off = Similarity { scale: 1.08 * scale, pose: truth.pose.compose(&by) };
            let found = fit.fit(&off).unwrap();
            let error = (found.similarity.scale / scale - 1.0).abs();
            assert!(error < 2e-3, "{scale}: off by {error}, spread {}", found.spread / scale);
            assert!(found.spread > 0.0 && found.spread < 5e-3 * scale, "{scale}: {}", found.spread / scale);
            assert!(error < 4.0 * found.spread / scale, "{error} against {}", found.spread / scale);
            assert!(found.similarity.pose.angle_to_deg(&truth.pose) < 0.2);
            assert!(found.overlap > 0.9, "{}", found.overlap);
        }
    }

    #[test]
    fn a_plane_has_no_scale() {
        let grid = (0..2500).map(|i| [f64::from(i % 50), f64::from(i / 50), 0.0]).collect();
        let plane = PointCloud::new(grid).unwrap();
        let fit = SimilarityFit::new(&plane, &plane).unwrap();
        let found = fit.fit(&Similarity { scale: 1.0, pose: Rigid::identity() }).unwrap();
        assert_eq!(found.spread, f64::INFINITY);
    }
}
