//! Meshes are surfaces: what has faces is drawn as densely as the cloud that it is registered with.

use clap::Args;
use srrf::{Counterpart, DrawnSurface, SurfaceDraw};
use srrf_args::Failure;
use srrf_args::files::Input;
use srrf_args::surface::{self, DrawnHow, mesh};
use srrf_cloud::{PointCloud, TriangleMesh};

/// How meshes become clouds.
#[derive(Debug, Clone, Copy, Args)]
pub struct SurfaceArgs {
    /// Take the vertices of meshes as clouds, and do not draw points from their surfaces
    #[arg(long)]
    pub vertices: bool,
}

/// What was made of a mesh, in words.
pub fn text(drawn: &DrawnSurface) -> String {
    let how = match drawn.draw {
        None => DrawnHow::Asked,
        Some(SurfaceDraw::Vertices) => DrawnHow::Dense,
        Some(SurfaceDraw::Surface { points, spacing }) => DrawnHow::Points(points, spacing),
    };
    surface::text(drawn.vertices, drawn.faces, drawn.faces_left_out, how)
}

impl SurfaceArgs {
    /// Replaces the clouds of meshes by points of their surfaces, as dense as the other cloud. Answers what was made of source and
    /// target, where they are meshes. `one_unit` says whether both are known to be in one unit of length.
    ///
    /// # Errors
    /// [`Failure::usage`] for a mesh whose faces make no surface.
    pub fn draw(
        self,
        source: &mut Input,
        target: &mut Input,
        one_unit: bool,
        seed: u64,
    ) -> Result<[Option<DrawnSurface>; 2], Failure> {
        let [of_source, of_target] = self.plan(source, target, one_unit, seed)?;
        Ok([of_source.apply(source), of_target.apply(target)])
    }

    /// As [`draw`](Self::draw), with a target that is no mesh.
    ///
    /// # Errors
    /// As [`draw`](Self::draw).
    pub fn draw_source(
        self,
        source: &mut Input,
        target: &Input,
        one_unit: bool,
        seed: u64,
    ) -> Result<[Option<DrawnSurface>; 2], Failure> {
        let [of_source, of_target] = self.plan(source, target, one_unit, seed)?;
        Ok([of_source.apply(source), of_target.drawn])
    }

    /// Whether points are drawn from a cloud's surface, or may be.
    pub fn draws(self, input: &Input) -> bool {
        !self.vertices && input.faces.len() + input.lost_faces > 0
    }

    fn plan(
        self,
        source: &Input,
        target: &Input,
        one_unit: bool,
        seed: u64,
    ) -> Result<[SurfacePlan; 2], Failure> {
        let inputs = [source, target];
        let meshes = [mesh(source, self.vertices)?, mesh(target, self.vertices)?];
        let other = |i: usize| match (&meshes[1 - i], one_unit) {
            (Some(mesh), _) => Counterpart::Surface(mesh),
            (None, true) => Counterpart::Cloud(&inputs[1 - i].cloud),
            (None, false) => Counterpart::CloudOfAnyScale(&inputs[1 - i].cloud),
        };
        Ok([0, 1].map(|i| {
            let faces = inputs[i].faces.len() + inputs[i].lost_faces;
            if faces == 0 {
                return SurfacePlan::default();
            }
            let (vertices, mesh) = (inputs[i].cloud.len(), meshes[i].as_ref());
            let draw = mesh.map(|mesh| SurfaceDraw::for_counterpart(mesh, vertices, other(i)));
            let cloud = match (mesh, draw) {
                // Two meshes get draws of their own.
                (Some(mesh), Some(SurfaceDraw::Surface { points, .. })) => {
                    Some(mesh.sample(points, seed.wrapping_add(i as u64)))
                }
                _ => None,
            };
            let faces_left_out = mesh.map_or(0, TriangleMesh::left_out) + inputs[i].lost_faces;
            SurfacePlan { drawn: Some(DrawnSurface { vertices, faces, faces_left_out, draw }), cloud }
        }))
    }
}

/// What becomes of an input.
#[derive(Debug, Default)]
struct SurfacePlan {
    drawn: Option<DrawnSurface>,
    /// Where it is not its vertices.
    cloud: Option<PointCloud>,
}

impl SurfacePlan {
    fn apply(self, input: &mut Input) -> Option<DrawnSurface> {
        if let Some(cloud) = self.cloud {
            input.cloud = cloud;
        }
        self.drawn
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_made_of_a_mesh_is_said() {
        let drawn = |draw| DrawnSurface { vertices: 20, faces: 1_236, faces_left_out: 1, draw };
        let surface = drawn(Some(SurfaceDraw::Surface { points: 40_000, spacing: 0.004_2 }));
        assert_eq!(
            text(&surface),
            "a mesh of 1,236 faces: 40,000 points drawn from its surface, 0.0042 apart; --vertices takes its 20 vertices; \
             1 face without an area passed over"
        );
        assert!(text(&drawn(None)).contains("its 20 vertices are the cloud, as asked"));
    }
}
