//! Meshes are surfaces: what has faces is drawn as densely as the cloud that it is registered with.

use clap::Args;
use serde_json::{Value, json};
use srrf::{Counterpart, SurfaceDraw};
use srrf_args::Failure;
use srrf_args::files::Input;
use srrf_args::words::{count, counted, length};
use srrf_cloud::{MeshError, TriangleMesh};

/// How meshes become clouds.
#[derive(Debug, Clone, Copy, Args)]
pub struct SurfaceArgs {
    /// Take the vertices of meshes as clouds, and do not draw points from their surfaces
    #[arg(long)]
    pub vertices: bool,
}

/// What was made of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawn {
    /// Vertices of the mesh.
    vertices: usize,
    /// Its faces.
    faces: usize,
    /// Faces without an area.
    left_out: usize,
    /// How its cloud came about; none where its vertices were asked for.
    draw: Option<SurfaceDraw>,
}

impl Drawn {
    /// For the terminal and pages.
    pub fn text(&self) -> String {
        let mesh = format!("a mesh of {}", counted(self.faces, "face"));
        let left_out = match self.left_out {
            0 => String::new(),
            n => format!("; {} without an area passed over", counted(n, "face")),
        };
        let how = match self.draw {
            None => format!("its {} vertices are the cloud, as asked", count(self.vertices)),
            Some(SurfaceDraw::Vertices) => {
                format!("its {} vertices lie dense enough and are the cloud", count(self.vertices))
            }
            Some(SurfaceDraw::Surface { points, spacing }) => format!(
                "{} points drawn from its surface, {} apart; --vertices takes its {} vertices",
                count(points),
                length(spacing, 2),
                count(self.vertices)
            ),
        };
        format!("{mesh}: {how}{left_out}")
    }

    /// For the JSON.
    pub fn to_json(self) -> Value {
        let drawn = match self.draw {
            None => json!({ "from": "vertices" }),
            Some(draw) => json!(draw),
        };
        let mut value = json!({ "vertices": self.vertices, "faces": self.faces, "faces_left_out": self.left_out });
        if let (Value::Object(map), Value::Object(drawn)) = (&mut value, drawn) {
            map.extend(drawn);
        }
        value
    }
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
    ) -> Result<[Option<Drawn>; 2], Failure> {
        let meshes = [mesh(source, self.vertices)?, mesh(target, self.vertices)?];
        let drawn = {
            let clouds = [&*source, &*target].map(|input| &input.cloud);
            let other = |i: usize| match (&meshes[1 - i], one_unit) {
                (Some(mesh), _) => Counterpart::Surface(mesh),
                (None, true) => Counterpart::Cloud(clouds[1 - i]),
                (None, false) => Counterpart::CloudOfAnyScale(clouds[1 - i]),
            };
            [0, 1].map(|i| {
                let mesh = meshes[i].as_ref()?;
                Some(SurfaceDraw::for_counterpart(mesh, clouds[i].len(), other(i)))
            })
        };
        let made = |i: usize, input: &mut Input| {
            if input.faces.is_empty() {
                return None;
            }
            let (vertices, faces) = (input.cloud.len(), input.faces.len());
            let left_out = meshes[i].as_ref().map_or(0, TriangleMesh::left_out);
            if let (Some(mesh), Some(SurfaceDraw::Surface { points, .. })) = (&meshes[i], drawn[i]) {
                // Two meshes get draws of their own.
                input.cloud = mesh.sample(points, seed.wrapping_add(i as u64));
            }
            Some(Drawn { vertices, faces, left_out, draw: drawn[i] })
        };
        Ok([made(0, source), made(1, target)])
    }
}

/// The surface of a mesh; none of a cloud, and where the vertices are asked for.
fn mesh(input: &Input, vertices: bool) -> Result<Option<TriangleMesh>, Failure> {
    if vertices || input.faces.is_empty() {
        return Ok(None);
    }
    let made = TriangleMesh::new(input.cloud.points(), &input.faces);
    made.map(Some).map_err(|error: MeshError| {
        let points = count(input.cloud.len());
        let message = format!(
            "{:?}: {error}; mend the mesh, or take its {points} vertices as a cloud with --vertices",
            input.name
        );
        Failure::usage(message).because(error)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_made_of_a_mesh_is_said() {
        let drawn = |draw| Drawn { vertices: 20, faces: 1_236, left_out: 1, draw };
        let surface = drawn(Some(SurfaceDraw::Surface { points: 40_000, spacing: 0.004_2 }));
        assert_eq!(
            surface.text(),
            "a mesh of 1,236 faces: 40,000 points drawn from its surface, 0.0042 apart; --vertices takes its 20 vertices; \
             1 face without an area passed over"
        );
        assert_eq!(surface.to_json()["points"], 40_000);
        assert_eq!(surface.to_json()["from"], "surface");
        let asked = drawn(None);
        assert!(asked.text().contains("its 20 vertices are the cloud, as asked"), "{}", asked.text());
        assert_eq!(asked.to_json()["from"], "vertices");
    }
}
