//! Meshes are surfaces: what has faces is drawn as a cloud.

use clap::Args;
use srrf_cloud::{FEWEST_SCANNED, MeshError, PointCloud, TriangleMesh};

use crate::failure::Failure;
use crate::files::Input;
use crate::words::{count, counted, length};

/// How meshes become clouds.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct SurfaceFlag {
    /// Take the vertices of meshes as clouds, and do not draw points from their surfaces
    #[arg(long)]
    pub vertices: bool,
}

/// How the cloud of a mesh came about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DrawnHow {
    /// The vertices, as asked.
    Asked,
    /// The vertices, which lie dense enough.
    Dense,
    /// So many points of the surface, so far apart.
    Points(usize, f64),
}

/// What was made of a mesh that stands alone.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnAlone {
    /// Vertices of the mesh that are finite, as they are.
    pub vertices: Vec<[f64; 3]>,
    /// Its faces.
    pub faces: usize,
    /// Faces without an area, or with a corner that is NaN or infinite.
    pub left_out: usize,
    /// How its cloud came about.
    pub how: DrawnHow,
}

impl DrawnAlone {
    /// In words.
    pub fn text(&self) -> String {
        text(self.vertices.len(), self.faces, self.left_out, self.how)
    }
}

/// What was made of a mesh of so many vertices and faces, in words.
pub fn text(vertices: usize, faces: usize, left_out: usize, how: DrawnHow) -> String {
    let vertices = count(vertices);
    let left_out = match left_out {
        0 => String::new(),
        n => format!("; {} without an area passed over", counted(n, "face")),
    };
    let how = match how {
        DrawnHow::Asked => format!("its {vertices} vertices are the cloud, as asked"),
        DrawnHow::Dense => format!("its {vertices} vertices lie dense enough and are the cloud"),
        DrawnHow::Points(points, spacing) => format!(
            "{} points drawn from its surface, {} apart; --vertices takes its {vertices} vertices",
            count(points),
            length(spacing, 2),
        ),
    };
    format!("a mesh of {}: {how}{left_out}", counted(faces, "face"))
}

/// The surface of a mesh; none of a cloud, and where the vertices are asked for.
///
/// # Errors
/// [`Failure::usage`] for a mesh whose faces make no surface.
pub fn mesh(input: &Input, vertices: bool) -> Result<Option<TriangleMesh>, Failure> {
    if vertices || input.faces.len() + input.lost_faces == 0 {
        return Ok(None);
    }
    let made = if input.faces.is_empty() {
        Err(MeshError::NoArea { faces: input.lost_faces })
    } else {
        TriangleMesh::new(input.cloud.points(), &input.faces)
    };
    made.map(Some).map_err(|error: MeshError| {
        let points = count(input.cloud.len());
        let message = format!(
            "{:?}: {error}; mend the mesh, or take its {points} vertices as a cloud with --vertices",
            input.name
        );
        Failure::usage(message).because(error)
    })
}

/// Points of the surface of a mesh that stands alone; none where its vertices lie dense enough.
pub fn points_alone(mesh: &TriangleMesh, vertices: usize, seed: u64) -> Option<PointCloud> {
    let wanted = mesh.vertex_spacing();
    let dense = vertices >= FEWEST_SCANNED && mesh.is_as_fine_as(wanted);
    (!dense).then(|| mesh.sample(mesh.samples_for(wanted), seed))
}

impl SurfaceFlag {
    /// Replaces the cloud of a mesh by points of its surface, as dense as two such meshes get that are registered with each
    /// other. None for a cloud.
    ///
    /// # Errors
    /// As [`mesh`].
    pub fn draw_alone(self, input: &mut Input, seed: u64) -> Result<Option<DrawnAlone>, Failure> {
        let faces = input.faces.len() + input.lost_faces;
        if faces == 0 {
            return Ok(None);
        }
        let vertices = input.cloud.points().to_vec();
        let Some(mesh) = mesh(input, self.vertices)? else {
            let left_out = input.lost_faces;
            return Ok(Some(DrawnAlone { vertices, faces, left_out, how: DrawnHow::Asked }));
        };
        let left_out = mesh.left_out() + input.lost_faces;
        let how = match points_alone(&mesh, vertices.len(), seed) {
            None => DrawnHow::Dense,
            Some(points) => {
                let spacing = mesh.spacing_of(points.len());
                input.cloud = points;
                DrawnHow::Points(input.cloud.len(), spacing)
            }
        };
        Ok(Some(DrawnAlone { vertices, faces, left_out, how }))
    }
}

#[cfg(test)]
mod tests {
    use srrf_cloud::io::ReadOptions;

    use super::*;
    use crate::files;

    #[test]
    fn what_was_made_of_a_mesh_is_said() {
        assert_eq!(
            text(20, 1_236, 1, DrawnHow::Points(40_000, 0.004_2)),
            "a mesh of 1,236 faces: 40,000 points drawn from its surface, 0.0042 apart; --vertices takes its 20 vertices; \
             1 face without an area passed over"
        );
        assert!(text(20, 1, 0, DrawnHow::Asked).contains("its 20 vertices are the cloud, as asked"));
    }

    #[test]
    fn a_mesh_alone_is_drawn_and_a_cloud_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("square.off");
        std::fs::write(&path, "OFF\n4 1 0\n0 0 1\n2 0 1\n2 1 1\n0 1 1\n4 0 1 2 3\n").unwrap();
        let read = || files::read(&path, None, ReadOptions::default()).unwrap();
        let mut input = read();
        let drawn = SurfaceFlag::default().draw_alone(&mut input, 7).unwrap().unwrap();
        assert_eq!((drawn.vertices.len(), drawn.faces, drawn.left_out), (4, 2, 0));
        let DrawnHow::Points(points, spacing) = drawn.how else { panic!("{drawn:?}") };
        assert_eq!((points, input.cloud.len()), (20_000, 20_000));
        assert!((spacing - 0.4697 * (2.0f64 / 20_000.0).sqrt()).abs() < 1e-5, "{spacing}");
        assert!(input.cloud.points().iter().all(|p| p[2] == 1.0 && (0.0..=2.0).contains(&p[0])));
        let mut corners = read();
        let drawn = SurfaceFlag { vertices: true }.draw_alone(&mut corners, 7).unwrap().unwrap();
        assert_eq!((drawn.how, corners.cloud.len()), (DrawnHow::Asked, 4));
        std::fs::write(&path, "OFF\n3 0 0\n0 0 1\n2 0 1\n2 1 1\n").unwrap();
        assert_eq!(SurfaceFlag::default().draw_alone(&mut read(), 7).unwrap(), None);
        std::fs::write(&path, "OFF\n3 1 0\n0 0 1\n2 0 1\n2 1 1\n3 0 0 1\n").unwrap();
        let error = SurfaceFlag::default().draw_alone(&mut read(), 7).unwrap_err().to_string();
        assert!(error.contains("has an area") && error.contains("--vertices"), "{error}");
    }
}
