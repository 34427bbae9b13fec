//! Registers two samplings of a built-in chair: `cargo run -p srrf-model --example register`.
#![allow(clippy::print_stdout, reason = "an example shows what it found")]

use rand::{SeedableRng, rngs::ChaCha8Rng};
use srrf_cloud::{EulerXyz, Register, Rigid};
use srrf_corrupt::{datasets::ShapeSource, shapes::ProceduralShapes};
use srrf_model::{SrrfRegister, device, embedded};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let chairs = ProceduralShapes::new(1, 1, Some(&["chair"]))?;
    let (source, target) = chairs.sample_two(0, 1024, &mut ChaCha8Rng::seed_from_u64(1))?;
    let rotation = EulerXyz::from_deg([10.0, -25.0, 40.0]).to_matrix();
    let truth = Rigid { rotation, translation: [0.3, -0.1, 0.2].into() };
    let target = target.transformed(&truth);

    let device = device("flex")?;
    let loaded = embedded::load_default(&device)?;
    let found = SrrfRegister::new(loaded, device).register(&source, &target)?;

    println!("target_from_source:{}", found.target_from_source.to_matrix4());
    println!("rotation error: {:.2} degrees", found.target_from_source.angle_to_deg(&truth));
    for branch in &found.branches {
        println!("{}: gamma {:.3}", branch.kind, branch.inlier_ratio);
    }
    if let Some(lambda) = found.lambda {
        println!("lambda {lambda:.3}");
    }
    Ok(())
}
