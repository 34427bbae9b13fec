//! One target, many sources: the target is prepared once. `cargo run -p srrf --example many_sources`.
#![allow(clippy::print_stdout, reason = "an example shows what it found")]

use std::error::Error;

use rand::{SeedableRng, rngs::ChaCha8Rng};
use srrf::{Options, Outcome, Registrar, Request, RotationRange};
use srrf_cloud::{EulerXyz, PointCloud, Rigid};
use srrf_corrupt::{datasets::ShapeSource, shapes::ProceduralShapes};

fn main() -> Result<(), Box<dyn Error>> {
    let (map, scans) = map_and_scans(5)?;
    for ((_, truth), outcome) in scans.iter().zip(register_all(&map, &scans)?) {
        println!(
            "off by {:.3} degrees, probability {:.2}, start: {}",
            outcome.target_from_source.angle_to_deg(truth),
            outcome.probability,
            outcome.start
        );
    }
    Ok(())
}

/// A scan, and the pose that lays it on the map.
pub type Scan = (PointCloud, Rigid);

/// Registers all scans to one map.
pub fn register_all(map: &PointCloud, scans: &[Scan]) -> Result<Vec<Outcome>, Box<dyn Error>> {
    let registrar = Registrar::new(Options { rotation: RotationRange::Within45, ..Options::default() })?;
    let target = registrar.prepare(map)?;
    let register = |(scan, _): &Scan| registrar.register(&Request::new(scan, &target));
    Ok(scans.iter().map(register).collect::<Result<_, _>>()?)
}

/// A shape, and scans of it.
pub fn map_and_scans(count: u32) -> Result<(PointCloud, Vec<Scan>), Box<dyn Error>> {
    let shapes = ProceduralShapes::new(5, 1, Some(&["chair"]))?;
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let map = shapes.sample(0, 4000, &mut rng)?;
    let mut scans = Vec::new();
    for i in 0..count {
        let turn = f64::from(i);
        let rotation = EulerXyz::from_deg([4.0 * turn, -7.0 * turn, 30.0 - 9.0 * turn]).to_matrix();
        let pose = Rigid { rotation, translation: [0.1 * turn, 0.2, -0.3].into() };
        scans.push((shapes.sample(0, 2000, &mut rng)?.transformed(&pose.inverse()), pose));
    }
    Ok((map, scans))
}
