//! [`Search`]: starts in rounds, the best of them refined.

use srrf_cloud::Rigid;
use srrf_refine::{Evidence, RefineError, RefineSource, RefineTarget, Refinement, StartSupport};

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
    refined: Option<(usize, Refinement)>,
}

impl<'a> Search<'a> {
    /// Without starts. Where `refine` is false they are compared as they are.
    pub fn new(target: &'a RefineTarget, source: RefineSource, refine: bool) -> Self {
        Self { target, source, refine, starts: Vec::new(), refined: None }
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

    /// The best supported start, refined.
    pub fn best(&mut self) -> Result<Found, RefineError> {
        let starts = &self.starts;
        // The first of equals wins.
        let best = (0..starts.len()).reduce(|a, b| if starts[b].support > starts[a].support { b } else { a });
        let best = best.ok_or(RefineError::NoStart)?;
        let rivals: Vec<(Rigid, f64)> = starts.iter().map(|s| (s.target_from_source, s.support)).collect();
        if !self.refine {
            let (pose, start) = (starts[best].given, starts[best].name.clone());
            let evidence = self.target.evidence(&self.source, &pose);
            let features = Features::new(&evidence, None, &pose, &rivals);
            return Ok(Found { pose, start, refinement: None, evidence, features });
        }
        let refined = match self.refined.take() {
            Some((same, refined)) if same == best => Refinement { starts: starts.clone(), ..refined },
            _ => self.target.finish(&self.source, starts)?,
        };
        self.refined = Some((best, refined.clone()));
        let (pose, start, evidence) =
            (refined.target_from_source, refined.start.clone(), refined.evidence.clone());
        let features = Features::new(&evidence, Some(&refined), &pose, &rivals);
        Ok(Found { pose, start, refinement: Some(refined), evidence, features })
    }
}
