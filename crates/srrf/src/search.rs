//! [`Search`]: starts in rounds, the best of them refined.

use srrf_cloud::Rigid;
use srrf_refine::{Evidence, RefineError, RefineSource, RefineTarget, Refinement, StartSupport, Verdict};

use crate::probability::Features;

/// A named pose between the centred clouds.
pub type Start = (String, Rigid);

/// What the starts so far came to.
#[derive(Debug, Clone)]
pub struct Found {
    pub pose: Rigid,
    pub start: String,
    pub refinement: Option<Refinement>,
    pub evidence: Evidence,
    pub features: Features,
}

/// The starts of one pair. Each gets one short run, whichever round it comes in, and the full run is made
/// anew only where a later round has a better start.
pub struct Search<'a> {
    target: &'a RefineTarget,
    source: RefineSource,
    refine: bool,
    starts: Vec<StartSupport>,
    /// Full runs so far, each after the number of its start; that of the first round comes first.
    refined: Vec<(usize, Refinement)>,
}

impl<'a> Search<'a> {
    /// Without starts. Where `refine` is false they are compared as they are.
    pub fn new(target: &'a RefineTarget, source: RefineSource, refine: bool) -> Self {
        Self { target, source, refine, starts: Vec::new(), refined: Vec::new() }
    }

    /// One more round.
    pub fn add(&mut self, starts: &[Start]) -> Result<(), RefineError> {
        let named: Vec<(&str, Rigid)> = starts.iter().map(|(name, pose)| (name.as_str(), *pose)).collect();
        if self.refine {
            self.starts.extend(self.target.shortlist(&self.source, &named)?);
        } else {
            // A shortlist of one moves nothing.
            for start in named {
                self.starts.extend(self.target.shortlist(&self.source, &[start])?);
            }
        }
        Ok(())
    }

    /// The best start, refined. Where the clouds look deformed in its pose, no support tells a start of a later round from those of the
    /// first, whose answer then stands: on bent clouds it is within 10 degrees more often (`docs/experiments.md`).
    pub fn best(&mut self) -> Result<Found, RefineError> {
        let starts = &self.starts;
        let best = StartSupport::best(starts).ok_or(RefineError::NoStart)?;
        let rivals: Vec<(Rigid, f64)> = starts.iter().map(|s| (s.target_from_source, s.rank)).collect();
        if !self.refine {
            let (pose, start) = (starts[best].given, starts[best].name.clone());
            let evidence = self.target.evidence(&self.source, &pose);
            let features = Features::new(&evidence, None, &pose, starts[best].rank, &rivals);
            return Ok(Found { pose, start, refinement: None, evidence, features });
        }
        let run = match self.refined.iter().position(|(start, _)| *start == best) {
            Some(run) => run,
            None => {
                self.refined.push((best, self.target.finish(&self.source, starts)?));
                self.refined.len() - 1
            }
        };
        let stands = if self.refined[run].1.verdict == Verdict::Deformed { 0 } else { run };
        let (from, refined) = self.refined[stands].clone();
        let refined = Refinement { starts: starts.clone(), ..refined };
        let (pose, start, evidence) =
            (refined.target_from_source, refined.start.clone(), refined.evidence.clone());
        let features = Features::new(&evidence, Some(&refined), &pose, starts[from].rank, &rivals);
        Ok(Found { pose, start, refinement: Some(refined), evidence, features })
    }
}

#[cfg(test)]
mod tests {
    use srrf_cloud::{EulerXyz, Solid};
    use srrf_corrupt::shapes::ProceduralShapes;
    use srrf_corrupt::{CorruptionKind, PairConfig, PairSynthesizer, PoseDraw, Severity, Stream};

    use super::*;
    use crate::Options;

    /// How far the answers of two rounds are from each other, in degrees: the first has a start that is off, the second the truth.
    fn second_round_turns_by(kind: CorruptionKind) -> f64 {
        let shapes = ProceduralShapes::new(11, 9, None).unwrap();
        let synthesizer = PairSynthesizer::new(PairConfig::default()).unwrap();
        let corruption = Some((kind, Severity::ALL[3]));
        let pair =
            synthesizer.pair(&shapes, 1, corruption, PoseDraw::Seeded, Stream { seed: 5, item: 1 }).unwrap();
        let truth = pair.target_from_source;
        let off = |degrees: [f64; 3]| Rigid {
            rotation: EulerXyz::from_deg(degrees).to_matrix(),
            ..Rigid::identity()
        };
        let start = |name: &str, by: &Rigid| (name.to_owned(), by.compose(&truth));

        let config = Options::default().refine.unwrap();
        let target = RefineTarget::new(Solid::new(&pair.target).unwrap(), &config).unwrap();
        let source = target.source(Solid::new(&pair.source).unwrap()).unwrap();
        let mut search = Search::new(&target, source, true);
        search
            .add(&[start("off", &off([90.0, 60.0, 20.0])), start("more", &off([-70.0, 40.0, 110.0]))])
            .unwrap();
        let first = search.best().unwrap();
        search.add(&[start("true", &Rigid::identity()), start("near", &off([1.0, 1.0, 1.0]))]).unwrap();
        let second = search.best().unwrap();
        let starts = &second.refinement.as_ref().unwrap().starts;
        assert!(StartSupport::best(starts).unwrap() > 1 && starts.len() == 4, "the later starts are better");
        first.pose.angle_to_deg(&second.pose)
    }

    #[test]
    fn later_rounds_win_where_the_clouds_are_rigid_and_not_where_they_are_bent() {
        let turned = second_round_turns_by(CorruptionKind::Gaussian);
        assert!(turned > 20.0, "{turned}");
        assert_eq!(second_round_turns_by(CorruptionKind::Distortion), 0.0);
    }
}
