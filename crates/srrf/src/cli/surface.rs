//! Meshes are surfaces: what has faces is drawn as densely as the cloud that it is registered with.

use clap::Args;
use srrf::{DrawnSurface, MeshedCloud, SurfaceDraw, SurfacePlan, draw_pair};
use srrf_args::Failure;
use srrf_args::files::Input;
use srrf_args::surface::{self, DrawnHow, mesh};
use srrf_cloud::TriangleMesh;

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
        Ok([apply(of_source, source), apply(of_target, target)])
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
        Ok([apply(of_source, source), of_target.drawn])
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
        let meshes = [mesh(source, self.vertices)?, mesh(target, self.vertices)?];
        let pair = [meshed(source, meshes[0].as_ref()), meshed(target, meshes[1].as_ref())];
        Ok(draw_pair(pair, one_unit, seed))
    }
}

fn meshed<'a>(input: &'a Input, mesh: Option<&'a TriangleMesh>) -> MeshedCloud<'a> {
    let faces = input.faces.len() + input.lost_faces;
    MeshedCloud { cloud: &input.cloud, mesh, faces, lost_faces: input.lost_faces }
}

fn apply(plan: SurfacePlan, input: &mut Input) -> Option<DrawnSurface> {
    if let Some(cloud) = plan.cloud {
        input.cloud = cloud;
    }
    plan.drawn
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
