//! Makes a CAD part and a scan of it, which the book registers: `part.stl`, 36 triangles in millimetres, and `scan.ply`, 38,000 points
//! as a scanner in front of it sees them, with noise, elsewhere and turned by 142 degrees.
//!
//! `cargo run -p srrf --example cad_clouds -- [FOLDER] [--metres]` (default `cad`); with `--metres` the scan is in metres.

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use nalgebra::{Rotation3, Unit, Vector3};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use srrf_cloud::io::write_cloud;
use srrf_cloud::{PointCloud, Rigid, TriangleMesh};

/// The outline of the part, a bracket without a symmetry, in millimetres, against the clock.
const OUTLINE: [[f64; 2]; 10] = [
    [0.0, 0.0],
    [120.0, 0.0],
    [120.0, 22.0],
    [95.0, 22.0],
    [80.0, 40.0],
    [46.0, 40.0],
    [46.0, 88.0],
    [30.0, 100.0],
    [12.0, 100.0],
    [0.0, 70.0],
];
/// Fans that fill the outline: the corner that each starts at, and the corners along it.
const FANS: [(usize, [usize; 2]); 3] = [(0, [1, 5]), (0, [5, 6]), (9, [6, 8])];
/// Thickness of the part.
const THICKNESS: f64 = 35.0;
/// Points of the scan.
const POINTS: usize = 38_000;
/// Standard deviation of its noise.
const NOISE: f64 = 0.05;
/// Where the scanner stands, seen from the part.
const SCANNER: [f64; 3] = [0.45, 0.6, 0.66];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let metres = arguments.iter().any(|a| a == "--metres");
    let folder = arguments.iter().find(|a| !a.starts_with('-'));
    write_files(&PathBuf::from(folder.map_or("cad", String::as_str)), metres)?;
    Ok(())
}

/// Writes both files; gives the pose that lays the part on the scan, in the unit of the scan.
pub fn write_files(folder: &Path, metres: bool) -> Result<Rigid, Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    let (vertices, faces) = part();
    std::fs::write(folder.join("part.stl"), stl(&vertices, &faces))?;
    let unit = if metres { 0.001 } else { 1.0 };
    let axis = Unit::new_normalize(Vector3::new(0.4, -0.7, 0.5));
    let pose = Rigid {
        rotation: Rotation3::from_axis_angle(&axis, 142_f64.to_radians()).into_inner(),
        translation: Vector3::new(310.0, -85.0, 640.0) * unit,
    };
    let scan = scan(&vertices, &faces)?.scaled(unit)?.transformed(&pose);
    write_cloud(&folder.join("scan.ply"), &scan)?;
    Ok(pose)
}

/// Vertices and triangles of the outline, made solid.
fn part() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let level = |z: f64| OUTLINE.map(|[x, y]| [x, y, z]);
    let vertices = [level(0.0), level(THICKNESS)].concat();
    let n = OUTLINE.len();
    let mut faces: Vec<[usize; 3]> = Vec::new();
    for (corner, [first, last]) in FANS {
        for i in first..last {
            faces.push([corner, i + 1, i]);
            faces.push([n + corner, n + i, n + i + 1]);
        }
    }
    // What the fans leave between them.
    faces.extend([[0, 9, 6], [n, n + 6, n + 9]]);
    for i in 0..n {
        let j = (i + 1) % n;
        faces.extend([[i, j, n + j], [i, n + j, n + i]]);
    }
    (vertices, faces.iter().map(|face| face.map(|i| i as u32)).collect())
}

/// The triangles as an STL file of text.
fn stl(vertices: &[[f64; 3]], faces: &[[u32; 3]]) -> String {
    let mut text = String::from("solid bracket\n");
    for face in faces {
        text += "facet normal 0 0 0\nouter loop\n";
        for corner in face {
            let [x, y, z] = vertices[*corner as usize];
            // Writing to a string cannot fail.
            let _ = writeln!(text, "vertex {x} {y} {z}");
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid bracket\n"
}

/// Points of the sides that face the scanner, with noise.
fn scan(vertices: &[[f64; 3]], faces: &[[u32; 3]]) -> Result<PointCloud, Box<dyn Error>> {
    let corner = |i: u32| Vector3::from(vertices[i as usize]);
    let faces_scanner = |face: &&[u32; 3]| {
        let [a, b, c] = face.map(corner);
        (b - a).cross(&(c - a)).dot(&Vector3::from(SCANNER)) > 0.0
    };
    let seen: Vec<[u32; 3]> = faces.iter().filter(faces_scanner).copied().collect();
    let drawn = TriangleMesh::new(vertices, &seen)?.sample(POINTS, 5);
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let noise = Normal::new(0.0, NOISE)?;
    let noisy = drawn.points().iter().take(POINTS).map(|p| p.map(|c| c + noise.sample(&mut rng)));
    Ok(PointCloud::new(noisy.collect())?)
}
