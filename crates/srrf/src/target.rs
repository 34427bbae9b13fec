//! Clouds made ready: [`Target`], and the pair that a search works on.

use std::sync::{Arc, OnceLock};
use std::time::Instant;

use srrf_classical::FpfhCloud;
use srrf_cloud::{CentredCloud, CloudError, PairFrame, PointCloud, Rigid, Solid, thin_from};
use srrf_refine::{RefineSource, RefineTarget};

use crate::error::Error;
use crate::network::thinned;
use crate::options::Options;
use crate::scale::CloudSize;

/// Larger clouds are thinned to so many points before all else: no stage looks at more than 20,000.
const MOST_POINTS: usize = 100_000;

/// The network chooses from so many points; of larger clouds it sees a part.
const SEEN: usize = 8192;
/// Clouds of a few thousand points are what the network was trained for.
const SMALL: usize = 4096;

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
    /// Points of the input.
    pub count: usize,
    /// Root mean square distance of its points from their mean.
    pub radius: f64,
    /// About its own centre; large clouds thinned.
    pub centred: CentredCloud,
    /// How large it is.
    pub size: CloudSize,
    /// An even part of it, which the network looks at.
    thin: OnceLock<PointCloud>,
    /// Its features.
    described: OnceLock<FpfhCloud<'static>>,
}

impl PreparedCloud {
    fn new(cloud: &PointCloud, options: &Options) -> Result<Self, CloudError> {
        let solid = Solid::new(cloud)?;
        let radius = radius(&solid);
        let centred = if cloud.len() > MOST_POINTS {
            CentredCloud::new(&base(&solid, radius))?
        } else {
            CentredCloud::new(&solid)?
        };
        let size = CloudSize::of(&centred.cloud());
        let (thin, described) = (OnceLock::new(), OnceLock::new());
        let side = Self { count: cloud.len(), radius, centred, size, thin, described };
        if options.method.looks_globally() {
            side.features()?;
        }
        Ok(side)
    }

    /// The part that the network looks at, made once.
    pub fn thin(&self) -> &PointCloud {
        self.thin.get_or_init(|| thinned(&self.centred.cloud()))
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

/// The centroids of the smallest voxels that leave [`MOST_POINTS`], sizes doubling from an eighth of the one that suits an even
/// surface: scans are dense near the scanner.
fn base(cloud: &PointCloud, radius: f64) -> PointCloud {
    let first = radius * (4.0 / MOST_POINTS as f64).sqrt() / 8.0;
    thin_from(cloud, MOST_POINTS, first, 2.0).1
}

/// Root mean square distance of the points from their mean.
fn radius(cloud: &PointCloud) -> f64 {
    let mean = cloud.centroid();
    let square = |p: &[f64; 3]| (0..3).map(|c| (p[c] - mean[c]).powi(2)).sum::<f64>();
    (cloud.points().iter().map(square).sum::<f64>() / cloud.len() as f64).sqrt()
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
    /// The first guess; the identity, if there is none.
    pub initial: Rigid,
    /// Whether there is one.
    pub guided: bool,
}

impl PreparedPair {
    pub fn new(
        source: &PointCloud,
        target: Target,
        guess: Option<&Rigid>,
        options: &Options,
    ) -> Result<Self, Error> {
        let source = PreparedCloud::new(source, options).map_err(Error::Source)?;
        let frame = source.centred.frame_to(&target.0.side.centred);
        let refine = target.0.refine.source(source.centred.cloud()).map_err(Error::Refine)?;
        let initial = frame.pose(guess.unwrap_or(&Rigid::identity()));
        Ok(Self { source, refine, target, frame, initial, guided: guess.is_some() })
    }

    /// Whether both clouds are of the size that the network was trained for, and sees whole.
    pub fn is_small(&self) -> bool {
        self.larger() <= SMALL
    }

    /// Whether the network sees all points of both clouds.
    pub fn is_seen(&self) -> bool {
        self.larger() <= SEEN
    }

    /// Points of the larger cloud.
    fn larger(&self) -> usize {
        self.source.count.max(self.target_side().count)
    }

    /// What is known of the target.
    pub fn target_side(&self) -> &PreparedCloud {
        &self.target.0.side
    }
}
