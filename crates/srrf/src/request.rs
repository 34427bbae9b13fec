//! [`Request`]: what is to be registered.

use std::sync::atomic::{AtomicBool, Ordering};

use srrf_cloud::{PointCloud, Rigid};

use crate::event::{Observed, Observer};
use crate::target::Target;

/// What is to be registered: a source, the target that it is laid on, and a first guess if there is one.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// The cloud that moves.
    pub source: &'a PointCloud,
    /// What it is laid on.
    pub target: RequestTarget<'a>,
    /// A first guess of `target_from_source`, in input coordinates; none stands for the identity.
    pub initial: Option<Rigid>,
    /// A flag that ends the search with [`crate::Error::Stopped`] where another thread sets it; looked at between rounds.
    pub stop: Option<&'a AtomicBool>,
    /// Who is told what is done, while it is done.
    pub observed: Observed<'a>,
}

/// A target as it is, or one that [`crate::Registrar::prepare`] made ready.
#[derive(Debug, Clone, Copy)]
pub enum RequestTarget<'a> {
    /// A cloud, used once.
    Cloud(&'a PointCloud),
    /// One made ready, which serves many sources.
    Prepared(&'a Target),
}

impl<'a> Request<'a> {
    /// Without a first guess. `target` is a cloud or a prepared [`Target`].
    pub fn new(source: &'a PointCloud, target: impl Into<RequestTarget<'a>>) -> Self {
        Self { source, target: target.into(), initial: None, stop: None, observed: Observed::default() }
    }

    /// With a first guess.
    pub fn with_initial(self, target_from_source: Rigid) -> Self {
        Self { initial: Some(target_from_source), ..self }
    }

    /// With a flag by which another thread ends the search.
    pub fn until(self, stop: &'a AtomicBool) -> Self {
        Self { stop: Some(stop), ..self }
    }

    /// Whether the search is to end.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    /// With an observer of the stages.
    ///
    /// ```
    /// # use rand::{SeedableRng, rngs::ChaCha8Rng};
    /// # use srrf_corrupt::{datasets::ShapeSource, shapes::ProceduralShapes};
    /// use std::sync::Mutex;
    /// use srrf::{Event, Method, Options, Registrar, Request};
    /// # let cloud = ProceduralShapes::new(7, 3, None)?.sample(1, 1500, &mut ChaCha8Rng::seed_from_u64(1))?;
    ///
    /// let stages = Mutex::new(Vec::new());
    /// let watch = |event: Event| {
    ///     if let (Event::Began(stage), Ok(mut stages)) = (event, stages.lock()) {
    ///         stages.push(stage.to_string());
    ///     }
    /// };
    /// let registrar = Registrar::new(Options { method: Method::Given, ..Options::default() })?;
    /// registrar.register(&Request::new(&cloud, &cloud).observed_by(&watch))?;
    /// assert_eq!(stages.into_inner()?, ["prepare target", "prepare source", "refine"]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn observed_by(self, observer: &'a dyn Observer) -> Self {
        Self { observed: Observed::by(observer), ..self }
    }
}

impl<'a> From<&'a PointCloud> for RequestTarget<'a> {
    fn from(cloud: &'a PointCloud) -> Self {
        Self::Cloud(cloud)
    }
}

impl<'a> From<&'a Target> for RequestTarget<'a> {
    fn from(target: &'a Target) -> Self {
        Self::Prepared(target)
    }
}
