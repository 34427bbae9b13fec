//! [`ScanSurface`]: a scan thinned, indexed and with normals, about its own mean; and how two of them lie on each other.

use nalgebra::{Matrix6, Vector3, Vector6};
use srrf_cloud::{
    CloudError, KnnIndex, PointCloud, Rigid, estimate_normals, point_spacing, spacing_of, thin_to,
};

use crate::evenness::evenness;
use crate::layout::WallLayout;
use crate::overlay::Overlay;
use crate::se3::shift;
use crate::sight::{SightMap, SurfaceSpot};

/// Neighbours of a normal.
const NORMAL_NEIGHBOURS: usize = 12;
/// Matches are within so many spacings of the thinned points.
const NEAR_SPACINGS: f64 = 1.5;
/// Matched normals differ by less than acos(0.7), 46 degrees; either way round where a scanner's place is not known.
const SAME_NORMAL: f64 = 0.7;
/// Neighbouring residuals are alike: so many matches count as one.
pub const ALIKE_MATCHES: f64 = 20.0;
/// What a scanner saw through lies by this share of the radius and so many spacings in front of what it saw.
const SIGHT_RADII: f64 = 0.015;
const SIGHT_SPACINGS: f64 = 0.25;
/// Scanners nearer to each other than this share of the radius stood in one place.
const ONE_STAND: f64 = 0.5;
/// Points of a scan that are asked for its matches.
const ASKED: usize = 1500;
/// A right registration is within this share of the radius and this many spacings of the truth, three standard deviations.
const TOLERANCE_RADII: f64 = 0.015;
const TOLERANCE_SPACINGS: f64 = 1.0;

/// A scan made ready.
#[derive(Debug)]
pub struct ScanSurface {
    /// Mean of the points, input coordinates; all else is about it.
    pub centre: Vector3<f64>,
    /// Root mean square distance of the points from the centre.
    pub radius: f64,
    /// Largest distance of a point from the centre.
    pub reach: f64,
    /// Median distance between neighbours in the whole scan.
    pub spacing: f64,
    index: KnnIndex,
    /// Towards the scanner, where its place is known: the two sides of a wall are two surfaces.
    normals: Vec<Vector3<f64>>,
    /// How far the surface goes on around each point; 0 where it is not even: at an edge, a normal is of neither side. Empty where the
    /// place of the scanner is not known.
    breadth: Vec<f64>,
    /// The same among the thinned points.
    thin_spacing: f64,
    /// How far its scanner saw, where its place is known.
    sight: Option<SightMap>,
    layout: Option<WallLayout>,
}

/// A point of one scan that lies on the surface of another.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceMatch {
    /// The point, in its own frame.
    pub point: Vector3<f64>,
    /// The point moved to the other's frame.
    pub moved: Vector3<f64>,
    /// Unit normal there, the other's frame.
    pub normal: Vector3<f64>,
    /// Distance along the normal.
    pub off: f64,
}

impl ScanSurface {
    /// Thins `cloud` to at most `most` points. `eye` is where its scanner stood, if that is known.
    ///
    /// # Errors
    /// [`CloudError`] for fewer than three points.
    pub fn new(cloud: &PointCloud, most: usize, eye: Option<[f64; 3]>) -> Result<Self, CloudError> {
        let centre = cloud.centroid();
        let centred: Vec<[f64; 3]> =
            cloud.points().iter().map(|p| (Vector3::from(*p) - centre).into()).collect();
        let squared = |p: &[f64; 3]| Vector3::from(*p).norm_squared();
        let radius = (centred.iter().map(squared).sum::<f64>() / centred.len() as f64).sqrt();
        let reach = centred.iter().map(squared).fold(0.0, f64::max).sqrt();
        let spacing = point_spacing(&centred)?;
        let sight = eye.map(|eye| SightMap::new(&centred, Vector3::from(eye) - centre)).transpose()?;
        let thin = thin_to(&PointCloud::new(centred)?, most, radius);
        let mut normals: Vec<Vector3<f64>> =
            estimate_normals(thin.points(), NORMAL_NEIGHBOURS)?.into_iter().map(Vector3::from).collect();
        if let Some(sight) = &sight {
            let away = |(p, n): (&[f64; 3], &Vector3<f64>)| n.dot(&(sight.eye() - Vector3::from(*p))) < 0.0;
            thin.points().iter().zip(&mut normals).filter(|(p, n)| away((p, n))).for_each(|(_, n)| *n = -*n);
        }
        let index = KnnIndex::new(thin.points())?;
        let mut breadth = Vec::new();
        if sight.is_some() {
            let normals: Vec<[f64; 3]> = normals.iter().map(|n| (*n).into()).collect();
            breadth = evenness(&index, &normals).into_iter().map(|e| e.breadth).collect();
        }
        let thin_spacing = spacing_of(&index);
        let layout = None;
        let mut surface =
            Self { centre, radius, reach, spacing, index, normals, breadth, thin_spacing, sight, layout };
        let width = surface.sight_margin(&surface);
        surface.layout =
            surface.sight().map(|sight| WallLayout::new(surface.with_normals(), &sight.eye(), width));
        Ok(surface)
    }

    /// Whether it is known where its scanner stood, and most of what that saw is walls.
    pub fn is_walled(&self) -> bool {
        self.layout.as_ref().is_some_and(WallLayout::is_walled)
    }

    /// Whether both are of walls, and a pose puts the scanners in one place: nearer than half a radius.
    pub fn shares_stand(&self, source: &Self, self_from_source: &Rigid) -> bool {
        let stands = source.sight().zip(self.sight()).filter(|_| self.is_walled() && source.is_walled());
        stands.is_some_and(|(from, to)| {
            let moved = Vector3::from(self_from_source.apply(&from.eye().into()));
            (moved - to.eye()).norm() < ONE_STAND * self.radius.min(source.radius)
        })
    }

    /// Poses in which the walls of both lie on each other, the best first; none for scans that are not of walls.
    pub fn poses_by_walls(&self, source: &Self) -> Option<Vec<Rigid>> {
        if !self.is_walled() || !source.is_walled() {
            return None;
        }
        let ((from, by_source), (to, by_self)) =
            (source.layout().zip(source.sight())?, self.layout().zip(self.sight())?);
        Some(from.poses(to, [by_source, by_self], self.sight_margin(source)))
    }

    /// Its walls, where the place of its scanner is known.
    fn layout(&self) -> Option<&WallLayout> {
        self.layout.as_ref()
    }

    /// Whether a pose leaves what is up in both scans up; true where that is not known.
    pub fn stands(&self, source: &Self, self_from_source: &Rigid) -> bool {
        let both = source.layout().zip(self.layout());
        both.is_none_or(|(from, to)| from.stands(to, self_from_source))
    }

    /// Whether the place of its scanner is known.
    pub fn has_sight(&self) -> bool {
        self.sight.is_some()
    }

    /// The thinned points about the centre.
    pub fn points(&self) -> &[[f64; 3]] {
        self.index.points()
    }

    /// A pose between inputs as one between the centred scans.
    pub fn centred(&self, source: &Self, target_from_source: &Rigid) -> Rigid {
        shift(&-self.centre).compose(target_from_source).compose(&shift(&source.centre))
    }

    /// How far a right registration with another may be off.
    pub fn tolerance(&self, other: &Self) -> f64 {
        TOLERANCE_RADII * self.radius.max(other.radius) + TOLERANCE_SPACINGS * self.spacing.max(other.spacing)
    }

    /// Distance within which points of two scans are matched.
    pub fn near(&self, other: &Self) -> f64 {
        NEAR_SPACINGS * self.thin_spacing.max(other.thin_spacing)
    }

    /// The points of `source`, every n-th, that lie within `near` of this surface; and how many were asked.
    pub fn matches(
        &self,
        source: &Self,
        self_from_source: &Rigid,
        near: f64,
        asked: usize,
    ) -> (Vec<SurfaceMatch>, usize) {
        let step = source.points().len().div_ceil(asked.max(1)).max(1);
        let limit = near * near;
        let sided = self.has_sight() && source.has_sight();
        let mut count = 0;
        let mut found = Vec::new();
        for (p, normal) in source.points().iter().zip(&source.normals).step_by(step) {
            count += 1;
            let moved = self_from_source.apply(p);
            if Vector3::from(moved).norm() > self.reach + near {
                continue;
            }
            let (nearest, squared) = self.index.nearest(&moved);
            let fixed = self.normals[nearest];
            let turned = self_from_source.rotation * normal;
            let same = turned.dot(&fixed);
            if squared <= limit && (if sided { same } else { same.abs() }) > SAME_NORMAL {
                let moved = Vector3::from(moved);
                let off = fixed.dot(&(moved - Vector3::from(self.points()[nearest])));
                found.push(SurfaceMatch { point: Vector3::from(*p), moved, normal: fixed, off });
            }
        }
        (found, count)
    }

    /// For every n-th point of `source` whether it lies on this surface.
    pub fn lies_on(&self, source: &Self, self_from_source: &Rigid, asked: usize) -> Vec<bool> {
        let step = source.points().len().div_ceil(asked.max(1)).max(1);
        let limit = self.near(source).powi(2);
        source
            .points()
            .iter()
            .step_by(step)
            .map(|p| self.index.nearest(&self_from_source.apply(p)).1 <= limit)
            .collect()
    }

    /// The larger of the two shares of points that lie on the other, by few points.
    pub fn overlap(&self, source: &Self, self_from_source: &Rigid, asked: usize) -> f64 {
        if self_from_source.translation.norm() > self.reach + source.reach {
            return 0.0;
        }
        let near = self.near(source);
        let share = |(found, count): (Vec<SurfaceMatch>, usize)| found.len() as f64 / count.max(1) as f64;
        share(self.matches(source, self_from_source, near, asked)).max(share(source.matches(
            self,
            &self_from_source.inverse(),
            near,
            asked,
        )))
    }

    /// How the source lies on this surface in a pose between the centred scans.
    pub fn overlay(&self, source: &Self, self_from_source: &Rigid) -> Overlay {
        let near = self.near(source);
        let (onto, asked) = self.matches(source, self_from_source, near, ASKED);
        let (back, asked_back) = source.matches(self, &self_from_source.inverse(), near, ASKED);
        let (mut hessian, mut squares) = (Matrix6::zeros(), 0.0);
        for m in &onto {
            let j = row(&m.moved, &m.normal);
            hessian += j * j.transpose();
            squares += m.off * m.off;
        }
        for m in &back {
            // The point is the target's own; the normal is turned into its frame.
            let j = row(&m.point, &(self_from_source.rotation * m.normal));
            hessian += j * j.transpose();
            squares += m.off * m.off;
        }
        let count = onto.len() + back.len();
        let rms = if count > 0 { (squares / count as f64).sqrt() } else { 0.0 };
        let sigma = rms.max(0.3 * self.spacing.max(source.spacing)).max(f64::MIN_POSITIVE.sqrt());
        Overlay {
            overlap_source: onto.len() as f64 / asked.max(1) as f64,
            overlap_target: back.len() as f64 / asked_back.max(1) as f64,
            seen_through: self.seen_through(source, self_from_source, usize::MAX),
            rms,
            information: self.with_floor(source, &(hessian / (ALIKE_MATCHES * sigma * sigma))),
        }
    }

    /// How far before what a scanner saw a point lies that it saw through.
    pub fn sight_margin(&self, source: &Self) -> f64 {
        SIGHT_RADII * self.radius.max(source.radius) + SIGHT_SPACINGS * self.spacing.max(source.spacing)
    }

    /// The thinned points with their normals.
    pub fn with_normals(&self) -> impl Iterator<Item = (&[f64; 3], &Vector3<f64>)> {
        self.points().iter().zip(&self.normals)
    }

    fn even_points(&self) -> impl Iterator<Item = SurfaceSpot<'_>> {
        let with = |((point, normal), &breadth)| SurfaceSpot { point, normal, breadth };
        self.with_normals().zip(&self.breadth).filter(|(_, breadth)| **breadth > 0.0).map(with)
    }

    /// The share of the points of one that the scanner of the other saw through, the larger of both. `most` points are asked each way.
    pub fn seen_through(&self, source: &Self, self_from_source: &Rigid, most: usize) -> Option<f64> {
        let margin = self.sight_margin(source);
        let share = |of: &Self, by: &Self, motion: &Rigid| {
            let step = of.points().len().div_ceil(most.max(1)).max(1);
            by.sight.as_ref().and_then(|s| s.seen_through(of.even_points().step_by(step), motion, margin))
        };
        let (own, other) =
            (share(source, self, self_from_source), share(self, source, &self_from_source.inverse()));
        match (own, other) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (one, other) => one.or(other),
        }
    }

    /// How far its scanner saw, where its place is known.
    pub fn sight(&self) -> Option<&SightMap> {
        self.sight.as_ref()
    }

    /// The information of a registration: no better than the tolerance, and no worse than the size of the scans.
    fn with_floor(&self, source: &Self, measured: &Matrix6<f64>) -> Matrix6<f64> {
        let radius = self.radius.max(source.radius).max(f64::MIN_POSITIVE.sqrt());
        let sigma = self.tolerance(source).max(1e-9 * radius) / 3.0;
        let diagonal = |turn: f64, along: f64| {
            Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, along, along, along))
        };
        // A motion that nothing determines has a standard deviation of a radius.
        let weakest = diagonal(1.0, radius.powi(-2));
        let floor = diagonal((sigma / radius).powi(2), sigma * sigma);
        let covariance =
            (measured + weakest).try_inverse().unwrap_or_else(|| diagonal(1.0, radius * radius)) + floor;
        covariance.try_inverse().unwrap_or(weakest)
    }
}

/// How far a point moves along a normal with a twist.
pub fn row(point: &Vector3<f64>, normal: &Vector3<f64>) -> Vector6<f64> {
    let moment = point.cross(normal);
    Vector6::new(moment.x, moment.y, moment.z, normal.x, normal.y, normal.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::se3::exp;

    /// A corner of three walls: `n` by `n` points a wall.
    fn corner(n: usize, walls: usize) -> PointCloud {
        let grid = |i: usize, j: usize| (i as f64 / n as f64 + 0.013, j as f64 / n as f64 + 0.007);
        let points = (0..walls).flat_map(|wall| {
            (0..n * n).map(move |k| {
                let (u, v) = grid(k / n, k % n);
                [[u, v, 0.0], [u, 0.0, v], [0.0, u, v]][wall]
            })
        });
        PointCloud::new(points.map(|p| p.map(|c| c + 100.0)).collect()).unwrap()
    }

    #[test]
    fn a_scan_lies_on_itself_and_the_corner_holds_it() {
        let surface = ScanSurface::new(&corner(40, 3), 2000, None).unwrap();
        let whole = surface.overlay(&surface, &Rigid::identity());
        assert!(whole.overlap_source > 0.97 && whole.overlap_target > 0.97 && whole.rms < 1e-3, "{whole:?}");
        let spread = whole.information.try_inverse().unwrap();
        let sigma = surface.tolerance(&surface) / 3.0;
        assert!(spread[(3, 3)].sqrt() < 2.0 * sigma && spread[(3, 3)].sqrt() >= sigma, "{spread}");
        let away = exp(&Vector6::new(0.0, 0.0, 0.0, 5.0, 0.0, 0.0));
        assert_eq!(surface.overlap(&surface, &away, 200), 0.0);
    }

    #[test]
    fn the_two_sides_of_a_wall_are_two_surfaces_where_the_scanners_are_known() {
        let seen_from = |height: Option<f64>| {
            let eye = height.map(|h| [100.5, 100.5, 100.0 + h]);
            ScanSurface::new(&corner(40, 1), 2000, eye).unwrap()
        };
        let overlap =
            |a: Option<f64>, b: Option<f64>| seen_from(a).overlap(&seen_from(b), &Rigid::identity(), 400);
        assert_eq!(overlap(Some(1.0), Some(-1.0)), 0.0);
        assert!(overlap(Some(1.0), Some(0.7)) > 0.95);
        assert!(overlap(Some(1.0), None) > 0.95);
    }

    #[test]
    fn a_plane_slides_and_its_information_says_so() {
        let surface = ScanSurface::new(&corner(40, 1), 2000, None).unwrap();
        let spread = surface.overlay(&surface, &Rigid::identity()).information.try_inverse().unwrap();
        let deviations: Vec<f64> = (0..6).map(|i| spread[(i, i)].sqrt()).collect();
        // Turns about x and y and the shift along z are held; the others are free.
        let radius = surface.radius;
        assert!(deviations[3] > 0.9 * radius && deviations[4] > 0.9 * radius, "{deviations:?}");
        assert!(
            deviations[5] < 0.05 * radius && deviations[0] < 0.05 && deviations[2] > 0.9,
            "{deviations:?}"
        );
    }

    #[test]
    fn poses_between_inputs_and_centred_scans() {
        let cloud = corner(12, 3);
        let motion = exp(&Vector6::new(0.3, -0.2, 0.5, 7.0, 1.0, -2.0));
        let moved = PointCloud::new(cloud.points().iter().map(|p| motion.apply(p)).collect()).unwrap();
        let (source, target) =
            (ScanSurface::new(&cloud, 500, None).unwrap(), ScanSurface::new(&moved, 500, None).unwrap());
        let centred = target.centred(&source, &motion);
        assert!(centred.translation.norm() < 1e-9, "means lie on each other: {centred:?}");
    }
}
