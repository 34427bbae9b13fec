//! Makes the two clouds of `demo`, which the README registers: one built-in airplane of 2.4 m, scanned twice. The
//! source lacks a quarter and is noisy; the target has holes and clutter, and is turned by 75 degrees.
//!
//! `cargo run -p srrf --example demo_clouds -- [FOLDER]` (default `demo`)

use std::error::Error;
use std::path::PathBuf;

use nalgebra::{Rotation3, Unit, Vector3};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use srrf_cloud::io::write_cloud;
use srrf_cloud::{PointCloud, Rigid};
use srrf_corrupt::crop::crop;
use srrf_corrupt::datasets::ShapeSource;
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::{CorruptionKind, Severity, Variants, corruption};

/// Metres of the shape's radius.
const RADIUS: f64 = 1.2;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "demo".into()));
    std::fs::create_dir_all(&folder)?;
    let shapes = ProceduralShapes::new(11, 3, Some(&["airplane"]))?;
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut corrupted = |points: Vec<[f64; 3]>, kind: CorruptionKind, severity: u8| {
        let done =
            corruption(kind, &Variants::default()).apply(&points, Severity::try_from(severity)?, &mut rng)?;
        Ok::<_, Box<dyn Error>>(done.points)
    };

    let whole = shapes.sample(0, 2400, &mut ChaCha8Rng::seed_from_u64(3))?;
    let seen = crop(whole.points(), &Vector3::new(0.6, 0.7, 0.4).normalize(), 0.75);
    let source = corrupted(seen.iter().map(|&i| whole.points()[i]).collect(), CorruptionKind::Gaussian, 2)?;

    let other = shapes.sample(0, 3000, &mut ChaCha8Rng::seed_from_u64(4))?;
    let target = corrupted(other.points().to_vec(), CorruptionKind::Cutout, 3)?;
    let target = corrupted(target, CorruptionKind::Background, 3)?;

    let axis = Unit::new_normalize(Vector3::new(0.3, -0.5, 0.8));
    let pose = Rigid {
        rotation: Rotation3::from_axis_angle(&axis, 75_f64.to_radians()).into_inner(),
        translation: Vector3::new(2.0, -1.0, 0.5),
    };
    let metres =
        |points: Vec<[f64; 3]>| PointCloud::new(points.iter().map(|p| p.map(|v| v * RADIUS)).collect());
    write_cloud(&folder.join("source.ply"), &metres(source)?)?;
    write_cloud(&folder.join("target.pcd"), &metres(target)?.transformed(&pose))?;
    Ok(())
}
