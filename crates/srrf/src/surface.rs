//! [`SurfaceDraw`]: how densely a surface is drawn for the cloud that it is registered with.

use schemars::JsonSchema;
use serde::Serialize;
use srrf_cloud::{FEWEST_SCANNED, LEAST_SAMPLES, MOST_SAMPLES, PointCloud, TriangleMesh};

use crate::scale::CloudSize;

/// What a surface is registered with.
#[derive(Debug, Clone, Copy)]
pub enum Counterpart<'a> {
    /// A cloud in the same unit.
    Cloud(&'a PointCloud),
    /// A cloud in a unit that is not known yet.
    CloudOfAnyScale(&'a PointCloud),
    /// Another surface in the same unit.
    Surface(&'a TriangleMesh),
}

/// How the cloud of a surface comes about.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SurfaceDraw {
    /// So many points are drawn, by area.
    Surface {
        /// How many.
        points: usize,
        /// Their spacing, unit of the mesh.
        spacing: f64,
    },
    /// The vertices are dense enough already, as those of a scanned surface are.
    Vertices,
}

/// What was made of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct DrawnSurface {
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Its faces.
    pub faces: usize,
    /// Faces without an area, or with a corner that is NaN or infinite.
    pub faces_left_out: usize,
    /// How its cloud came about; none where the vertices were asked for.
    pub draw: Option<SurfaceDraw>,
}

/// A cloud that is registered, and may be the vertices of a mesh.
#[derive(Debug, Clone, Copy)]
pub struct MeshedCloud<'a> {
    /// Points of the file.
    pub cloud: &'a PointCloud,
    /// Its surface; none of a cloud, and where the vertices are asked for.
    pub mesh: Option<&'a TriangleMesh>,
    /// Faces of the file, 0 of a cloud.
    pub faces: usize,
    /// How many of them have a corner that is NaN or infinite, and are not in the surface.
    pub lost_faces: usize,
}

/// What becomes of a [`MeshedCloud`].
#[derive(Debug, Default)]
pub struct SurfacePlan {
    /// What was made of the mesh; none of a cloud.
    pub drawn: Option<DrawnSurface>,
    /// The points drawn, where they are to replace the cloud.
    pub cloud: Option<PointCloud>,
}

/// Draws the surfaces of source and target, each as densely as the other one is. `one_unit` says whether both are known to be in one
/// unit of length. Two meshes get draws of their own, by `seed`.
pub fn draw_pair(pair: [MeshedCloud<'_>; 2], one_unit: bool, seed: u64) -> [SurfacePlan; 2] {
    [0, 1].map(|i| {
        let MeshedCloud { cloud, mesh, faces, lost_faces } = pair[i];
        if faces == 0 {
            return SurfacePlan::default();
        }
        let other = pair[1 - i];
        let counterpart = match (other.mesh, one_unit) {
            (Some(mesh), _) => Counterpart::Surface(mesh),
            (None, true) => Counterpart::Cloud(other.cloud),
            (None, false) => Counterpart::CloudOfAnyScale(other.cloud),
        };
        let draw = mesh.map(|mesh| SurfaceDraw::for_counterpart(mesh, cloud.len(), counterpart));
        let points = match (mesh, draw) {
            (Some(mesh), Some(SurfaceDraw::Surface { points, .. })) => {
                Some(mesh.sample(points, seed.wrapping_add(i as u64)))
            }
            _ => None,
        };
        let faces_left_out = mesh.map_or(0, TriangleMesh::left_out) + lost_faces;
        let drawn = DrawnSurface { vertices: cloud.len(), faces, faces_left_out, draw };
        SurfacePlan { drawn: Some(drawn), cloud: points }
    })
}

impl SurfaceDraw {
    /// For a mesh of `vertices` vertices: as dense as what it is registered with, with [`LEAST_SAMPLES`] to [`MOST_SAMPLES`] points.
    pub fn for_counterpart(mesh: &TriangleMesh, vertices: usize, other: Counterpart<'_>) -> Self {
        let wanted = match other {
            Counterpart::Cloud(cloud) => CloudSize::of(cloud).spacing,
            Counterpart::CloudOfAnyScale(cloud) => {
                mesh.spacing_of(cloud.len().clamp(LEAST_SAMPLES, MOST_SAMPLES))
            }
            Counterpart::Surface(other) => mesh.vertex_spacing().min(other.vertex_spacing()),
        };
        if vertices >= FEWEST_SCANNED && mesh.is_as_fine_as(wanted) {
            return Self::Vertices;
        }
        let points = mesh.samples_for(wanted);
        Self::Surface { points, spacing: mesh.spacing_of(points) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of side 1 as a grid of `n` x `n` cells.
    fn square(n: u32) -> (Vec<[f64; 3]>, TriangleMesh) {
        let side = n + 1;
        let step = 1.0 / f64::from(n);
        let vertices: Vec<[f64; 3]> =
            (0..side * side).map(|i| [step * f64::from(i % side), step * f64::from(i / side), 0.0]).collect();
        let cells = (0..n * n).map(|i| i % n + side * (i / n));
        let faces: Vec<[u32; 3]> =
            cells.flat_map(|i| [[i, i + 1, i + side], [i + 1, i + side + 1, i + side]]).collect();
        let mesh = TriangleMesh::new(&vertices, &faces).unwrap();
        (vertices, mesh)
    }

    #[test]
    fn a_part_is_as_dense_as_the_scan_and_a_scanned_mesh_stays_as_it_is() {
        let (corners, part) = square(1);
        // A scan with 0.0025 between points, far from the origin.
        let scan = PointCloud::new(
            (0..160_000)
                .map(|i| [5e5 + 0.0025 * f64::from(i % 400), 0.0025 * f64::from(i / 400), 9.0])
                .collect(),
        )
        .unwrap();
        let drawn = SurfaceDraw::for_counterpart(&part, corners.len(), Counterpart::Cloud(&scan));
        let SurfaceDraw::Surface { points, spacing } = drawn else { panic!("{drawn:?}") };
        assert!((spacing - 0.0025).abs() < 1e-5 && points == 35_302, "{drawn:?}");

        let (vertices, scanned) = square(100);
        let of = |other| SurfaceDraw::for_counterpart(&scanned, vertices.len(), other);
        let coarse = PointCloud::new(
            (0..900).map(|i| [0.03 * f64::from(i % 30), 0.03 * f64::from(i / 30), 0.0]).collect(),
        )
        .unwrap();
        assert_eq!(of(Counterpart::Cloud(&coarse)), SurfaceDraw::Vertices);
        assert!(matches!(of(Counterpart::Cloud(&scan)), SurfaceDraw::Surface { points: 35_302, .. }));
        // Of another unit: nothing is known but the number of points.
        let any = SurfaceDraw::for_counterpart(&part, 4, Counterpart::CloudOfAnyScale(&scan));
        assert!(matches!(any, SurfaceDraw::Surface { points: 160_000, .. }), "{any:?}");
        let both = SurfaceDraw::for_counterpart(&part, 4, Counterpart::Surface(&part));
        assert!(matches!(both, SurfaceDraw::Surface { points: LEAST_SAMPLES, .. }), "{both:?}");
    }
}
