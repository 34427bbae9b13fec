//! [`Refined`]: any method with a refinement behind it.

use srrf_cloud::{Branch, BranchKind, Register, RegisterError, Registration, Rigid, Solid};

use crate::{RefineConfig, RefineTarget};

/// Registers with `inner`, then refines: its pose and the pose of each of its branches are the starts.
///
/// The branches of the answer are those of `inner`, and `unrefined`, its own pose.
#[derive(Debug)]
pub struct Refined<R> {
    inner: R,
    config: RefineConfig,
    name: String,
}

impl<R: Register> Refined<R> {
    /// `inner` with this refinement behind it, named `<inner>+refine`.
    pub fn new(inner: R, config: RefineConfig) -> Self {
        let name = format!("{}+refine", inner.name());
        Self { inner, config, name }
    }

    /// The method in front.
    pub fn inner(&self) -> &R {
        &self.inner
    }

    fn refined(
        &self,
        found: Registration,
        source: Solid<'_>,
        target: Solid<'_>,
    ) -> Result<Registration, RegisterError> {
        let branches = found.branches.iter().map(|b| b.target_from_source);
        let starts: Vec<Rigid> = std::iter::once(found.target_from_source).chain(branches).collect();
        let target = RefineTarget::new(target, &self.config)?;
        let refined = target.refine(source, &starts)?;
        let mut branches = found.branches;
        branches.push(Branch {
            kind: BranchKind::Unrefined,
            target_from_source: found.target_from_source,
            inlier_ratio: refined.starts[0].support,
        });
        Ok(Registration {
            target_from_source: refined.target_from_source,
            converged: found.converged && refined.converged,
            iterations: found.iterations + refined.iterations,
            branches,
            skeletons: found.skeletons,
            matches: found.matches,
            lambda: found.lambda,
            certainty: None,
        })
    }
}

impl<R: Register> Register for Refined<R> {
    fn name(&self) -> &str {
        &self.name
    }

    fn register_solid(&self, source: Solid<'_>, target: Solid<'_>) -> Result<Registration, RegisterError> {
        self.refined(self.inner.register_solid(source, target)?, source, target)
    }
}
