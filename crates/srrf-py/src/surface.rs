//! Meshes are surfaces: what has faces is drawn as densely as the cloud that it is registered with, as the program does.

use srrf::{Counterpart, DrawnSurface, SurfaceDraw};
use srrf_cloud::TriangleMesh;

use crate::cloud::Cloud;
use crate::refusal::{Fault, Refusal};

/// What is to be registered, and what was made of meshes.
pub struct DrawnPair {
    pub source: Cloud,
    pub target: Cloud,
    pub surfaces: [Option<DrawnSurface>; 2],
}

/// How the clouds of meshes come about.
#[derive(Debug, Clone, Copy)]
pub struct Drawing {
    /// Whether the vertices are the clouds.
    pub vertices: bool,
    /// Whether both clouds are in one unit of length.
    pub one_unit: bool,
    pub seed: u64,
}

impl Drawing {
    /// Replaces meshes by points of their surfaces.
    ///
    /// # Errors
    /// [`Fault::Input`] for a mesh whose faces make no surface.
    pub fn apply(self, source: &Cloud, target: &Cloud) -> Result<DrawnPair, Refusal> {
        let clouds = [source, target];
        let meshes = [self.mesh(source)?, self.mesh(target)?];
        let draw = |i: usize| {
            if !clouds[i].is_mesh() {
                return (clouds[i].clone(), None);
            }
            let other = match (&meshes[1 - i], self.one_unit) {
                (Some(mesh), _) => Counterpart::Surface(mesh),
                (None, true) => Counterpart::Cloud(&clouds[1 - i].points),
                (None, false) => Counterpart::CloudOfAnyScale(&clouds[1 - i].points),
            };
            let (vertices, mesh) = (clouds[i].points.len(), meshes[i].as_ref());
            let draw = mesh.map(|mesh| SurfaceDraw::for_counterpart(mesh, vertices, other));
            let cloud = match (mesh, draw) {
                // Two meshes get draws of their own.
                (Some(mesh), Some(SurfaceDraw::Surface { points, .. })) => {
                    clouds[i].with_points(mesh.sample(points, self.seed.wrapping_add(i as u64)))
                }
                _ => clouds[i].clone(),
            };
            let faces_left_out = mesh.map_or(0, TriangleMesh::left_out) + clouds[i].lost_faces;
            let faces = clouds[i].faces.len() + clouds[i].lost_faces;
            (cloud, Some(DrawnSurface { vertices, faces, faces_left_out, draw }))
        };
        let [(source, of_source), (target, of_target)] = [draw(0), draw(1)];
        Ok(DrawnPair { source, target, surfaces: [of_source, of_target] })
    }

    /// The surface of a mesh; none of a cloud, and where the vertices are asked for.
    fn mesh(self, cloud: &Cloud) -> Result<Option<TriangleMesh>, Refusal> {
        if self.vertices || !cloud.is_mesh() {
            return Ok(None);
        }
        TriangleMesh::new(cloud.points.points(), &cloud.faces).map(Some).map_err(|e| {
            let way_out =
                format!("mend the mesh, or take its {} vertices by vertices=True", cloud.points.len());
            Refusal::new(Fault::Input, format!("{}: {e}; {way_out}", cloud.name))
        })
    }
}

/// Refuses a mesh where nothing says how densely it is to be drawn.
///
/// # Errors
/// [`Fault::Input`], with the ways out.
pub fn refuse_mesh(cloud: &Cloud, vertices: bool, why: &str) -> Result<(), Refusal> {
    if vertices || !cloud.is_mesh() {
        return Ok(());
    }
    let message = format!(
        "{}: a mesh of {} faces, and {why}; pass points of its surface, srrf.read(path, vertices=False), or take its vertices \
         by vertices=True",
        cloud.name,
        cloud.faces.len()
    );
    Err(Refusal::new(Fault::Input, message))
}
