//! [`TriangleMesh`]: a surface, and clouds drawn from it.

use nalgebra::Vector3;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use crate::{PointCloud, Triangles};

/// Points drawn from a surface at least, however coarse the other cloud is.
pub const LEAST_SAMPLES: usize = 20_000;
/// Points drawn from a surface at most, however fine the other cloud is.
pub const MOST_SAMPLES: usize = 300_000;

/// A mesh of fewer vertices than this is drawn by hand or by a program, not scanned: its vertices are no cloud.
pub const FEWEST_SCANNED: usize = 2_000;

/// Median distance to the nearest other of points strewn at random over a surface, where each has a unit of area: in the plane
/// the distance r has the distribution 1 - exp(-pi r^2), whose median is sqrt(ln 2 / pi).
const SPACING_OF_UNIT_DENSITY: f64 = 0.469_718_639_319_144_4;

/// Vertices are as good as drawn points where so much of the area is in triangles whose edges are no longer than twice the spacing
/// that is wanted.
const FINE_SHARE: f64 = 0.95;

/// Why faces make no surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// A face names a vertex that does not exist.
    #[error("face {face} names vertex {vertex}, but there are {vertices} (counted from 0)")]
    OutOfRange {
        /// Index of the first such face.
        face: usize,
        /// The vertex that it names.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// No face has an area.
    #[error(
        "none of its {faces} faces has an area: their corners coincide, lie on a line, or are NaN or infinite"
    )]
    NoArea {
        /// Number of faces.
        faces: usize,
    },
}

/// A surface of triangles, from which clouds are drawn.
///
/// ```
/// use srrf_cloud::TriangleMesh;
///
/// let corners = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// let mesh = TriangleMesh::new(&corners, &[[0, 1, 2], [0, 2, 3]])?;
/// assert_eq!(mesh.area(), 2.0);
/// // As dense as a scan whose points are 0.004 apart:
/// let cloud = mesh.sample(mesh.samples_for(0.004), 7);
/// assert_eq!(cloud.len(), 27_580);
/// # Ok::<(), srrf_cloud::MeshError>(())
/// ```
#[derive(Debug, Clone)]
pub struct TriangleMesh {
    triangles: Triangles,
    faces: usize,
    /// Vertices that are a corner of a face.
    corners: usize,
    /// Finite vertices that are a corner of none.
    loose: Vec<[f64; 3]>,
}

impl TriangleMesh {
    /// The surface of `faces`, each three indices of `vertices`. Faces without an area, or with a corner that is not finite, are
    /// left out.
    ///
    /// # Errors
    /// [`MeshError`] for a face with a vertex that is not there, and where no face has an area.
    pub fn new(vertices: &[[f64; 3]], faces: &[[u32; 3]]) -> Result<Self, MeshError> {
        let mut triangles = Triangles::default();
        let mut used = vec![false; vertices.len()];
        for (face, corners) in faces.iter().enumerate() {
            let mut at = [Vector3::zeros(); 3];
            for (point, &vertex) in at.iter_mut().zip(corners) {
                let missing = MeshError::OutOfRange { face, vertex, vertices: vertices.len() };
                let index = usize::try_from(vertex).map_err(|_| missing)?;
                *point = Vector3::from(*vertices.get(index).ok_or(missing)?);
                used[index] = true;
            }
            triangles.push(at[0], at[1], at[2]);
        }
        if triangles.corners().is_empty() || !triangles.area().is_finite() {
            return Err(MeshError::NoArea { faces: faces.len() });
        }
        let unused = vertices.iter().zip(&used).filter(|(_, used)| !**used);
        let loose = unused.map(|(p, _)| *p).filter(|p| p.iter().all(|c| c.is_finite())).collect();
        let corners = used.iter().filter(|used| **used).count();
        Ok(Self { triangles, faces: faces.len(), corners, loose })
    }

    /// Number of faces, also those without an area.
    pub fn faces(&self) -> usize {
        self.faces
    }

    /// Number of faces that were left out.
    pub fn left_out(&self) -> usize {
        self.faces - self.triangles.corners().len()
    }

    /// Number of vertices that belong to no face. They are part of every cloud that is drawn, as they are.
    pub fn loose(&self) -> usize {
        self.loose.len()
    }

    /// Its area, in the unit of the vertices squared.
    pub fn area(&self) -> f64 {
        self.triangles.area()
    }

    /// The spacing that its vertices would have if they were strewn evenly over it.
    pub fn vertex_spacing(&self) -> f64 {
        self.spacing_of(self.corners.max(1))
    }

    /// The spacing of `count` points drawn from it.
    pub fn spacing_of(&self, count: usize) -> f64 {
        SPACING_OF_UNIT_DENSITY * (self.area() / count as f64).sqrt()
    }

    /// How many points are to be drawn so that they lie as close as those of a cloud of this spacing
    /// ([`crate::point_spacing`]): from [`LEAST_SAMPLES`] to [`MOST_SAMPLES`].
    pub fn samples_for(&self, spacing: f64) -> usize {
        let density = (SPACING_OF_UNIT_DENSITY / spacing).powi(2);
        // A cast saturates; a spacing of 0 or NaN asks for as much as there is.
        let wanted = self.area() * density;
        let wanted = if wanted.is_nan() { MOST_SAMPLES } else { wanted.ceil() as usize };
        wanted.clamp(LEAST_SAMPLES, MOST_SAMPLES)
    }

    /// Whether the vertices themselves are a good cloud of this spacing, as those of scanned surfaces are: nearly all of the
    /// area is in triangles whose edges are no longer than two spacings.
    pub fn is_as_fine_as(&self, spacing: f64) -> bool {
        let fine = |corners: &&[Vector3<f64>; 3]| {
            let [a, b, c] = corners;
            [b - a, c - b, a - c].iter().all(|edge| edge.norm() <= 2.0 * spacing)
        };
        let area = |[a, b, c]: &[Vector3<f64>; 3]| 0.5 * (b - a).cross(&(c - a)).norm();
        let covered: f64 = self.triangles.corners().iter().filter(fine).map(area).sum();
        covered >= FINE_SHARE * self.area()
    }

    /// Draws `count` points (at least 1), uniform by area: one in each of `count` parts of equal area, so that none is missed by
    /// chance. The same seed draws the same points. Loose vertices follow them.
    pub fn sample(&self, count: usize, seed: u64) -> PointCloud {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let count = count.max(1);
        let draw = |i| {
            let at = (i as f64 + rng.random::<f64>()) / count as f64;
            self.triangles.sample_at(at, &mut rng).into()
        };
        let mut points: Vec<[f64; 3]> = (0..count).map(draw).collect();
        points.extend(&self.loose);
        // Sums of finite corners by shares of 1 are finite.
        PointCloud::from_finite(points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::point_spacing;

    /// A box of 2 x 1 x 3 with its corner at `at`: 12 triangles, area 22.
    fn boxed(at: [f64; 3]) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
        let corners = (0..8u32)
            .map(|i| {
                let side = |bit: u32, length: f64| if i >> bit & 1 == 1 { length } else { 0.0 };
                [at[0] + side(0, 2.0), at[1] + side(1, 1.0), at[2] + side(2, 3.0)]
            })
            .collect();
        let quads = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        let faces = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        (corners, faces)
    }

    #[test]
    fn each_side_gets_its_share_of_the_points_wherever_the_surface_is() {
        let (vertices, faces) = boxed([5e5, -4e6, 100.0]);
        let mesh = TriangleMesh::new(&vertices, &faces).unwrap();
        assert!((mesh.area() - 22.0).abs() < 1e-6, "{}", mesh.area());
        let cloud = mesh.sample(22_000, 3);
        assert_eq!(cloud, mesh.sample(22_000, 3), "seeded");
        assert_ne!(cloud, mesh.sample(22_000, 4));
        let on = |axis: usize, value: f64| {
            cloud.points().iter().filter(|p| (p[axis] - value).abs() < 1e-6).count()
        };
        for (axis, low, high, area) in
            [(0, 5e5, 5e5 + 2.0, 3), (1, -4e6, -4e6 + 1.0, 6), (2, 100.0, 103.0, 2)]
        {
            for side in [low, high] {
                let have = on(axis, side);
                assert!(have.abs_diff(1000 * area) <= 2, "{axis}: {have}");
            }
        }
    }

    #[test]
    fn samples_are_as_dense_as_they_were_asked_to_be() {
        let (vertices, faces) = boxed([0.0; 3]);
        let mesh = TriangleMesh::new(&vertices, &faces).unwrap();
        for spacing in [0.012, 0.006] {
            let count = mesh.samples_for(spacing);
            let have = point_spacing(mesh.sample(count, 1).points()).unwrap();
            assert!((have / spacing - 1.0).abs() < 0.06, "{count}: {have} for {spacing}");
            assert!((mesh.spacing_of(count) / spacing - 1.0).abs() < 1e-3);
        }
        assert_eq!(mesh.samples_for(5.0), LEAST_SAMPLES);
        for none in [0.0, 1e-9, f64::NAN] {
            assert_eq!(mesh.samples_for(none), MOST_SAMPLES);
        }
    }

    #[test]
    fn what_is_no_surface_is_said() {
        let (mut vertices, mut faces) = boxed([0.0; 3]);
        let error =
            |vertices: &[[f64; 3]], faces: &[[u32; 3]]| TriangleMesh::new(vertices, faces).unwrap_err();
        assert_eq!(
            error(&vertices, &[[0, 1, 2], [0, 1, 8]]),
            MeshError::OutOfRange { face: 1, vertex: 8, vertices: 8 }
        );
        assert_eq!(error(&vertices, &[[0, 0, 1], [3, 3, 3]]), MeshError::NoArea { faces: 2 });
        assert_eq!(error(&[[f64::NAN; 3]; 3], &[[0, 1, 2]]), MeshError::NoArea { faces: 1 });
        let message = error(&vertices, &[[0, 0, 1]]).to_string();
        assert!(message.starts_with("none of its 1 faces has an area"), "{message}");
        // Some damage costs the faces that it touches.
        vertices.push([f64::INFINITY; 3]);
        vertices.push([9.0; 3]);
        faces.extend([[0, 1, 8], [2, 2, 5]]);
        let mesh = TriangleMesh::new(&vertices, &faces).unwrap();
        assert_eq!((mesh.faces(), mesh.left_out(), mesh.loose()), (14, 2, 1));
        let cloud = mesh.sample(100, 0);
        assert_eq!((cloud.len(), cloud.points()[100]), (101, [9.0; 3]));
    }

    #[test]
    fn scanned_surfaces_are_fine_and_drawn_ones_are_not() {
        let (vertices, faces) = boxed([0.0; 3]);
        let mesh = TriangleMesh::new(&vertices, &faces).unwrap();
        assert!(!mesh.is_as_fine_as(0.1) && mesh.is_as_fine_as(1.9));
        // A grid of 31 x 41 vertices.
        let grid: Vec<[f64; 3]> = (0..31 * 41).map(|i| [f64::from(i % 31), f64::from(i / 31), 0.0]).collect();
        let cells = (0..30 * 40u32).map(|i| i % 30 + 31 * (i / 30));
        let faces: Vec<[u32; 3]> =
            cells.flat_map(|i| [[i, i + 1, i + 31], [i + 1, i + 32, i + 31]]).collect();
        let scanned = TriangleMesh::new(&grid, &faces).unwrap();
        assert!(scanned.is_as_fine_as(1.0) && !scanned.is_as_fine_as(0.5));
        assert!((scanned.vertex_spacing() - 0.4564).abs() < 1e-4, "{}", scanned.vertex_spacing());
    }
}
