//! The product as a row of the benchmark: [`Registrar`] behind the [`Register`] seam.

use srrf_cloud::{Certainty, Register, RegisterError, Registration, Solid};

use crate::error::Error;
use crate::options::RotationRange;
use crate::registrar::Registrar;
use crate::request::Request;

impl Register for Registrar {
    fn name(&self) -> &str {
        match self.options().rotation {
            RotationRange::Any => "srrf-register",
            RotationRange::Within45 => "srrf-register-45",
        }
    }

    /// What [`Registrar::register`] answers: its pose, the iterations of the refinement behind it, and how sure it is.
    fn register_solid(&self, source: Solid<'_>, target: Solid<'_>) -> Result<Registration, RegisterError> {
        let found = Self::register(self, &Request::new(source.cloud(), target.cloud()))?;
        let run = found.refinement.as_ref();
        Ok(Registration {
            converged: run.is_none_or(|r| r.converged),
            iterations: run.map_or(1, |r| r.iterations),
            certainty: Some(Certainty { probability: found.probability.get(), abstain: found.abstain }),
            ..Registration::from_pose(found.target_from_source)
        })
    }
}

impl From<Error> for RegisterError {
    fn from(error: Error) -> Self {
        match error {
            Error::Source(e) => Self::Source(e),
            Error::Target(e) => Self::Target(e),
            Error::Refine(e) => e.into(),
            Error::Copy(e) => e.into(),
            Error::NoPose(why) => Self::NoPose(Box::new(why)),
            other => Self::NoPose(Box::new(other)),
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
    use srrf_cloud::{EulerXyz, PointCloud, Rigid};
    use srrf_corrupt::{datasets::ShapeSource, shapes::ProceduralShapes};

    use super::*;
    use crate::{Method, Options};

    fn shape() -> PointCloud {
        let shapes = ProceduralShapes::new(3, 1, Some(&["chair"])).unwrap();
        shapes.sample(0, 601, &mut ChaCha8Rng::seed_from_u64(4)).unwrap()
    }

    #[test]
    fn the_row_is_what_people_run() {
        let rotation = EulerXyz::from_deg([30.0, -20.0, 40.0]).to_matrix();
        let truth = Rigid { rotation, translation: [0.2, -0.3, 0.1].into() };
        let (source, target) = (shape(), shape().transformed(&truth));
        let options = Options { rotation: RotationRange::Within45, ..Options::default() };
        let registrar = Registrar::new(options).unwrap();
        let row: &dyn Register = &registrar;
        assert_eq!(row.name(), "srrf-register-45");
        let (scored, found) = (
            row.register(&source, &target).unwrap(),
            registrar.register(&Request::new(&source, &target)).unwrap(),
        );
        assert_eq!(scored.target_from_source, found.target_from_source);
        let certainty = scored.certainty.unwrap();
        assert_eq!((certainty.probability, certainty.abstain), (found.probability.get(), found.abstain));
        assert_eq!(scored.iterations, found.refinement.unwrap().iterations);
        assert!(scored.iterations > 1 && certainty.probability > 0.5);
    }

    #[test]
    fn doubt_and_errors_get_through_the_seam() {
        let given = Registrar::new(Options { method: Method::Given, ..Options::default() }).unwrap();
        let row: &dyn Register = &given;
        assert_eq!(row.name(), "srrf-register");
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let ball = (0..601).map(|_| std::array::from_fn(|_| rng.random_range(-0.5..0.5))).collect();
        let other = PointCloud::new(ball).unwrap();
        assert!(row.register(&shape(), &other).unwrap().certainty.unwrap().abstain);
        let line = PointCloud::new((0..5).map(|i| [f64::from(i), 0.0, 0.0]).collect()).unwrap();
        assert!(matches!(row.register(&line, &shape()), Err(RegisterError::Source(_))));
        assert!(matches!(row.register(&shape(), &line), Err(RegisterError::Target(_))));
    }
}
