//! Two clouds, one call: `cargo run -p srrf --example two_files -- SOURCE TARGET`.
//!
//! Without files it makes two scans of a built-in shape, each with its own points.
#![allow(clippy::print_stdout, reason = "an example shows what it found")]

use std::error::Error;
use std::path::Path;

use rand::{SeedableRng, rngs::ChaCha8Rng};
use srrf::Outcome;
use srrf_cloud::io::{read_cloud, write_cloud};
use srrf_cloud::{EulerXyz, Rigid};
use srrf_corrupt::{datasets::ShapeSource, shapes::ProceduralShapes};

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match &files[..] {
        [source, target] => register_files(Path::new(source), Path::new(target))?,
        [] => on_generated_files()?.0,
        _ => return Err("give two files, or none".into()),
    };
    println!("target_from_source:{:.4}", outcome.target_from_source.to_matrix4());
    println!("right with probability {:.2}; abstain: {}", outcome.probability, outcome.abstain);
    Ok(())
}

/// The whole of it.
pub fn register_files(source: &Path, target: &Path) -> Result<Outcome, Box<dyn Error>> {
    Ok(srrf::register(&read_cloud(source)?, &read_cloud(target)?)?)
}

/// The same with files made here, so that the truth is known; also the error in degrees.
pub fn on_generated_files() -> Result<(Outcome, f64), Box<dyn Error>> {
    let chairs = ProceduralShapes::new(1, 1, Some(&["chair"]))?;
    let (source, target) = chairs.sample_two(0, 3000, &mut ChaCha8Rng::seed_from_u64(1))?;
    let rotation = EulerXyz::from_deg([10.0, -25.0, 40.0]).to_matrix();
    let motion = Rigid { rotation, translation: [0.3, -0.1, 0.2].into() };

    let folder = tempfile::tempdir()?;
    let (a, b) = (folder.path().join("source.ply"), folder.path().join("target.pcd"));
    write_cloud(&a, &source)?;
    write_cloud(&b, &target.transformed(&motion))?;
    let outcome = register_files(&a, &b)?;
    let error_deg = outcome.target_from_source.angle_to_deg(&motion);
    println!("off by {error_deg:.3} degrees");
    Ok((outcome, error_deg))
}
