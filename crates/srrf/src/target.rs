//! Clouds made ready: [`Target`], and the pair that a search works on.

use std::sync::{Arc, OnceLock};
use std::time::Instant;

use srrf_classical::FpfhCloud;
use srrf_cloud::{CentredCloud, CloudError, PairFrame, PointCloud, Rigid};
use srrf_refine::{RefineSource, RefineTarget};

use crate::error::Error;
use crate::network::thinned;
use crate::options::Options;
use crate::scale::CloudSize;

/// A target made ready, to register many sources to it. Copies share it.
#[derive(Debug, Clone)]
pub struct Target(pub(crate) Arc<TargetParts>);

/// All that depends on the target alone.
#[derive(Debug)]
pub(crate) struct TargetParts {
    pub side: PreparedCloud,
    pub refine: RefineTarget,
    /// Time that it took.
    pub seconds: f64,
}

/// One cloud of a pair, as the sources of starts want it.
#[derive(Debug)]
pub(crate) struct PreparedCloud {
    /// About its own centre.
    pub centred: CentredCloud,
    /// How large it is.
    pub size: CloudSize,
    /// An even part of it, which the network looks at.
    pub thin: PointCloud,
    /// Its features.
    described: OnceLock<FpfhCloud<'static>>,
}

impl PreparedCloud {
    fn new(cloud: &PointCloud, options: &Options) -> Result<Self, CloudError> {
        let centred = CentredCloud::new(cloud)?;
        let thin = thinned(&centred.cloud());
        let size = CloudSize::of(&centred.cloud());
        let side = Self { centred, size, thin, described: OnceLock::new() };
        if options.method.looks_globally() {
            side.features()?;
        }
        Ok(side)
    }

    /// Its features, made once; for methods that look globally they are there from the start.
    pub fn features(&self) -> Result<&FpfhCloud<'static>, CloudError> {
        match self.described.get() {
            Some(described) => Ok(described),
            None => {
                let described = FpfhCloud::new(self.centred.cloud())?.into_owned();
                Ok(self.described.get_or_init(|| described))
            }
        }
    }
}

impl Target {
    /// The cloud that it was made from, to the last digits.
    pub(crate) fn cloud(&self) -> PointCloud {
        let origin = self.0.side.centred.origin();
        let back = Rigid { translation: origin, ..Rigid::identity() };
        self.0.side.centred.cloud().transformed(&back)
    }

    pub(crate) fn new(target: &PointCloud, options: &Options) -> Result<Self, Error> {
        let begun = Instant::now();
        let side = PreparedCloud::new(target, options).map_err(Error::Target)?;
        let config = options.refine.unwrap_or_default();
        let refine = RefineTarget::new(side.centred.cloud(), &config).map_err(Error::Refine)?;
        Ok(Self(Arc::new(TargetParts { side, refine, seconds: begun.elapsed().as_secs_f64() })))
    }
}

/// A source and its target, both checked, centred, thinned and indexed. Poses in a search are between the centred clouds.
#[derive(Debug)]
pub(crate) struct PreparedPair {
    pub source: PreparedCloud,
    pub refine: RefineSource,
    pub target: Target,
    /// Between the inputs and the centred clouds.
    pub frame: PairFrame,
    /// The first guess.
    pub initial: Rigid,
}

impl PreparedPair {
    pub fn new(
        source: &PointCloud,
        target: Target,
        initial: &Rigid,
        options: &Options,
    ) -> Result<Self, Error> {
        let source = PreparedCloud::new(source, options).map_err(Error::Source)?;
        let frame = source.centred.frame_to(&target.0.side.centred);
        let refine = target.0.refine.source(source.centred.cloud()).map_err(Error::Refine)?;
        Ok(Self { source, refine, target, frame, initial: frame.pose(initial) })
    }

    /// What is known of the target.
    pub fn target_side(&self) -> &PreparedCloud {
        &self.target.0.side
    }
}
