//! A search for the scale: seven parameters instead of six.

use srrf_cloud::{PointCloud, Rigid, thin_to};

use super::applied::{AppliedScale, ScaleOrigin};
use super::doubt::{CloudSize, common_factors};
use super::similarity::{Fitted, Similarity, SimilarityFit};
use crate::error::Error;
use crate::event::Event;
use crate::outcome::Outcome;
use crate::registrar::Registrar;
use crate::request::{Request, RequestTarget};
use crate::warning::Warning;

/// Points of each cloud that are looked at while scales are tried.
const TRIED_POINTS: usize = 5_000;
/// Scales that are tried on either side of the ratio of the sizes, and how far they are apart.
const STEPS: i32 = 6;
const STEP: f64 = 1.12;
/// Tried scales whose fit is looked at.
const FITTED: usize = 4;
/// A scale that is less certain than this, relative to itself, is no answer.
const MOST_SPREAD: f64 = 0.05;

impl Registrar {
    /// As [`register`](Self::register), of a source of any scale: `target ~ R (k source) + t`. `k` and its spread are in
    /// [`Outcome::scale`]; the pose is rigid, of the source that has been multiplied by `k`, and so are the lengths.
    ///
    /// Scales around the ratio of the sizes are tried, from a half to twice, and those between common units; so the clouds must show
    /// much the same part of the scene. The best fits are improved in all seven parameters, and the last registration is as usual.
    /// The probability speaks for the pose at that scale.
    ///
    /// # Errors
    /// As [`register`](Self::register).
    pub fn register_with_scale(&self, request: &Request<'_>) -> Result<Outcome, Error> {
        let whole = match request.target {
            RequestTarget::Cloud(cloud) => cloud.clone(),
            RequestTarget::Prepared(target) => target.cloud(),
        };
        let sizes = [CloudSize::of(request.source), CloudSize::of(&whole)];
        let thin = |cloud: &PointCloud, size: CloudSize| thin_to(cloud, TRIED_POINTS, size.radius);
        let (source, target) = (thin(request.source, sizes[0]), thin(&whole, sizes[1]));
        let prepared = self.prepare(&target)?;
        let factors = factors(sizes[1].radius / sizes[0].radius);
        let of = factors.len();
        let mut tried: Vec<(f64, Outcome)> = Vec::new();
        for (number, factor) in (1..).zip(factors) {
            if request.is_stopped() {
                return Err(Error::Stopped);
            }
            request.observed.tell(Event::Scale { number, of });
            let Ok(scaled) = source.scaled(factor) else { continue };
            let asked =
                Request { initial: request.initial, stop: request.stop, ..Request::new(&scaled, &prepared) };
            tried.extend(self.first_round(&asked).ok().map(|found| (factor, found)));
        }
        // The likeliest first; of equals, those that lie on each other more.
        let worth = |found: &Outcome| {
            (found.probability.get(), found.evidence.fitness * found.evidence.overlap_target)
        };
        tried.sort_by(|(_, a), (_, b)| {
            let (a, b) = (worth(a), worth(b));
            b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1))
        });
        let fit = SimilarityFit::new(request.source, &whole).map_err(Error::Source)?;
        let starts = tried.iter().take(FITTED);
        let fits = starts.filter_map(|(scale, found)| {
            fit.fit(&Similarity { scale: *scale, pose: found.target_from_source })
        });
        let best = fits.max_by(|a, b| a.overlap.total_cmp(&b.overlap));
        match best {
            Some(best) => self.register_at(request, &best),
            None => self.register_as_it_is(request),
        }
    }

    /// The registration at a scale that was found.
    fn register_at(&self, request: &Request<'_>, found: &Fitted) -> Result<Outcome, Error> {
        let Similarity { scale, pose } = found.similarity;
        let source = request.source.scaled(scale).map_err(Error::Source)?;
        let initial: Option<Rigid> = Some(pose);
        let mut outcome = self.register_as_it_is(&Request { source: &source, initial, ..*request })?;
        let spread = found.spread.is_finite().then_some(found.spread);
        outcome.scale = Some(AppliedScale { factor: scale, spread, origin: ScaleOrigin::Estimated });
        if spread.is_none_or(|spread| spread > MOST_SPREAD * scale) {
            outcome.abstain = true;
            outcome.warnings.push(Warning::ScaleUndetermined { factor: scale, spread });
        }
        Ok(outcome)
    }
}

/// The scales to try.
fn factors(ratio: f64) -> Vec<f64> {
    let mut factors: Vec<f64> = (-STEPS..=STEPS).map(|step| ratio * STEP.powi(step)).collect();
    factors.extend(common_factors(ratio));
    factors.retain(|f| f.is_finite() && *f > 0.0);
    factors
}

#[cfg(test)]
mod tests {
    use rand::{SeedableRng, rngs::ChaCha8Rng};
    use srrf_cloud::EulerXyz;
    use srrf_corrupt::{datasets::ShapeSource, shapes::ProceduralShapes};

    use super::*;
    use crate::Options;

    #[test]
    fn scales_are_tried_around_the_ratio_of_the_sizes_and_between_units() {
        let factors = factors(900.0);
        assert!(
            factors.contains(&1000.0) && factors.iter().all(|f| (400.0..2000.0).contains(f)),
            "{factors:?}"
        );
        assert!(super::factors(f64::NAN).is_empty() && super::factors(0.0).is_empty());
    }

    #[test]
    fn a_scale_that_nobody_knows_is_found() {
        let shapes = ProceduralShapes::new(7, 3, None).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let (source, other) = shapes.sample_two(1, 3000, &mut rng).unwrap();
        let rotation = EulerXyz::from_deg([20.0, -35.0, 40.0]).to_matrix();
        let truth = Rigid { rotation, translation: [300.0, -20.0, 7.0].into() };
        let target = other.scaled(37.5).unwrap().transformed(&truth);
        let registrar = Registrar::new(Options::default()).unwrap();
        let found = registrar.register_with_scale(&Request::new(&source, &target)).unwrap();
        let scale = found.scale.unwrap();
        let spread = scale.spread.unwrap();
        assert!((scale.factor - 37.5).abs() < 0.2 && spread < 0.2, "{scale:?}");
        assert!(
            !found.abstain && found.target_from_source.angle_to_deg(&truth) < 0.5,
            "{}",
            found.probability.get()
        );
        assert!((found.target_from_source.translation - truth.translation).norm() < 0.5);
        let json = found.to_json();
        assert_eq!(json["scale"]["origin"], "estimated");
        // As they are, they cannot be registered.
        let error = registrar.register(&Request::new(&source, &target)).unwrap_err();
        assert!(error.to_string().contains("--scale auto"), "{error}");
    }
}
