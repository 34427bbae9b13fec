//! Meshes are surfaces: what has faces is drawn as densely as the cloud that it is registered with, as the program does.

use srrf::{DrawnSurface, MeshedCloud, draw_pair};
use srrf_args::surface::points_alone;
use srrf_cloud::{PointCloud, TriangleMesh};

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
        let meshes = [self.mesh(source)?, self.mesh(target)?];
        let pair = [meshed(source, meshes[0].as_ref()), meshed(target, meshes[1].as_ref())];
        let [of_source, of_target] = draw_pair(pair, self.one_unit, self.seed);
        let with = |cloud: &Cloud, points: Option<PointCloud>| {
            points.map_or_else(|| cloud.clone(), |points| cloud.with_points(points))
        };
        Ok(DrawnPair {
            source: with(source, of_source.cloud),
            target: with(target, of_target.cloud),
            surfaces: [of_source.drawn, of_target.drawn],
        })
    }

    fn mesh(self, cloud: &Cloud) -> Result<Option<TriangleMesh>, Refusal> {
        mesh(cloud, self.vertices)
    }
}

/// The surface of a mesh; none of a cloud, and where the vertices are asked for.
fn mesh(cloud: &Cloud, vertices: bool) -> Result<Option<TriangleMesh>, Refusal> {
    if vertices || !cloud.is_mesh() {
        return Ok(None);
    }
    TriangleMesh::new(cloud.points.points(), &cloud.faces).map(Some).map_err(|e| {
        let way_out = format!("mend the mesh, or take its {} vertices by vertices=True", cloud.points.len());
        Refusal::new(Fault::Input, format!("{}: {e}; {way_out}", cloud.name))
    })
}

/// The cloud; of a mesh, points of its surface, drawn as the program draws one that stands alone.
///
/// # Errors
/// [`Fault::Input`] for a mesh whose faces make no surface.
pub fn alone(cloud: &Cloud, vertices: bool, seed: u64) -> Result<Cloud, Refusal> {
    let drawn = mesh(cloud, vertices)?.and_then(|mesh| points_alone(&mesh, cloud.points.len(), seed));
    Ok(drawn.map_or_else(|| cloud.clone(), |points| cloud.with_points(points)))
}

fn meshed<'a>(cloud: &'a Cloud, mesh: Option<&'a TriangleMesh>) -> MeshedCloud<'a> {
    let faces = cloud.faces.len() + cloud.lost_faces;
    MeshedCloud { cloud: &cloud.points, mesh, faces, lost_faces: cloud.lost_faces }
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
