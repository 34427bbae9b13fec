//! [`align`]: many scans into one frame, with a [`Registrar`] for the pairs.

use std::convert::Infallible;

use srrf_align::{AlignError, AlignOptions, Map, NoStore, OtherPose, PairAnswer, RegisterPairs};
use srrf_cloud::{PointCloud, Rigid};

use crate::error::Error;
use crate::options::{Method, Options};
use crate::poses::CandidatePose;
use crate::registrar::Registrar;
use crate::request::Request;
use crate::target::Target;

impl RegisterPairs for Registrar {
    type Target = Target;
    type Error = Error;

    fn prepare(&self, target: &PointCloud) -> Result<Target, Error> {
        Self::prepare(self, target)
    }

    fn register(
        &self,
        source: &PointCloud,
        target: &Target,
        target_from_source: Option<Rigid>,
    ) -> Result<PairAnswer, Error> {
        self.pair_answer(&Request { initial: target_from_source, ..Request::new(source, target) })
    }

    fn refine(
        &self,
        source: &PointCloud,
        target: &Target,
        target_from_source: Rigid,
    ) -> Result<PairAnswer, Error> {
        RegisterPairs::register(&self.guided()?, source, target, Some(target_from_source))
    }
}

impl Registrar {
    /// As [`register`](Self::register), in the words of an alignment: where no pose is found the answer is nothing.
    ///
    /// # Errors
    /// As [`register`](Self::register), but for [`Error::NoPose`].
    pub fn pair_answer(&self, request: &Request<'_>) -> Result<PairAnswer, Error> {
        match self.register(request) {
            Ok(found) => Ok(PairAnswer {
                target_from_source: Some(found.target_from_source),
                probability: found.probability.get(),
                probability_of_fit: found.probability_of_fit.get(),
                abstain: found.abstain,
                others: found.poses.iter().skip(1).map(other_pose).collect(),
            }),
            Err(Error::NoPose(_)) => Ok(PairAnswer::NOTHING),
            Err(other) => Err(other),
        }
    }

    /// One with the same options that looks only at first guesses, for targets that this one made ready.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn guided(&self) -> Result<Self, Error> {
        Self::new(Options { method: Method::Given, ..self.options().clone() })
    }
}

fn other_pose(pose: &CandidatePose) -> OtherPose {
    OtherPose { target_from_source: pose.target_from_source, probability: pose.probability.get() }
}

/// Lays scans in one frame, with the default options; those that nothing joins are components of their own.
///
/// ```
/// use srrf_cloud::{EulerXyz, PointCloud, Rigid};
/// use srrf_corrupt::{shapes::ProceduralShapes, datasets::ShapeSource};
/// use rand::{SeedableRng, rngs::ChaCha8Rng};
///
/// let shapes = ProceduralShapes::new(7, 3, None)?;
/// let first = shapes.sample(1, 2000, &mut ChaCha8Rng::seed_from_u64(1))?;
/// let motion = Rigid { rotation: EulerXyz::from_deg([20.0, -15.0, 30.0]).to_matrix(), ..Rigid::identity() };
/// let scans = [first.clone(), first.transformed(&motion)];
///
/// let map = srrf::align(&scans)?;
/// assert_eq!(map.components, [[0, 1]]);
/// assert!(map.scans[1].map_from_scan.angle_to_deg(&motion.inverse()) < 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`AlignError`] for fewer than two scans, and for one that determines no rotation.
pub fn align(scans: &[PointCloud]) -> Result<Map, AlignError<Infallible, Error>> {
    let registrar =
        Registrar::new(Options::default()).map_err(|source| AlignError::Register { number: 0, source })?;
    srrf_align::align(scans, &registrar, &AlignOptions::default(), &NoStore, &|_| {})
}
