//! Own parts: a corruption and a registration method of one's own, behind the same seams as the
//! built-in ones. `cargo run -p srrf --example own_parts`.
#![allow(clippy::print_stdout, reason = "an example shows what it found")]

use std::error::Error;

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use srrf_cloud::{EulerXyz, KnnIndex, PointCloud, Register, RegisterError, Registration, Rigid, Solid};
use srrf_corrupt::{CorruptError, Corrupted, Corruption, Severity};
use srrf_corrupt::{datasets::ShapeSource, shapes::ProceduralShapes};
use srrf_refine::{RefineConfig, Refined};

/// Rain: drops in front of the sensor, a share of the points on the way to the origin of the scan.
pub struct Rain;

impl Corruption for Rain {
    fn name(&self) -> &'static str {
        "rain"
    }

    fn apply(
        &self,
        points: &[[f64; 3]],
        severity: Severity,
        rng: &mut ChaCha8Rng,
    ) -> Result<Corrupted, CorruptError> {
        let share = severity.of(&[0.01, 0.02, 0.03, 0.04, 0.05]);
        let sensor = Vector3::new(0.0, 0.0, 3.0);
        let moved = points.iter().map(|p| {
            if !rng.random_bool(share) {
                return *p;
            }
            (sensor + rng.random_range(0.6..1.0) * (Vector3::from(*p) - sensor)).into()
        });
        Ok(Corrupted::moved(moved.collect()))
    }
}

/// Lays the principal axes of the source on those of the target; of the four ways to do so, the one
/// that leaves the smallest distances.
pub struct PrincipalAxes;

impl Register for PrincipalAxes {
    fn name(&self) -> &str {
        "principal-axes"
    }

    fn register_solid(&self, source: Solid<'_>, target: Solid<'_>) -> Result<Registration, RegisterError> {
        let index = KnnIndex::new(target.points()).map_err(RegisterError::Target)?;
        let (from, to) = (axes(&source), axes(&target));
        let (a, b) = (source.centroid(), target.centroid());
        let signs = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        let best = signs
            .map(|sign| {
                let rotation = to * Matrix3::from_diagonal(&sign.into()) * from.transpose();
                let pose = Rigid { rotation, translation: b - rotation * a };
                let cost: f64 = source.points().iter().map(|p| index.nearest(&pose.apply(p)).1.sqrt()).sum();
                (cost, pose)
            })
            .into_iter()
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let (_, pose) = best.ok_or_else(|| RegisterError::NoPose("no way to lay the axes".into()))?;
        Ok(Registration::from_pose(pose))
    }
}

/// The principal axes as the columns of a rotation, the longest first.
fn axes(cloud: &PointCloud) -> Matrix3<f64> {
    let mean = cloud.centroid();
    let scatter = cloud.points().iter().fold(Matrix3::zeros(), |sum, p| {
        let d = Vector3::from(*p) - mean;
        sum + d * d.transpose()
    });
    let eigen = SymmetricEigen::new(scatter);
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    let (first, second) = (eigen.eigenvectors.column(order[0]), eigen.eigenvectors.column(order[1]));
    Matrix3::from_columns(&[first.into_owned(), second.into_owned(), first.cross(&second)])
}

fn main() -> Result<(), Box<dyn Error>> {
    let (coarse, refined) = run(Severity::try_from(3)?)?;
    println!("principal axes alone: off by {coarse:.2} degrees; refined: {refined:.3} degrees");
    Ok(())
}

/// A shape in the rain, laid on the dry one; the errors in degrees without and with refinement.
pub fn run(severity: Severity) -> Result<(f64, f64), Box<dyn Error>> {
    let shapes = ProceduralShapes::new(1, 1, Some(&["chair"]))?;
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let (dry, other) = shapes.sample_two(0, 2000, &mut rng)?;
    let wet = PointCloud::new(Rain.apply(other.points(), severity, &mut rng)?.points)?;
    let rotation = EulerXyz::from_deg([70.0, -30.0, 150.0]).to_matrix();
    let truth = Rigid { rotation, translation: [4.0, 5.0, 6.0].into() };
    let target = dry.transformed(&truth);

    let coarse = PrincipalAxes.register(&wet, &target)?;
    let refined = Refined::new(PrincipalAxes, RefineConfig::default()).register(&wet, &target)?;
    Ok((coarse.target_from_source.angle_to_deg(&truth), refined.target_from_source.angle_to_deg(&truth)))
}
